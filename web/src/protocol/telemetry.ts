/** Telemetry: which fields were asked for, and lines of them. */
import { keywordOf, wordsOf } from "./command.ts";

/** How a field is written: a number with so many decimals, one with an exponent, a whole number, or a word. */
type Shape = number | "scientific" | "whole" | "word";

const SHAPES: Readonly<Record<string, Shape>> = {
  t: 3,
  x: 6,
  y: 6,
  theta: 5,
  cxx: "scientific",
  cxy: "scientific",
  cxt: "scientific",
  cyy: "scientific",
  cyt: "scientific",
  ctt: "scientific",
  v_s: 6,
  v_alpha: 5,
  s: 6,
  s_ref: 6,
  v_s_ref: 6,
  alpha: 5,
  alpha_ref: 5,
  v_alpha_ref: 5,
  move_state: "word",
  turn_state: "word",
  left_count: "whole",
  right_count: "whole",
  left_speed: 6,
  right_speed: 6,
  left_duty: 4,
  right_duty: 4,
  battery: 3,
  left_current: 3,
  right_current: 3,
  steer: 4,
  fault: "word",
  dropped: "whole",
  tick_load: 3,
};

export interface Stream {
  /** Seconds; 0: off. */
  readonly period: number;
  readonly fields: readonly string[];
}

const DEFAULT = ["t", "x", "y", "theta", "v_s", "v_alpha"];
const OWN =
  "t x y theta v_s v_s_ref v_alpha v_alpha_ref move_state turn_state left_duty right_duty left_current right_current battery tick_load".split(
    " ",
  );

/** What the page asks for: sixteen fields, the most there may be. */
export const OWN_STREAM: Stream = { period: 0.02, fields: OWN };
/** For a base that does not know `tick_load`. */
export const OLDER_STREAM: Stream = { period: 0.02, fields: [...OWN.slice(0, -1), "fault"] };

export function streamLine(stream: Stream): string {
  return `Stream ${stream.period} ${stream.fields.join(" ")}`;
}

/** What a `Stream` line asks for; undefined if it is none. */
export function streamOf(body: string): Stream | undefined {
  if (keywordOf(body) !== "stream") return undefined;
  const [period, ...fields] = wordsOf(body);
  const seconds = Number(period);
  if (period === undefined || !Number.isFinite(seconds)) return undefined;
  return { period: seconds, fields: fields.length > 0 ? fields.map((field) => field.toLowerCase()) : DEFAULT };
}

export function sameStream(one: Stream, other: Stream): boolean {
  return one.period === other.period && one.fields.join() === other.fields.join();
}

/** A line that is longer than this may have been cut: its last fields found no room. */
const NEARLY_FULL = 200;

/** The words of a telemetry line; undefined if it is none of these fields. */
export function valuesOf(line: string, stream: Stream): readonly string[] | undefined {
  if (stream.period <= 0) return undefined;
  const words = line.slice(1).trim().split(" ");
  const { length } = stream.fields;
  return words.length === length || (words.length < length && line.length > NEARLY_FULL) ? words : undefined;
}

/** Whether a line is written as telemetry of these fields would be, to the last decimal: a list's row hardly is. */
export function looksLike(line: string, stream: Stream): boolean {
  const words = valuesOf(line, stream);
  return words?.every((word, at) => fits(word, SHAPES[stream.fields[at] ?? ""])) ?? false;
}

/** Whether rows of a path (`~ number x y θ v`) could be taken for telemetry of these fields. */
export function isLikePath(stream: Stream): boolean {
  const [first] = stream.fields;
  const few = stream.fields.length === 5 || stream.fields.length === 2;
  return stream.period > 0 && few && SHAPES[first ?? ""] === "whole";
}

function fits(word: string, shape: Shape | undefined): boolean {
  if (word === "-") return shape === 3;
  if (shape === undefined) return true;
  if (shape === "word") return /^[A-Za-z][A-Za-z-]*$/.test(word);
  if (shape === "whole") return /^-?\d+$/.test(word);
  if (shape === "scientific") return /^-?\d\.\d{5}e-?\d+$/.test(word);
  const point = word.indexOf(".");
  return point > 0 && word.length - point - 1 === shape && /^-?\d+\.\d+$/.test(word);
}

/** The number in a telemetry word; NaN for what is not measured. */
export function number(word: string | undefined): number {
  return word === undefined || word === "-" || word === "" ? Number.NaN : Number(word);
}
