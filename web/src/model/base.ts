/**
 * What is known of a base from what it says, whoever asked: replies, lists, events, telemetry. It takes what was sent, too, since a reply like `OK` means what its
 * command did. It sends nothing; what should be asked next it tells.
 */
import { keywordOf, wordsOf } from "../protocol/command.ts";
import { unwrap } from "../protocol/line.ts";
import { estPos, gains, type List, ListReader, type MapRow, param, status } from "../protocol/replies.ts";
import { looksLike, OLDER_STREAM, OWN_STREAM, type Stream, sameStream, streamOf } from "../protocol/telemetry.ts";
import { Checks } from "./checks.ts";
import type { FaultChange } from "./faults.ts";
import { layout } from "./layout.ts";
import type { AxisState, Estimate, Gains, Geometry, MapSketch, PlannedPath, Pose, Status, Topic } from "./model.ts";
import { STATES } from "./model.ts";
import { Parameters } from "./parameters.ts";
import { Recorder } from "./recorder.ts";
import { geometryOf } from "./shape.ts";

const MAX_ESTIMATES = 4000;
const MAX_GAINS = 2000;
const MAX_FAULTS = 1000;
/** Tags whose commands are remembered: more than can be unanswered. */
const MAX_ASKED = 64;
/** The event, which may stand behind half a line that the reset has cut, and has no check if the base has forgotten that it needs one. */
const BOOT = /! boot [\w-]+(\*[0-9A-Fa-f]{4})?$/;
const IDLE: PlannedPath = { mode: "idle", postures: [] };
const AFTER_PATH = new Set("goto follow chase stop estop disable move m turn t resetpos".split(" "));
const AFTER_MAP = new Set("mark sight label freeway forgetmap".split(" "));

export interface Effects {
  /** Something is new. */
  readonly changed: (...topics: Topic[]) => void;
  /** This should be asked when there is a chance. */
  readonly want: (line: string) => void;
  /** The base has started anew: all of it is to be asked again. */
  readonly anew: () => void;
  /** Telemetry is on, or off. */
  readonly streaming: (on: boolean) => void;
  /** Milliseconds of the page's clock that never leaps. */
  readonly elapsed: () => number;
}

/** What a line was, for the console. */
export type Heard = "reply" | "event" | "row" | "telemetry" | "damaged";

export class Base {
  readonly recorder = new Recorder();
  readonly parameters = new Parameters();
  estimates: Estimate[] = [];
  gains: Gains[] = [];
  /** What was latched when. */
  faults: FaultChange[] = [];
  status: Status | undefined;
  version: string | undefined;
  path: PlannedPath = IDLE;
  map: MapSketch | undefined;
  geometry: Geometry = geometryOf(new Map());
  /** The pose that was told last, by telemetry or by `EstPos`. */
  pose: Pose | undefined;
  /** When samples, the pose, the states of the axes and the motors were heard of last, by the page's clock that never leaps. */
  telemetryAt: number | undefined;
  poseAt: number | undefined;
  statesAt: number | undefined;
  motorsAt: number | undefined;
  /** When any line of telemetry was: one without a time is no sample. */
  rowAt: number | undefined;
  calibrating = false;
  damaged = 0;
  readonly #effects: Effects;
  readonly #checks = new Checks();
  #lists = new ListReader();
  #asked = new Map<number, string>();
  #marks = new Map<string, Pose>();
  #rows: readonly MapRow[] = [];
  #anchor: string | undefined;
  /** The next list of parameters is of what is stored. */
  #isLoaded = false;
  /** The vehicle, if the simulator has told it. */
  #vehicle: string | undefined;

  constructor(effects: Effects) {
    this.#effects = effects;
  }

  get streaming(): boolean {
    const { stream } = this.recorder;
    return stream !== undefined && (sameStream(stream, OWN_STREAM) || sameStream(stream, OLDER_STREAM));
  }

  set vehicle(name: string | undefined) {
    this.#vehicle = name;
    this.#shape();
  }

  /** Another base, or the same one after a reset: it has forgotten what it was told, and its clock begins anew. */
  forget(): void {
    this.recorder.restart();
    this.recorder.stream = undefined;
    this.parameters.clear();
    this.estimates = [];
    this.gains = [];
    this.faults = [];
    this.status = undefined;
    this.path = IDLE;
    this.map = undefined;
    this.calibrating = false;
    this.pose = undefined;
    this.telemetryAt = undefined;
    this.poseAt = undefined;
    this.statesAt = undefined;
    this.motorsAt = undefined;
    this.rowAt = undefined;
    this.#checks.unknown();
    this.#marks.clear();
    this.#rows = [];
    this.reconnected();
    this.#effects.changed("history", "estimate", "status", "parameters", "path", "map", "gains");
  }

  /** The line was cut: what had begun does not go on. */
  reconnected(): void {
    this.#lists.reset();
    this.#asked.clear();
    this.recorder.stream = undefined;
  }

