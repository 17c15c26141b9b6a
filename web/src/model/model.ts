/**
 * What the views see of a base: the same whether it is driven live or read from a log. Lengths are metres, angles degrees,
 * times seconds of the base's own clock, as in the protocol; NaN stands for what is not known.
 */

import type { Covariance, Pose, Posture } from "../protocol/replies.ts";
import { type AxisState, STATES } from "../protocol/states.ts";

export { type AxisState, type Covariance, type Pose, type Posture, STATES };

/** The columns of the history. States are indices into STATES. */
export const CHANNELS = [
  "t",
  "x",
  "y",
  "theta",
  "v_s",
  "v_s_ref",
  "v_alpha",
  "v_alpha_ref",
  "move_state",
  "turn_state",
  "left_duty",
  "right_duty",
  "left_current",
  "right_current",
  "battery",
  "tick_load",
  "true_x",
  "true_y",
  "true_theta",
] as const;
export type Channel = (typeof CHANNELS)[number];
export type Sample = Record<Channel, number>;

/** Samples in the order of their times, in a ring: the oldest give way. `t` never falls. */
export interface History {
  readonly capacity: number;
  /** Samples kept now. It falls when the base has begun anew: then all are new. */
  readonly length: number;
  /** Samples ever pushed: changes whenever something is new. */
  readonly pushed: number;
  /** The value of a channel, 0 being the oldest sample kept; NaN outside. */
  at(channel: Channel, index: number): number;
  /** The index of the last sample not later than t; -1 if all are later. */
  indexAt(t: number): number;
}

/** A pose with its covariance, and when it was told. */
export interface Estimate extends Pose {
  readonly t: number;
  readonly covariance: Covariance;
}

/** What is not known is undefined: a log may tell faults alone. */
export interface Status {
  readonly moveState: AxisState | undefined;
  readonly turnState: AxisState | undefined;
  readonly enabled: boolean | undefined;
  /** `none`, or the name of the fault that is latched. */
  readonly fault: string;
  /** The wheels that it is about, if the event was heard. */
  readonly place?: "left" | "right" | "both";
}

export interface Parameter {
  readonly name: string;
  readonly value: number;
  readonly min: number;
  readonly max: number;
  /** Empty for a number without one. */
  readonly unit: string;
  /** What it was when the page first heard of it (since the last save or load). */
  readonly before: number;
}

export interface PlannedPath {
  readonly mode: "path" | "chase" | "idle";
  readonly postures: readonly Posture[];
}

/** The base's map, laid out in the frame of the estimate where it can be; see docs/map.md. */
export interface MapSketch {
  readonly places: readonly MapPlace[];
  readonly arcs: readonly MapArc[];
  /** The place in whose frame the base knows where it is. */
  readonly anchor: string | undefined;
  /** The place that is drawn at the estimate's origin since nobody here knows where it was marked: the whole map may lie elsewhere. */
  readonly assumed?: string;
}

export interface MapPlace {
  readonly name: string;
  /** Radius of the meadow. */
  readonly radius: number;
  /** Where its frame lies, by the arcs from the anchor; undefined if no arcs lead there. */
  readonly pose: Pose | undefined;
  /** Radius of the circle in which it certainly lies, as seen from the anchor. */
  readonly bound: number;
  /** Where they stand in the frame of the estimate, as the place is; undefined where that is not known. */
  readonly landmarks: readonly { readonly name: string; readonly x: number | undefined; readonly y: number | undefined }[];
}

export interface MapArc {
  readonly from: string;
  readonly to: string;
  /** Width of the freeway, or undefined for none. */
  readonly freeway: number | undefined;
}

export interface Gains {
  readonly t: number;
  /** k_r, k_l, k_b, or what the vehicle has in their place. */
  readonly values: readonly number[];
  readonly deviations: readonly number[];
}

/** What is drawn to scale. */
export interface Geometry {
  readonly vehicle: "differential" | "synchro" | "tricycle" | "bisteerable";
  /** Distance of the wheels (differential), of the axles (tricycle, bisteerable). */
  readonly wheelBase: number;
  readonly track: number;
  readonly wheelDiameter: number;
}

/** One line of the conversation, for the console. */
export interface Spoken {
  /** Milliseconds of the page's clock. */
  readonly at: number;
  readonly direction: "sent" | "heard" | "note";
  readonly text: string;
}

/** The simulated world, if there is one. */
export interface World {
  readonly robot: string;
  readonly pose: Pose & { readonly t: number };
  /** Wished speed, simulated seconds a second; undefined: as fast as it goes. */
  readonly speed: number | undefined;
  /** Simulated time over wished time. */
  readonly pace: number;
  readonly broken: readonly string[];
  readonly estop: boolean;
  readonly pushed: boolean;
  /** What can be broken: the words that follow `!fault`. */
  readonly faults: readonly string[];
  /** When it was heard of last: milliseconds of the clock that never leaps. */
  readonly heardAt: number;
  /** True geometry, where it applies. */
  readonly truth: { readonly wheelBase: number; readonly leftDiameter: number; readonly rightDiameter: number } | undefined;
}

