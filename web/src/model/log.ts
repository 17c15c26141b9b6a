/** A log that was loaded: what was recorded of a base, to look at and scrub through. Nobody drives it. */
import { changeAt, type FaultChange } from "./faults.ts";
import type { Alarm, Connection, Cursor, Estimate, Geometry, History, Model, PlannedPath, Spoken, Status, Topic } from "./model.ts";
import { STATES } from "./model.ts";
import { type NextFrame, nextFrame, Topics } from "./topics.ts";

const NEVER: Model["heardAt"] = { telemetry: undefined, pose: undefined, states: undefined, motors: undefined };

/** What was read. */
export interface Recording {
  readonly name: string;
  readonly history: History;
  readonly estimates: readonly Estimate[];
  /** In the order of their times. */
  readonly faults: readonly FaultChange[];
  readonly spoken: readonly Spoken[];
  readonly geometry: Geometry;
}

export class LogModel implements Model {
  readonly kind = "log";
  readonly connection: Connection;
  readonly version = undefined;
  readonly parameters: Model["parameters"] = new Map();
  readonly unsaved = false;
  readonly path: PlannedPath = { mode: "idle", postures: [] };
  readonly map = undefined;
  readonly gains = [];
  readonly world = undefined;
  readonly statistics = { heardBytesPerSecond: 0, sentBytesPerSecond: 0, damagedLines: 0, unanswered: 0 };
  readonly alarm: Alarm | undefined = undefined;
  readonly streaming = true;
  readonly pose = undefined;
  readonly heardAt = NEVER;
  readonly unresponsive = false;
  readonly commands = undefined;
  readonly mayDrive = false;
  readonly history: History;
  readonly estimates: readonly Estimate[];
  readonly spoken: readonly Spoken[];
  readonly geometry: Geometry;
  readonly #faults: readonly FaultChange[];
  readonly #topics: Topics;
  cursor: Cursor = { t: undefined };

  constructor(recording: Recording, frame: NextFrame = nextFrame()) {
    this.connection = { state: "log", name: recording.name };
    this.history = recording.history;
    this.estimates = recording.estimates;
    this.spoken = recording.spoken;
    this.geometry = recording.geometry;
    this.#faults = recording.faults;
    this.#topics = new Topics(frame);
  }

  /** As it was at the cursor; without one, at the end. */
  get status(): Status | undefined {
    const { history, cursor } = this;
    const at = cursor.t === undefined ? history.length - 1 : history.indexAt(cursor.t);
    const moveState = STATES[history.at("move_state", at)];
    const turnState = STATES[history.at("turn_state", at)];
    const change = changeAt(this.#faults, cursor.t ?? Number.POSITIVE_INFINITY);
    if (!moveState && !turnState && !change) return undefined;
    // No log tells whether the motors were enabled.
    return { moveState, turnState, enabled: undefined, fault: change?.fault ?? "none", ...(change?.place && { place: change.place }) };
  }

  setCursor(t: number | undefined): void {
    this.cursor = { t };
    this.#topics.publish("cursor", "status");
  }

  subscribe(topics: readonly Topic[], listener: () => void): () => void {
    return this.#topics.subscribe(topics, listener);
  }

  /** The fault that was latched then, or `none`; undefined if the log does not tell faults. */
  faultAt(t: number): string | undefined {
    return changeAt(this.#faults, t)?.fault;
  }
}
