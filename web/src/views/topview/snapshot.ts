/** What is known of the base at the instant that is looked at: now, or the time of the cursor. */
import type { Covariance, Estimate, History, Model, Pose } from "../../model/model.ts";
import { STALE, secondsSince } from "../freshness.ts";
import type { Motion } from "./silhouette.ts";
import { carry } from "./uncertainty.ts";

/** A covariance is carried along for so long, s; after that it is drawn where it was told. */
const CARRIED = 1;

export interface Snapshot {
  /** Base's time of what is shown; undefined: nothing was heard yet. */
  readonly t: number | undefined;
  /** It is the past that is looked at. */
  readonly past: boolean;
  /** Index of the sample; −1: none. */
  readonly index: number;
  readonly pose: Pose | undefined;
  /** The pose is the sample's. */
  readonly sampled: boolean;
  readonly motion: Motion;
  /** Seconds since the pose was heard; 0 for the past, which does not age. */
  readonly age: number;
  readonly doubt: { readonly pose: Pose; readonly covariance: Covariance } | undefined;
  readonly truth: Pose | undefined;
  readonly truthAge: number;
}

const STILL_UNKNOWN: Motion = { speed: Number.NaN, turning: Number.NaN };

/** `now` is milliseconds of the clock that never leaps. */
export function snapshot(model: Model, now: number): Snapshot {
  const { history, cursor } = model;
  const past = cursor.t !== undefined;
  const live = model.kind === "live" && !past;
  const index = cursor.t === undefined ? history.length - 1 : history.indexAt(cursor.t);
  const { heardAt } = model;
  const isFresh = !live || (secondsSince(heardAt.telemetry, now) ?? 0) <= STALE;
  const last = sampledPose(history, index);
  // A sample tells the pose, unless the telemetry has stopped or has no pose in it: then the base still answers where it is.
  const sampled = last !== undefined && isFresh;
  const told = sampled || !live ? last : model.pose;
  const newest = cursor.t === undefined ? model.estimates.at(-1) : before(model.estimates, cursor.t);
  const pose = told ?? newest;
  const time = history.at("t", index);
  const { world } = model;
  return {
    t: cursor.t ?? (Number.isNaN(time) ? newest?.t : time),
    past,
    index,
    pose,
    motion: isFresh ? { speed: history.at("v_s", index), turning: history.at("v_alpha", index) } : STILL_UNKNOWN,
    sampled,
    age: live ? (secondsSince(sampled ? heardAt.telemetry : heardAt.pose, now) ?? 0) : 0,
    doubt: newest && doubtAt(newest, told, time),
    truth: live && world ? world.pose : truePose(history, index),
    truthAge: live && world ? (secondsSince(world.heardAt, now) ?? 0) : 0,
  };
}

function doubtAt(estimate: Estimate, pose: Pose | undefined, t: number): Snapshot["doubt"] {
  if (!pose || !(Math.abs(t - estimate.t) <= CARRIED)) return { pose: estimate, covariance: estimate.covariance };
  return { pose, covariance: carry(estimate.covariance, estimate, pose) };
}

function sampledPose(history: History, index: number): Pose | undefined {
  return known(history.at("x", index), history.at("y", index), history.at("theta", index));
}

export function truePose(history: History, index: number): Pose | undefined {
  return known(history.at("true_x", index), history.at("true_y", index), history.at("true_theta", index));
}

function known(x: number, y: number, theta: number): Pose | undefined {
  return Number.isFinite(x) && Number.isFinite(y) && Number.isFinite(theta) ? { x, y, theta } : undefined;
}

/** The last of the estimates that is not later than t. */
export function before(estimates: readonly Estimate[], t: number): Estimate | undefined {
  let [low, high] = [0, estimates.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((estimates[middle] as Estimate).t <= t) low = middle + 1;
    else high = middle;
  }
  return estimates[low - 1];
}

/** Milliseconds until the first of what is fresh becomes stale; undefined: nothing will. */
export function freshFor(shown: Snapshot): number | undefined {
  const fresh = [shown.pose && shown.age, shown.truth && shown.truthAge].filter((age) => age !== undefined && age <= STALE) as number[];
  return shown.past || fresh.length === 0 ? undefined : 1000 * (STALE - Math.max(...fresh));
}