export type Connection =
  | { readonly state: "none" }
  | { readonly state: "connecting"; readonly to: string }
  | {
      readonly state: "open";
      readonly to: string;
      readonly role: "drive" | "watch";
      readonly seatFree: boolean;
      /** What came back may be another base than before: it is not driven until somebody says so. */
      readonly another: boolean;
    }
  | { readonly state: "lost"; readonly to: string; readonly why: string; readonly retryAt: number | undefined }
  | { readonly state: "log"; readonly name: string };

/** Counters of the line, for the connection's view. */
export interface LineStatistics {
  readonly heardBytesPerSecond: number;
  readonly sentBytesPerSecond: number;
  readonly damagedLines: number;
  readonly unanswered: number;
}

/** What a view may learn anew; views redraw what depends on it. */
export type Topic =
  | "connection"
  | "history"
  | "estimate"
  | "status"
  | "parameters"
  | "path"
  | "map"
  | "gains"
  | "world"
  | "spoken"
  | "events"
  | "alarm"
  | "cursor";

/** Something urgent that the user must see; undefined if nothing is. */
export interface Alarm {
  readonly text: string;
}

/** A goal that the user is dragging out or has given: where, and the heading if one was set. */
export interface Goal {
  readonly x: number;
  readonly y: number;
  readonly theta: number | undefined;
}

/** What the views may do. Each promise is resolved with the base's reply (without tag and check), or rejected with an Error whose message is for the user. */
export interface Commands {
  /** A line as typed in the console; its reply also appears among what is spoken. */
  send(line: string): Promise<string>;
  stop(): void;
  estop(): void;
  enable(): Promise<string>;
  disable(): Promise<string>;
  clearFault(): Promise<string>;
  goTo(goal: Goal): Promise<string>;
  /** Appends a posture to the path, and starts driving it if nothing moves. */
  follow(goal: Goal): Promise<string>;
  setParameter(name: string, value: string): Promise<string>;
  saveParameters(): Promise<string>;
  /** Somebody looks at the gains (or no longer): they are asked for each second then, also while calibration is off. */
  watchGains(on: boolean): void;
  /** Asks for the page's own telemetry again, after another `Stream` was typed. */
  ownStream(): Promise<string>;
  /** Takes the driver's seat, if it is free. */
  takeSeat(): void;
  /** What came back in the place of the base that was lost is to be driven. */
  confirmBase(): void;
  /** To the simulated world: the fields of the server's JSON, without id. */
  world(request: WorldRequest): Promise<void>;
  /** A fix with this noise, made from the true pose (simulated world only) and sent as ObservePos. */
  observeTruth(sigmaXy: number, sigmaTheta: number, seed: number): Promise<string>;
}

export type WorldRequest =
  | { push: [number, number, number] }
  | { fault: string }
  | { clear: true }
  | { estop: boolean }
  | { power: "cycle" };

/** Where the views look: at what is now, or at an instant of the past. */
export interface Cursor {
  /** Undefined: now. */
  readonly t: number | undefined;
}

/** A base, live or from a log. */
export interface Model {
  readonly kind: "live" | "log";
  readonly connection: Connection;
  /** What `Version` answered: name, version, target, protocol version; undefined until it has. */
  readonly version: string | undefined;
  readonly history: History;
  /** Estimates with covariance, oldest first (a bounded list). */
  readonly estimates: readonly Estimate[];
  readonly status: Status | undefined;
  readonly parameters: ReadonlyMap<string, Parameter>;
  /** Parameters differ from what is saved, as far as this page knows. */
  readonly unsaved: boolean;
  readonly path: PlannedPath;
  readonly map: MapSketch | undefined;
  /** Gains, oldest first (a bounded list). */
  readonly gains: readonly Gains[];
  readonly geometry: Geometry;
  readonly world: World | undefined;
  readonly spoken: readonly Spoken[];
  readonly statistics: LineStatistics;
  readonly alarm: Alarm | undefined;
  /** The telemetry is the page's own; false after another `Stream` was accepted. */
  readonly streaming: boolean;
  /** The pose that was heard last, by telemetry or as `EstPos`. Undefined for a log, and before there is one. */
  readonly pose: Pose | undefined;
  /** When they were heard last, by the clock that never leaps, ms; undefined: never, or a log. */
  readonly heardAt: {
    /** A sample of telemetry. */
    readonly telemetry: number | undefined;
    readonly pose: number | undefined;
    /** The states of both axes. */
    readonly states: number | undefined;
    /** Whether the motors are enabled. */
    readonly motors: number | undefined;
  };
  /** The base has left several questions in a row unanswered, and nothing that was asked has been answered since: a Stop may not reach it either. */
  readonly unresponsive: boolean;
  readonly cursor: Cursor;
  /** Undefined for a log, and for who only watches (but `takeSeat`, and a watcher has no others): see `mayDrive`. */
  readonly commands: Commands | undefined;
  /** Commands are obeyed: a live connection in the driver's seat, to a base that nobody takes for another one. */
  readonly mayDrive: boolean;
  setCursor(t: number | undefined): void;
  /** Calls back when one of these topics has something new, at most once a frame; the returned function ends that. */
  subscribe(topics: readonly Topic[], listener: () => void): () => void;
}