  /** Telemetry that was on before this page came. */
  joined(stream: Stream): void {
    this.#stream(stream);
  }

  /** A command is on its way, sent by this page or by who drives. */
  sent(line: string): void {
    const { tag, body } = unwrap(line);
    if (tag === undefined) return;
    this.#asked.delete(tag);
    this.#asked.set(tag, body);
    const [oldest] = this.#asked.keys();
    if (this.#asked.size > MAX_ASKED && oldest !== undefined) this.#asked.delete(oldest);
  }

  /** A line of the base. */
  heard(line: string): Heard {
    if (BOOT.test(line)) {
      this.#event(["boot"]);
      return "event";
    }
    const { tag, body, check } = unwrap(line);
    if (!this.#checks.pass(check, body.startsWith("~"))) return this.#damage();
    if (body.startsWith("~")) return this.#row(body);
    if (body.startsWith("!")) {
      this.#event(body.slice(1).trim().split(/\s+/));
      return "event";
    }
    this.#reply(tag, body);
    return "reply";
  }

  /** More rows of a list are to come. */
  get isListing(): boolean {
    return this.#lists.left > 0;
  }

  #damage(): Heard {
    this.damaged += 1;
    return "damaged";
  }

  #row(line: string): Heard {
    const { stream } = this.recorder;
    if (this.#lists.left > 0 && !(stream && looksLike(line, stream))) {
      const taken = this.#lists.take(line.slice(1).trim().split(/\s+/));
      if (taken !== false) {
        if (taken !== true) this.#listed(taken);
        return "row";
      }
    }
    // Who watches may not know yet what the driver has asked for.
    if (!stream) return "telemetry";
    const outcome = this.recorder.line(line);
    if (outcome === "damaged") return this.#damage();
    this.rowAt = this.#effects.elapsed();
    if (outcome === "anew") {
      this.estimates = [];
      this.gains = [];
      this.faults = [];
      this.#effects.anew();
    }
    // What has no time is no sample: the last sample says nothing of now.
    const isSample = outcome !== "nothing";
    if (isSample) this.#sampled();
    this.#followStates(isSample);
    this.#effects.changed("history");
    return "telemetry";
  }

