/** What the base says, read: replies, events and the rows of lists. A line that is not as docs/protocol.md has it is undefined, never a guess. */
import { type AxisState, STATES } from "./states.ts";

/** The upper triangle of a covariance, by rows: m², m·°, °². */
export type Covariance = readonly [cxx: number, cxy: number, cxt: number, cyy: number, cyt: number, ctt: number];

export interface Pose {
  readonly x: number;
  readonly y: number;
  readonly theta: number;
}

/** A posture of the path that is left to drive; theta and speed are undefined where the path leaves them open. */
export interface Posture {
  readonly number: number;
  readonly x: number;
  readonly y: number;
  readonly theta: number | undefined;
  readonly speed: number | undefined;
}

export interface EstPos extends Pose {
  readonly covariance: Covariance;
}

/** All words as numbers, if they are. */
function numbers(words: readonly string[]): number[] | undefined {
  const values = words.map((word) => (word === "" ? Number.NaN : Number(word)));
  return values.every(Number.isFinite) ? values : undefined;
}

function isState(word: string | undefined): word is AxisState {
  return (STATES as readonly (string | undefined)[]).includes(word);
}

/** `EstPos x y θ Cxx Cxy Cxθ Cyy Cyθ Cθθ`. */
export function estPos(words: readonly string[]): EstPos | undefined {
  const [x, y, theta, ...rest] = numbers(words) ?? [];
  if (x === undefined || y === undefined || theta === undefined) return undefined;
  const covariance = covarianceOf(rest);
  return covariance && { x, y, theta, covariance };
}

export function covarianceOf(values: readonly number[]): Covariance | undefined {
  const [xx, xy, xt, yy, yt, tt, more] = values;
  if (xx === undefined || xy === undefined || xt === undefined || yy === undefined || yt === undefined || tt === undefined)
    return undefined;
  return more === undefined ? [xx, xy, xt, yy, yt, tt] : undefined;
}

/** What both axes do, whether the motors are enabled, and what is wrong. */
export interface StatusReply {
  readonly moveState: AxisState;
  readonly turnState: AxisState;
  readonly enabled: boolean;
  /** `none`, or the name of the fault that is latched. */
  readonly fault: string;
}

/** `Status <move state> <turn state> <flags> <fault>`. */
export function status(words: readonly string[]): StatusReply | undefined {
  const [moveState, turnState, flag, fault, more] = words;
  if (!isState(moveState) || !isState(turnState) || fault === undefined || more !== undefined) return undefined;
  if (flag !== "enabled" && flag !== "disabled") return undefined;
  return { moveState, turnState, enabled: flag === "enabled", fault };
}

/** `Gains k_r k_l k_b` and their deviations, or what the vehicle has in their place. */
export function gains(words: readonly string[]): { values: number[]; deviations: number[] } | undefined {
  const all = numbers(words);
  if (!all || all.length === 0 || all.length % 2 !== 0) return undefined;
  return { values: all.slice(0, all.length / 2), deviations: all.slice(all.length / 2) };
}

export interface ParamValue {
  readonly name: string;
  readonly value: number;
  readonly unit: string;
}

export interface ParamRow extends ParamValue {
  readonly min: number;
  readonly max: number;
}

/** A name, as parameters have them. */
const NAME = /^[a-z][a-z0-9_]*$/;

/** `Param name value unit`. */
export function param(words: readonly string[]): ParamValue | undefined {
  const [name, value, unit, more] = words;
  const number = Number(value);
  if (name === undefined || !NAME.test(name) || !value || !Number.isFinite(number) || unit === undefined || more !== undefined)
    return undefined;
  return { name, value: number, unit: unit === "-" ? "" : unit };
}

/** `~ name value min max unit`. */
export function paramRow(words: readonly string[]): ParamRow | undefined {
  const [name, value, min, max, unit, more] = words;
  const of = param([name ?? "", value ?? "", unit ?? ""]);
  const range = numbers([min ?? "", max ?? ""]);
  if (!of || unit === undefined || !range || more !== undefined) return undefined;
  const [least = Number.NaN, most = Number.NaN] = range;
  return { ...of, min: least, max: most };
}

/** `~ number x y θ v`, with `-` for what it does not have; `~ number passed` is behind the base by now. */
export function pathRow(words: readonly string[]): Posture | "passed" | undefined {
  const [number, x, y, theta, speed, more] = words;
  if (number === undefined || !/^\d+$/.test(number)) return undefined;
  if (x === "passed" && y === undefined) return "passed";
  const place = numbers([x ?? "", y ?? ""]);
  const rest = [theta, speed].map((word) => (word === "-" ? undefined : Number(word)));
  if (!place || theta === undefined || speed === undefined || more !== undefined || rest.some(Number.isNaN)) return undefined;
  const [px = Number.NaN, py = Number.NaN] = place;
  return { number: Number(number), x: px, y: py, theta: rest[0], speed: rest[1] };
}

export interface PlaceRow {
  readonly kind: "place";
  readonly name: string;
  readonly radius: number;
}

export interface LandmarkRow {
  readonly kind: "landmark";
  readonly name: string;
  readonly place: string;
  /** Where it stands as seen from the place: distance, bearing. */
  readonly spot: { readonly distance: number; readonly bearing: number; readonly radius: number } | undefined;
}

