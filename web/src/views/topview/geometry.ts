/** The plane and the canvas: metres with y up, pixels with y down; and lengths that look round on a ruler. */

export type Point = readonly [x: number, y: number];

export interface Bounds {
  readonly minX: number;
  readonly minY: number;
  readonly maxX: number;
  readonly maxY: number;
}

/** What part of the plane is seen: the point in the middle of the canvas, and pixels a metre. */
export interface View {
  readonly x: number;
  readonly y: number;
  readonly scale: number;
  readonly width: number;
  readonly height: number;
}

/** A room from 0.1 mm a pixel to 20 km on a tablet. */
export const MIN_SCALE = 0.05;
export const MAX_SCALE = 10_000;

export const DEGREE = Math.PI / 180;

export function toScreen(view: View, x: number, y: number): Point {
  return [view.width / 2 + (x - view.x) * view.scale, view.height / 2 - (y - view.y) * view.scale];
}

export function toWorld(view: View, px: number, py: number): Point {
  return [view.x + (px - view.width / 2) / view.scale, view.y - (py - view.height / 2) / view.scale];
}

export function pan(view: View, dx: number, dy: number): View {
  return { ...view, x: view.x - dx / view.scale, y: view.y + dy / view.scale };
}

/** Zooms so that what is under a pixel stays there. */
export function zoomAbout(view: View, px: number, py: number, factor: number): View {
  const scale = Math.min(MAX_SCALE, Math.max(MIN_SCALE, view.scale * factor));
  const [x, y] = toWorld(view, px, py);
  return { ...view, scale, x: x - (px - view.width / 2) / scale, y: y + (py - view.height / 2) / scale };
}

/** Shows all of the bounds with a margin in pixels, but no closer than `closest` pixels a metre. */
export function fit(view: View, bounds: Bounds, margin: number, closest: number): View {
  const room = (pixels: number) => Math.max(32, pixels - 2 * margin);
  const [width, height] = [bounds.maxX - bounds.minX, bounds.maxY - bounds.minY];
  const scale = Math.min(closest, room(view.width) / width, room(view.height) / height);
  return {
    ...view,
    x: (bounds.minX + bounds.maxX) / 2,
    y: (bounds.minY + bounds.maxY) / 2,
    scale: Math.min(MAX_SCALE, Math.max(MIN_SCALE, scale)),
  };
}

/** Moves the view by as little as it takes to have a point within the middle `share` of it. */
export function follow(view: View, x: number, y: number, share: number): View {
  const [halfWidth, halfHeight] = [(view.width / view.scale / 2) * share, (view.height / view.scale / 2) * share];
  const near = (middle: number, target: number, half: number) => Math.min(target + half, Math.max(target - half, middle));
  return { ...view, x: near(view.x, x, halfWidth), y: near(view.y, y, halfHeight) };
}

export function sees(view: View, bounds: Bounds): boolean {
  const [halfWidth, halfHeight] = [view.width / view.scale / 2, view.height / view.scale / 2];
  return (
    bounds.maxX >= view.x - halfWidth &&
    bounds.minX <= view.x + halfWidth &&
    bounds.maxY >= view.y - halfHeight &&
    bounds.minY <= view.y + halfHeight
  );
}

/** Collects points into bounds; what is not finite is left out. */
export class Extent {
  private minX = Number.POSITIVE_INFINITY;
  private minY = Number.POSITIVE_INFINITY;
  private maxX = Number.NEGATIVE_INFINITY;
  private maxY = Number.NEGATIVE_INFINITY;

  add(x: number, y: number, radius = 0): void {
    if (!Number.isFinite(x) || !Number.isFinite(y) || !Number.isFinite(radius)) return;
    this.minX = Math.min(this.minX, x - radius);
    this.minY = Math.min(this.minY, y - radius);
    this.maxX = Math.max(this.maxX, x + radius);
    this.maxY = Math.max(this.maxY, y + radius);
  }

  get bounds(): Bounds | undefined {
    const { minX, minY, maxX, maxY } = this;
    return minX <= maxX ? { minX, minY, maxX, maxY } : undefined;
  }
}

/** The smallest of 1, 2 or 5 times a power of ten that is not below a length. */
export function roundLength(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  for (const digit of [1, 2, 5]) {
    // Of a length that is itself one of these, the logarithm's rounding must not make the next one.
    if (digit * power >= least * (1 - 1e-9)) return digit * power;
  }
  return 10 * power;
}

/** A length in words: the unit fits its size. */
export function lengthWords(metres: number): string {
  const [value, unit] =
    metres >= 1000 ? [metres / 1000, "km"] : metres >= 1 ? [metres, "m"] : metres >= 0.01 ? [metres * 100, "cm"] : [metres * 1000, "mm"];
  return `${Number(value.toPrecision(3))} ${unit}`;
}

/** An angle in degrees, in (−180, 180]. */
export function wrapDegrees(angle: number): number {
  const turned = angle - 360 * Math.floor(angle / 360);
  return turned > 180 ? turned - 360 : turned;
}