  #sampled(): void {
    const now = this.#effects.elapsed();
    this.telemetryAt = now;
    this.#posed({ x: this.recorder.last("x"), y: this.recorder.last("y"), theta: this.recorder.last("theta") });
  }

  #posed({ x, y, theta }: Pose): void {
    if (!Number.isFinite(x + y + theta)) return;
    this.pose = { x, y, theta };
    this.poseAt = this.#effects.elapsed();
  }

  /** Telemetry tells the states sooner than `GetStatus`. */
  #followStates(isSample: boolean): void {
    const [move, turn] = isSample ? [stateAt(this.recorder.last("move_state")), stateAt(this.recorder.last("turn_state"))] : [];
    if (move && turn) this.statesAt = this.#effects.elapsed();
    const known = this.status;
    if (!known) return;
    const moveState = move ?? known.moveState;
    const turnState = turn ?? known.turnState;
    const fault = this.recorder.fault ?? known.fault;
    if (moveState !== known.moveState || turnState !== known.turnState || fault !== known.fault)
      this.#status({ ...known, moveState, turnState, fault });
  }

  #status(next: Status): void {
    const known = this.status;
    const { place, ...rest } = next;
    const wheels = place ?? (known?.fault === next.fault ? known.place : undefined);
    this.status = wheels === undefined ? rest : { ...rest, place: wheels };
    this.#noteFault();
    this.#effects.changed("status");
  }

  /** For whoever looks back. */
  #noteFault(): void {
    const t = this.recorder.history.last;
    if (!this.status || !Number.isFinite(t) || this.faults.at(-1)?.fault === this.status.fault) return;
    const { fault, place } = this.status;
    bounded(this.faults, { t, fault, ...(place && { place }) }, MAX_FAULTS);
  }

  #event(words: readonly string[]): void {
    const [what, name, place] = words;
    if (what === "boot") this.#effects.anew();
    if (what === "fault" && name !== undefined) {
      const known = this.status ?? { moveState: undefined, turnState: undefined, enabled: undefined, fault: name };
      const { place: _, ...rest } = known;
      const wheels = place === "left" || place === "right" || place === "both" ? place : undefined;
      this.status = { ...rest, fault: name, ...(wheels && { place: wheels }) };
      this.#noteFault();
      this.#effects.changed("status");
      this.#effects.want("GetStatus");
    }
    if (what === "posture" || what === "path" || what === "chase" || what === "fault") this.#effects.want("GetPath");
    if (what === "map") this.#effects.want("GetMap");
    this.#effects.changed("events");
  }

  #reply(tag: number | undefined, body: string): void {
    const keyword = body.split(/\s/, 1)[0] ?? "";
    const words = wordsOf(body);
    // A reply begins, so the rows of the list before it have all come.
    const list = this.#lists.begin(keyword, words);
    if (list) this.#listed(list);
    this.#data(keyword, words);
    const command = tag === undefined ? undefined : this.#asked.get(tag);
    if (tag !== undefined) this.#asked.delete(tag);
    if (command !== undefined && keyword !== "ERR") this.#obeyed(command, keyword);
  }

  /** A reply that tells something, whoever asked. */
  #data(keyword: string, words: readonly string[]): void {
    if (keyword === "Status") {
      const told = status(words);
      if (told) {
        this.statesAt = this.#effects.elapsed();
        this.motorsAt = this.statesAt;
        this.#status(told);
      }
    } else if (keyword === "EstPos") {
      const told = estPos(words);
      if (told) this.#posed(told);
      const t = this.recorder.history.last;
      if (told && Number.isFinite(t)) {
        bounded(this.estimates, { ...told, t }, MAX_ESTIMATES);
        this.#effects.changed("estimate");
      }
    } else if (keyword === "Gains") {
      const told = gains(words);
      const t = this.recorder.history.last;
      if (told && Number.isFinite(t)) {
        bounded(this.gains, { ...told, t }, MAX_GAINS);
        this.#effects.changed("gains");
      }
    } else if (keyword === "Param") {
      const told = param(words);
      if (told) {
        this.parameters.told(told);
        this.#required([told]);
        this.#shape();
        this.#effects.changed("parameters");
      }
    } else if (keyword === "Version") {
      this.version = words.join(" ");
      this.#effects.changed("status");
    }
  }

  #listed(list: List): void {
    if (list.kind === "Params") {
      this.parameters.listed(list.rows);
      this.#required(list.rows);
      if (this.#isLoaded) this.parameters.saved();
      this.#isLoaded = false;
      this.#shape();
      this.#effects.changed("parameters");
    } else if (list.kind === "Path") {
      this.path = { mode: list.mode, postures: list.rows };
      this.#effects.changed("path");
    } else if (list.kind === "Map") {
      this.#rows = list.rows;
      this.#anchor = list.anchor;
      this.#sketch();
    }
  }

  #required(rows: readonly { readonly name: string; readonly value: number }[]): void {
    const row = rows.find(({ name }) => name === "require_crc");
    if (row) this.#checks.told(row.value === 1);
  }

  #sketch(): void {
    this.map = this.#rows.length === 0 ? undefined : layout(this.#rows, this.#anchor, this.#marks);
    this.#effects.changed("map");
  }

  #shape(): void {
    const next = geometryOf(this.parameters.all, this.#vehicle);
    if (JSON.stringify(next) === JSON.stringify(this.geometry)) return;
    this.geometry = next;
    this.#effects.changed("parameters");
  }

  /** A command was not refused; `answer`: the keyword of its reply. */
  #obeyed(command: string, answer: string): void {
    const keyword = keywordOf(command);
    const words = wordsOf(command);
    const { want, changed } = this.#effects;
    if (keyword === "stream") {
      const stream = streamOf(command);
      if (stream) this.#stream(stream);
    }
    if (keyword === "setparam" && words[0] !== undefined) {
      const name = words[0].toLowerCase();
      if (name === "require_crc") this.#checks.unknown();
      want(`GetParam ${name}`);
    }
    if (keyword === "saveparams") {
      this.parameters.saved();
      changed("parameters");
    }
    if (keyword === "loadparams") this.#isLoaded = true;
    if (keyword === "loadparams" || keyword === "resetparams") {
      this.#checks.unknown();
      want("ListParams");
    }
    if (keyword === "calibrate") {
      if (words[0]?.toLowerCase() === "on") this.calibrating = true;
      if (words[0]?.toLowerCase() === "off") this.calibrating = false;
      want("GetGains");
      // What was learned is in the parameters.
      want("ListParams");
    }
    if (keyword === "mark" && answer === "Marked" && words[0] !== undefined) this.#marked(words[0]);
    if (keyword === "resetpos") this.#marks.clear();
    if (keyword === "forgetmap" && words.length === 0) this.#marks.clear();
    if (keyword === "clearfault" || keyword === "enable" || keyword === "disable") want("GetStatus");
    if (AFTER_PATH.has(keyword)) want("GetPath");
    if (AFTER_MAP.has(keyword)) want("GetMap");
    if (keyword === "stop" || keyword === "estop") changed("events");
  }

  /** The frame of a place is the pose in which it was marked. */
  #marked(name: string): void {
    const [x, y, theta] = [this.recorder.last("x"), this.recorder.last("y"), this.recorder.last("theta")];
    if (Number.isFinite(x + y + theta)) this.#marks.set(name, { x, y, theta });
  }

  #stream(stream: Stream): void {
    this.recorder.stream = stream;
    this.#effects.streaming(stream.period > 0);
    this.#effects.changed("history");
  }
}

function stateAt(index: number): AxisState | undefined {
  return STATES[index];
}

function bounded<Item>(list: Item[], item: Item, most: number): void {
  list.push(item);
  if (list.length > most) list.splice(0, Math.ceil(most / 10));
}
