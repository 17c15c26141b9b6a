/** Strokes trails: dashes go on over pieces, and what is not seen is not stroked. */
import type { Scene } from "./draw.ts";
import { type Point, sees, toScreen } from "./geometry.ts";
import type { Piece, Trail } from "./trail.ts";

export interface TrailStyle {
  readonly colour: string;
  readonly width: number;
  readonly dash: readonly number[];
}

export const SOLID: readonly number[] = [];
export const TRUE_DASH: readonly number[] = [7, 5];

/** How many pieces of a trail lie wholly before a sample. */
export function wholePieces({ line, pieces }: Trail, until: number): number {
  let [low, high] = [0, pieces.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((line.sample[(pieces[middle] as Piece).last] as number) <= until) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Strokes whole pieces, from one to before another. */
export function drawPieces(scene: Scene, trail: Trail, from: number, to: number, style: TrailStyle): void {
  scene.ctx.save();
  for (const piece of trail.pieces.slice(from, to))
    if (sees(scene.view, piece.bounds)) stroke(scene, trail, piece, Number.POSITIVE_INFINITY, style);
  scene.ctx.restore();
}

/** What follows the whole pieces: up to a sample, and from there to where the base was then. */
export function drawTail(scene: Scene, trail: Trail, until: number, end: Point | undefined, style: TrailStyle): void {
  const { ctx, view } = scene;
  const { line } = trail;
  const piece = trail.pieces[wholePieces(trail, until)] ?? trail.rest();
  ctx.save();
  if (sees(view, piece.bounds)) stroke(scene, trail, piece, until, style);
  ctx.restore();
  const last = lastBefore(line.sample, until);
  const [x, y] = [line.x[last], line.y[last]];
  if (!end || x === undefined || y === undefined || Number.isNaN(x)) return;
  // What has not become a point of the line yet.
  ctx.strokeStyle = style.colour;
  ctx.lineWidth = style.width;
  ctx.setLineDash([...style.dash]);
  ctx.beginPath();
  ctx.moveTo(...toScreen(view, x, y));
  const newest = trail.pending;
  if (newest && last === line.x.length - 1) ctx.lineTo(...toScreen(view, ...newest));
  ctx.lineTo(...toScreen(view, ...end));
  ctx.stroke();
  ctx.setLineDash([]);
}

/** In metres from a corner of the piece: a path's numbers are single, and a base may be far from its origin. */
function stroke(
  { ctx, view, ratio }: Scene,
  { line }: Trail,
  { first, last, bounds, before }: Piece,
  until: number,
  style: TrailStyle,
): void {
  const path = new Path2D();
  let broken = true;
  for (let index = first; index <= last && (line.sample[index] as number) <= until; index += 1) {
    const [x, y] = [line.x[index] as number, line.y[index] as number];
    if (Number.isNaN(x)) broken = true;
    else if (broken) {
      path.moveTo(x - bounds.minX, y - bounds.minY);
      broken = false;
    } else path.lineTo(x - bounds.minX, y - bounds.minY);
  }
  const [px, py] = toScreen(view, bounds.minX, bounds.minY);
  ctx.setTransform(ratio * view.scale, 0, 0, -ratio * view.scale, ratio * px, ratio * py);
  ctx.strokeStyle = style.colour;
  ctx.lineJoin = "round";
  ctx.lineWidth = style.width / view.scale;
  ctx.setLineDash(style.dash.map((length) => length / view.scale));
  ctx.lineDashOffset = before;
  ctx.stroke(path);
}

function lastBefore(samples: readonly number[], until: number): number {
  let [low, high] = [0, samples.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((samples[middle] as number) <= until) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
