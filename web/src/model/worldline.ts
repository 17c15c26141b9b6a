/** What the server says of the simulated world, read; see docs/page.md. */
import type { World } from "./model.ts";

export interface Hello {
  readonly robot: string;
  readonly vehicle: string;
  /** Undefined: as fast as it goes. */
  readonly speed: number | undefined;
  readonly seatFree: boolean;
  readonly faults: readonly string[];
  readonly truth: World["truth"];
}

export interface Moment {
  readonly t: number;
  readonly x: number;
  readonly y: number;
  readonly theta: number;
  readonly pace: number;
  readonly broken: readonly string[];
  readonly estop: boolean;
  readonly pushed: boolean;
}

export type Told =
  | { readonly kind: "hello"; readonly hello: Hello }
  | { readonly kind: "world"; readonly world: Moment }
  | { readonly kind: "seat"; readonly free: boolean }
  | { readonly kind: "done"; readonly id: number }
  | { readonly kind: "refused"; readonly id: number; readonly why: string }
  | { readonly kind: "sent"; readonly line: string };

type Fields = Readonly<Record<string, unknown>>;

/** Undefined for what is none of these. */
export function read(message: string): Told | undefined {
  let parsed: unknown;
  try {
    parsed = JSON.parse(message);
  } catch {
    return undefined;
  }
  if (!isObject(parsed)) return undefined;
  const { hello, world, seat, done, refused, sent, why } = parsed;
  if (isObject(world)) {
    const moment = momentOf(world);
    return moment && { kind: "world", world: moment };
  }
  if (isObject(hello)) return { kind: "hello", hello: helloOf(hello) };
  if (seat === "free" || seat === "taken") return { kind: "seat", free: seat === "free" };
  if (typeof done === "number") return { kind: "done", id: done };
  if (typeof refused === "number") return { kind: "refused", id: refused, why: typeof why === "string" ? why : "refused" };
  return typeof sent === "string" ? { kind: "sent", line: sent } : undefined;
}

function isObject(value: unknown): value is Fields {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function words(value: unknown): string[] {
  return Array.isArray(value) ? value.filter((word) => typeof word === "string") : [];
}

function finite(value: unknown): number | undefined {
  return typeof value === "number" && Number.isFinite(value) ? value : undefined;
}

function helloOf(hello: Fields): Hello {
  const { robot, vehicle, speed, seat, faults, truth } = hello;
  return {
    robot: typeof robot === "string" ? robot : "",
    vehicle: typeof vehicle === "string" ? vehicle : "",
    speed: finite(speed),
    seatFree: seat === "free",
    faults: words(faults),
    truth: isObject(truth) ? truthOf(truth) : undefined,
  };
}

function truthOf(truth: Fields): World["truth"] {
  const wheelBase = finite(truth.wheel_base);
  const leftDiameter = finite(truth.left_diameter);
  const rightDiameter = finite(truth.right_diameter);
  if (wheelBase === undefined || leftDiameter === undefined || rightDiameter === undefined) return undefined;
  return { wheelBase, leftDiameter, rightDiameter };
}

function momentOf(world: Fields): Moment | undefined {
  const [t, x, y, theta] = [world.t, world.x, world.y, world.theta].map(finite);
  if (t === undefined || x === undefined || y === undefined || theta === undefined) return undefined;
  const { broken, estop, pushed } = world;
  return { t, x, y, theta, pace: finite(world.pace) ?? Number.NaN, broken: words(broken), estop: estop === true, pushed: pushed === true };
}
