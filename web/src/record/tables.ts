/** The CSV files that can be looked at, each told by its columns. Angles in files of hil-sim are radians, in those of this page degrees. */
import { wrap } from "../model/layout.ts";
import { CHANNELS, type Channel, type Covariance, STATES } from "../model/model.ts";
import type { Builder } from "./builder.ts";
import type { Columns, TakeRow } from "./header.ts";
import { odometry } from "./odometry.ts";

/** Degrees in a radian. */
const DEGREES = 180 / Math.PI;

/** What reads a table with these columns. Throws if none does, or a column is missing. */
export function table(columns: Columns, to: Builder): TakeRow {
  if (columns.has("est_x")) return trace(columns, to);
  if (columns.has("left", "right") || columns.has("drive")) return odometry(columns, to);
  if (columns.has("x", "v_s") || columns.has("tick_load")) return saved(columns, to);
  if (columns.has("cxx") && columns.has("x")) return replay(columns, to);
  throw new Error(
    "these are not the columns of a trace (est_x …), of a saved history (x, v_s …), of a replay (x, cxx …) or of a robot's log (t, left, right)",
  );
}

/** In the file's order; of the upper triangle the entries with the heading, once and twice. */
const COVARIANCE: readonly (readonly [name: string, degrees: number])[] = [
  ["cxx", 1],
  ["cxy", 1],
  ["cxt", DEGREES],
  ["cyy", 1],
  ["cyt", DEGREES],
  ["ctt", DEGREES * DEGREES],
];

function covariance(columns: Columns): (cells: readonly string[]) => Covariance {
  const places = COVARIANCE.map(([name, degrees]) => [columns.find(name), degrees] as const);
  return (cells) => {
    const [xx = 0, xy = 0, xt = 0, yy = 0, yt = 0, tt = 0] = places.map(([at, degrees]) => columns.number(cells, at) * degrees);
    return [xx, xy, xt, yy, yt, tt];
  };
}

const TRACE: readonly (readonly [channel: Channel, column: string, factor: number])[] = [
  ["t", "t", 1],
  ["x", "est_x", 1],
  ["y", "est_y", 1],
  ["theta", "est_theta", DEGREES],
  ["v_s", "v_s", 1],
  ["v_s_ref", "v_s_ref", 1],
  ["v_alpha", "v_alpha", DEGREES],
  ["v_alpha_ref", "v_alpha_ref", DEGREES],
  ["left_duty", "left_duty", 1],
  ["right_duty", "right_duty", 1],
  ["left_current", "left_current", 1],
  ["right_current", "right_current", 1],
  ["battery", "battery", 1],
  ["true_x", "true_x", 1],
  ["true_y", "true_y", 1],
  ["true_theta", "true_theta", DEGREES],
];

/** A trace of `hil-sim`. */
function trace(columns: Columns, to: Builder): TakeRow {
  const places = TRACE.map(([channel, column, factor]) => [channel, columns.find(column), factor] as const);
  const states = (["move_state", "turn_state"] as const).map((name) => [name, columns.find(name)] as const);
  const fault = columns.find("fault");
  const uncertainty = covariance(columns);
  return (cells) => {
    const { sample } = to;
    to.clear();
    for (const [channel, at, factor] of places) sample[channel] = columns.number(cells, at) * factor;
    for (const [channel, at] of states) sample[channel] = columns.word(cells, at, STATES);
    sample.theta = wrap(sample.theta);
    sample.true_theta = wrap(sample.true_theta);
    const name = cells[fault] ?? "";
    if (name === "") throw new Error("column `fault`: it is empty");
    const told = uncertainty(cells);
    to.row();
    to.fault({ t: sample.t, fault: name });
    to.estimate({ t: sample.t, x: sample.x, y: sample.y, theta: sample.theta, covariance: told });
  };
}

/** What this page has saved: see `csv.ts`. Channels that were never known may be missing. */
function saved(columns: Columns, to: Builder): TakeRow {
  columns.find("t");
  const states: ReadonlySet<Channel> = new Set<Channel>(["move_state", "turn_state"]);
  const places = CHANNELS.filter((name) => columns.has(name)).map((name) => [name, columns.find(name), states.has(name)] as const);
  const fault = columns.has("fault") ? columns.find("fault") : undefined;
  return (cells) => {
    to.clear();
    for (const [name, at, isState] of places) {
      if (isState) to.sample[name] = cells[at] === "" ? Number.NaN : columns.word(cells, at, STATES);
      else to.sample[name] = columns.maybe(cells, at);
    }
    to.row();
    const name = fault === undefined ? undefined : cells[fault];
    if (name) to.fault({ t: to.sample.t, fault: name });
  };
}

/** What `hil-sim replay --out` writes. */
function replay(columns: Columns, to: Builder): TakeRow {
  const [t, x, y, theta] = (["t", "x", "y", "theta"] as const).map((name) => columns.find(name));
  const uncertainty = covariance(columns);
  return (cells) => {
    const { sample } = to;
    to.clear();
    sample.t = columns.number(cells, t ?? 0);
    sample.x = columns.number(cells, x ?? 0);
    sample.y = columns.number(cells, y ?? 0);
    sample.theta = wrap(columns.number(cells, theta ?? 0) * DEGREES);
    const told = uncertainty(cells);
    to.row();
    to.estimate({ t: sample.t, x: sample.x, y: sample.y, theta: sample.theta, covariance: told });
  };
}
