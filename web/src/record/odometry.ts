/**
 * A robot's log: counts of its encoders since the row before, and where it truly was, if that is known. The page integrates the odometry of a differential drive
 * along circular arcs, without a covariance: `hil-sim replay` does it as the base would.
 */
import { wrap } from "../model/layout.ts";
import type { Parameter } from "../model/model.ts";
import type { Builder } from "./builder.ts";
import type { Columns, TakeRow } from "./header.ts";
import type { Wheels } from "./wheels.ts";

/** A new base's: what the firmware has before anybody sets its parameters. */
const DEFAULTS: Wheels = {
  wheelBase: 0.2,
  leftDiameter: 0.084,
  rightDiameter: 0.084,
  countsPerTurn: 2796.8,
  origin: "those of a new base, since no base has told its own",
};

/** The wheels of the base that is connected, with the gains that it has learned; a new base's, if there is none. */
export function wheelsOf(parameters: ReadonlyMap<string, Parameter>): Wheels {
  const value = (name: string) => parameters.get(name)?.value;
  const [wheelBase, leftDiameter, rightDiameter, countsPerTurn] = ["wheel_base", "left_diameter", "right_diameter", "counts_per_turn"].map(
    value,
  );
  if (wheelBase === undefined || leftDiameter === undefined || rightDiameter === undefined || countsPerTurn === undefined) return DEFAULTS;
  return {
    wheelBase: wheelBase * (value("gain_base") ?? 1),
    leftDiameter: leftDiameter * (value("gain_left") ?? 1),
    rightDiameter: rightDiameter * (value("gain_right") ?? 1),
    countsPerTurn,
    origin: "those that the connected base has told",
  };
}

const DEGREES = 180 / Math.PI;

/** A pose in radians, moved on by what the wheels have rolled (m). */
export function step(pose: readonly [number, number, number], left: number, right: number, wheelBase: number): [number, number, number] {
  const [x, y, theta] = pose;
  const way = (left + right) / 2;
  const turned = (right - left) / wheelBase;
  const half = turned / 2;
  // The chord of the arc.
  const chord = Math.abs(half) < 1e-8 ? way : (way * Math.sin(half)) / half;
  return [x + chord * Math.cos(theta + half), y + chord * Math.sin(theta + half), theta + turned];
}

export function odometry(columns: Columns, to: Builder): TakeRow {
  // A car's counts are named as a differential drive's; what tells them apart is the steering.
  if (["drive", "steer", "turn"].some((name) => columns.has(name)))
    throw new Error("the counts are of a vehicle that steers: let `hil-sim replay --out` make a track of them, and load that");
  const { wheels } = to;
  to.geometry = {
    vehicle: "differential",
    wheelBase: wheels.wheelBase,
    track: wheels.wheelBase,
    wheelDiameter: (wheels.leftDiameter + wheels.rightDiameter) / 2,
  };
  to.note(
    `the track is the odometry of wheels of ${wheels.leftDiameter} m (left) and ${wheels.rightDiameter} m, ${wheels.wheelBase} m apart, with ${wheels.countsPerTurn} counts to a turn: ${wheels.origin}`,
  );
  const [t, left, right] = ["t", "left", "right"].map((name) => columns.find(name));
  const truth = ["x", "y", "theta"].filter((name) => columns.has(name)).map((name) => columns.find(name));
  if (truth.length % 3 !== 0) throw new Error("of the columns x, y and theta there must be all or none");
  let pose: [number, number, number] | undefined;
  let before: number | undefined;
  return (cells) => {
    const { sample } = to;
    to.clear();
    sample.t = columns.number(cells, t ?? 0);
    const counts = [columns.count(cells, left ?? 0), columns.count(cells, right ?? 0)] as const;
    const known = truth.map((at) => columns.number(cells, at));
    const [x, y, theta] = known;
    if (x !== undefined && y !== undefined && theta !== undefined) {
      [sample.true_x, sample.true_y, sample.true_theta] = [x, y, wrap(theta * DEGREES)];
    }
    if (pose) {
      const rolled = [
        (counts[0] * Math.PI * wheels.leftDiameter) / wheels.countsPerTurn,
        (counts[1] * Math.PI * wheels.rightDiameter) / wheels.countsPerTurn,
      ] as const;
      pose = step(pose, rolled[0], rolled[1], wheels.wheelBase);
      const passed = sample.t - (before ?? sample.t);
      if (passed > 0) {
        sample.v_s = (rolled[0] + rolled[1]) / 2 / passed;
        sample.v_alpha = (((rolled[1] - rolled[0]) / wheels.wheelBase) * DEGREES) / passed;
      }
    } else {
      // What was counted up to the first row was counted on the way there.
      pose = [x ?? 0, y ?? 0, theta ?? 0];
    }
    before = sample.t;
    [sample.x, sample.y, sample.theta] = [pose[0], pose[1], wrap(pose[2] * DEGREES)];
    to.row();
  };
}
