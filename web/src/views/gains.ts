/** The gains of each vehicle, and what they truly are where that is known. */
import type { Geometry, Model } from "../model/model.ts";

export interface GainName {
  readonly name: string;
  readonly unit: string;
}

const plain = (name: string): GainName => ({ name, unit: "" });
const STEER: GainName = { name: "steer_offset", unit: "°" };

/** In the order of `GetGains`; see docs/protocol.md, other vehicles. */
export const GAIN_NAMES: Readonly<Record<Geometry["vehicle"], readonly GainName[]>> = {
  differential: [plain("k_r"), plain("k_l"), plain("k_b")],
  synchro: [plain("gain_drive"), plain("gain_turn"), { name: "turn_drift", unit: "°/m" }],
  tricycle: [plain("gain_drive"), plain("gain_base"), STEER],
  bisteerable: [plain("gain_right"), plain("gain_left"), plain("gain_base"), STEER],
};

/**
 * The true gains of a simulated differential drive: true over nominal diameters and wheel base, as the odometry's equations take them. The nominal ones are
 * parameters, so these move when somebody sets another diameter. Undefined where the truth, or the nominal geometry, is not known.
 */
export function trueGains(model: Pick<Model, "world" | "parameters" | "geometry">): readonly number[] | undefined {
  const truth = model.world?.truth;
  const nominal = (name: string) => model.parameters.get(name)?.value;
  const [right, left, base] = [nominal("right_diameter"), nominal("left_diameter"), nominal("wheel_base")];
  if (model.geometry.vehicle !== "differential" || !truth || !right || !left || !base) return undefined;
  return [truth.rightDiameter / right, truth.leftDiameter / left, truth.wheelBase / base];
}

/** The gain in words, for the caption of its chart. */
export function gainWords(value: number | undefined, deviation: number | undefined, unit: string, truth: number | undefined): string {
  if (value === undefined || deviation === undefined) return "not asked yet";
  const known = truth === undefined ? "" : `, truly ${truth.toFixed(5)}`;
  return `${value.toFixed(5)} ± ${deviation.toFixed(5)}${unit && ` ${unit}`}${known}`;
}
