/** What the base looks like from above: its wheels to scale, where they stand and where they point. */
import type { Geometry } from "../../model/model.ts";
import { DEGREE } from "./geometry.ts";

/** A wheel: its middle from the reference point, m, and its direction from the heading, rad. */
export interface Wheel {
  readonly x: number;
  readonly y: number;
  readonly angle: number;
  /** It points where the base is told to go. */
  readonly steered: boolean;
}

export interface Silhouette {
  readonly body: { readonly rear: number; readonly front: number; readonly halfWidth: number; readonly round: boolean };
  readonly wheels: readonly Wheel[];
  readonly wheelDiameter: number;
  readonly wheelWidth: number;
  /** From the reference point to the farthest point of the body. */
  readonly radius: number;
}

/** How the base moves: telemetry has no steering angle, but a wheel that rolls points along its own motion. */
export interface Motion {
  /** m/s. */
  readonly speed: number;
  /** °/s. */
  readonly turning: number;
}

/** Below, a base stands: its wheels' direction is not to be told from its motion. */
const STANDING = 2e-3;
/** A wheel's width in its diameters; how broad it truly is, the base does not know. */
const WIDTH = 0.28;

const positive = (value: number, otherwise: number) => (Number.isFinite(value) && value > 0 ? value : otherwise);

export function silhouette(geometry: Geometry, motion: Motion, rearSteered: boolean): Silhouette {
  const diameter = positive(geometry.wheelDiameter, positive(geometry.wheelBase, 0.2) * 0.4);
  const base = positive(geometry.wheelBase, diameter * 2.5);
  const track = positive(geometry.track, base * 0.9);
  const wheelWidth = diameter * WIDTH;
  const made = (wheels: Wheel[], body: Silhouette["body"]): Silhouette => {
    const corner = body.round ? body.front : Math.hypot(Math.max(-body.rear, body.front), body.halfWidth);
    return { body, wheels, wheelDiameter: diameter, wheelWidth, radius: corner };
  };
  const wheel = (x: number, y: number, angle = 0, steered = false): Wheel => ({ x, y, angle, steered });

  switch (geometry.vehicle) {
    case "differential": {
      const half = base / 2;
      const reach = Math.max(diameter / 2, half) * 1.12;
      return made([wheel(0, half), wheel(0, -half)], { rear: -reach, front: reach, halfWidth: half - wheelWidth * 0.75, round: false });
    }
    case "synchro": {
      // All wheels point along θ; the body does not turn with them, so it is drawn as what looks the same from all sides.
      const radius = positive(geometry.track, positive(geometry.wheelBase, diameter * 3)) / Math.sqrt(3);
      const reach = radius + diameter * 0.75;
      const wheels = [0, 120, 240].map((at) => wheel(radius * Math.cos(at * DEGREE), radius * Math.sin(at * DEGREE), 0, true));
      return made(wheels, { rear: -reach, front: reach, halfWidth: reach, round: true });
    }
    case "tricycle": {
      const half = track / 2;
      const front = wheel(base, 0, pointed(motion, base, Math.PI / 2), true);
      return made([wheel(0, half), wheel(0, -half), front], {
        rear: -diameter * 0.6,
        front: base + diameter * 0.6,
        halfWidth: Math.max(wheelWidth, half - wheelWidth * 0.75),
        round: false,
      });
    }
    case "bisteerable": {
      // The reference point is the middle of the rear axle, or of the car if that axle is steered against the front one.
      const [front, rear] = rearSteered ? [base / 2, -base / 2] : [base, 0];
      const half = track / 2;
      const at = (x: number, y: number) => {
        const steered = x === front || rearSteered;
        // Each wheel stands at right angles to the line to the common centre of the curve.
        return wheel(x, y, steered ? pointedAt(motion, x, y) : 0, steered);
      };
      return made([at(rear, half), at(rear, -half), at(front, half), at(front, -half)], {
        rear: rear - diameter * 0.8,
        front: front + diameter * 0.8,
        halfWidth: half - wheelWidth * 0.75,
        round: false,
      });
    }
  }
}

/** Direction of a wheel at a distance ahead: along its own velocity, to (−90°, 90°]; straight while the base stands. */
function pointed(motion: Motion, ahead: number, most: number): number {
  return Math.max(-most, Math.min(most, pointedAt(motion, ahead, 0)));
}

function pointedAt({ speed, turning }: Motion, x: number, y: number): number {
  const omega = turning * DEGREE;
  const [vx, vy] = [speed - omega * y, omega * x];
  if (!(Math.hypot(vx, vy) > STANDING)) return 0;
  return vx === 0 ? (Math.sign(vy) * Math.PI) / 2 : Math.atan(vy / vx);
}