export interface ArcRow {
  readonly kind: "arc";
  readonly from: string;
  readonly to: string;
  /** What is certain: in the disc of this radius about that point, headed within η ± α. */
  readonly bound: {
    readonly distance: number;
    readonly bearing: number;
    readonly radius: number;
    readonly heading: number;
    readonly half: number;
  };
  readonly freeway: number | undefined;
  readonly likely: Pose;
}

export type MapRow = PlaceRow | LandmarkRow | ArcRow;

/** `~ place …`, `~ landmark …`, `~ arc …`. */
export function mapRow(words: readonly string[]): MapRow | undefined {
  const [kind, name, other] = words;
  if (name === undefined || other === undefined) return undefined;
  if (kind === "place" && words.length === 3) {
    const [radius] = numbers([other]) ?? [];
    return radius === undefined ? undefined : { kind, name, radius };
  }
  if (kind === "landmark" && words.length === 3) return { kind, name, place: other, spot: undefined };
  if (kind === "landmark" && words.length === 6) {
    const [distance, bearing, radius] = numbers(words.slice(3)) ?? [];
    if (distance === undefined || bearing === undefined || radius === undefined) return undefined;
    return { kind, name, place: other, spot: { distance, bearing, radius } };
  }
  if (kind === "arc" && words.length === 18) return arcRow(name, other, words);
  return undefined;
}

/** `~ arc from to d β r η α width x y θ Cxx Cxy Cxθ Cyy Cyθ Cθθ`. */
function arcRow(from: string, to: string, words: readonly string[]): ArcRow | undefined {
  const width = words[8];
  const freeway = width === "-" ? undefined : Number(width);
  const figures = numbers([...words.slice(3, 8), ...words.slice(9, 12)]);
  if (!figures || Number.isNaN(freeway)) return undefined;
  const [distance = 0, bearing = 0, radius = 0, heading = 0, half = 0, x = 0, y = 0, theta = 0] = figures;
  return { kind: "arc", from, to, bound: { distance, bearing, radius, heading, half }, freeway, likely: { x, y, theta } };
}

/** A list: the reply that begins it and the rows that follow. */
export type List =
  | { readonly kind: "Params"; readonly rows: ParamRow[] }
  | { readonly kind: "Path"; readonly rows: Posture[]; readonly mode: "path" | "chase" | "idle" }
  | { readonly kind: "Map"; readonly rows: MapRow[]; readonly anchor: string | undefined }
  | { readonly kind: "other"; readonly rows: string[] };

/** Puts the rows of lists together. Rows come in order behind their reply and before the next one; telemetry and events may come between them. */
export class ListReader {
  #list: List | undefined;
  #left = 0;

  /** How many rows are still to come. */
  get left(): number {
    return this.#left;
  }

  /** What list is under way. */
  get kind(): List["kind"] | undefined {
    return this.#list?.kind;
  }

  /** A reply came: it may begin a list, and it ends one whose rows were lost. The list, if it is empty. */
  begin(keyword: string, words: readonly string[]): List | undefined {
    this.#list = undefined;
    this.#left = 0;
    const counts = (keyword === "Map" ? words.slice(0, 3) : words.slice(0, 1)).map(Number);
    const list = listOf(keyword, words);
    const left = counts.reduce((sum, count) => sum + count, 0);
    if (!list || !Number.isInteger(left) || left < 0 || left > MAX_ROWS) return undefined;
    if (left === 0) return list;
    this.#list = list;
    this.#left = left;
    return undefined;
  }

  /** Takes a row; false if it is none of this list. The list, if it is complete now. */
  take(words: readonly string[]): List | boolean {
    const list = this.#list;
    if (!list || !add(list, words)) return false;
    this.#left -= 1;
    if (this.#left > 0) return true;
    this.#list = undefined;
    return list;
  }

  /** Lines were lost. */
  reset(): void {
    this.#list = undefined;
    this.#left = 0;
  }
}

/** More than any base lists. */
const MAX_ROWS = 10_000;

function listOf(keyword: string, words: readonly string[]): List | undefined {
  const [first, mode] = words;
  if (keyword === "Params" && words.length === 1) return { kind: "Params", rows: [] };
  if (keyword === "Path" && (mode === "path" || mode === "chase" || mode === "idle")) return { kind: "Path", rows: [], mode };
  if (keyword === "Map" && words.length === 4) return { kind: "Map", rows: [], anchor: words[3] === "-" ? undefined : words[3] };
  const counted = keyword === "Route" || (keyword === "AmIThere" && words.length === 1);
  return counted && /^\d+$/.test(first ?? "") ? { kind: "other", rows: [] } : undefined;
}

/** Adds a row to its list; false if it is none. */
function add(list: List, words: readonly string[]): boolean {
  switch (list.kind) {
    case "Params":
      return put(list.rows, paramRow(words));
    case "Path": {
      const row = pathRow(words);
      return row === "passed" || put(list.rows, row);
    }
    case "Map":
      return put(list.rows, mapRow(words));
    case "other":
      return (words[0] === "route" || words[0] === "there") && put(list.rows, words.join(" "));
  }
}

function put<Row>(rows: Row[], row: Row | undefined): boolean {
  if (row === undefined) return false;
  rows.push(row);
  return true;
}
