/** What is drawn to scale, from the parameters of the base. */
import type { Geometry, Parameter } from "./model.ts";

type Vehicle = Geometry["vehicle"];

/** Drawn until the base has said what it is: a differential drive with a new base's parameters. */
const UNKNOWN: Geometry = { vehicle: "differential", wheelBase: 0.2, track: 0.2, wheelDiameter: 0.084 };
/** The body of a synchro drive is not in its parameters. */
const SYNCHRO_TRACK = 0.3;

/** The vehicle that a name stands for. */
export function vehicleOf(name: string | undefined): Vehicle | undefined {
  const only = name?.toLowerCase().replaceAll(/[^a-z]/g, "");
  if (only === "car") return "bisteerable";
  const known: readonly Vehicle[] = ["differential", "synchro", "tricycle", "bisteerable"];
  return known.find((vehicle) => only?.startsWith(vehicle));
}

/** Which vehicle has these parameters: each has some of its own. */
function vehicleBy(parameters: ReadonlyMap<string, Parameter>): Vehicle {
  if (parameters.has("rear_steered")) return "bisteerable";
  if (parameters.has("steer_max")) return "tricycle";
  return parameters.has("turn_lever") ? "synchro" : "differential";
}

export function geometryOf(parameters: ReadonlyMap<string, Parameter>, told?: string): Geometry {
  const vehicle = vehicleOf(told) ?? vehicleBy(parameters);
  if (parameters.size === 0) return { ...UNKNOWN, vehicle };
  const value = (name: string) => parameters.get(name)?.value;
  const left = value("left_diameter");
  const right = value("right_diameter");
  const wheelDiameter = value("wheel_diameter") ?? (left !== undefined && right !== undefined ? (left + right) / 2 : UNKNOWN.wheelDiameter);
  const wheelBase = value("wheel_base") ?? (vehicle === "synchro" ? SYNCHRO_TRACK : UNKNOWN.wheelBase);
  return { vehicle, wheelBase, track: value("track") ?? wheelBase, wheelDiameter };
}
