/** Strokes trails: dashes go on over pieces, and what is not seen is not stroked. */
import type { Scene } from "./draw.ts";
import { type Point, sees, toScreen } from "./geometry.ts";
import type { Piece, Trail } from "./trail.ts";

export const SOLID: readonly number[] = [];
export const TRUE_DASH: readonly number[] = [7, 5];

/** Paths of whole pieces, kept as long as the trail's line is the same. */
interface Kept {
  generation: number;
  readonly paths: Path2D[];
}
const kept = new WeakMap<Trail, Kept>();

function pathOf({ line }: Trail, { first, last, bounds }: Piece, until: number): Path2D {
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
  return path;
}

/**
 * A trail up to a sample, and from there to where the base was then. The paths are in metres from a corner of their piece (a path's numbers are
 * single, and a base may be far from its origin), so that panning needs no new ones.
 */
export function drawTrail(
  scene: Scene,
  trail: Trail,
  until: number,
  end: Point | undefined,
  style: { colour: string; width: number; dash: readonly number[] },
): void {
  const { ctx, view, ratio } = scene;
  let cache = kept.get(trail);
  if (cache?.generation !== trail.generation) {
    cache = { generation: trail.generation, paths: [] };
    kept.set(trail, cache);
  }
  ctx.strokeStyle = style.colour;
  ctx.lineCap = style.dash.length > 0 ? "butt" : "round";
  ctx.lineJoin = "round";
  const { line } = trail;
  const stroke = (piece: Piece, path: Path2D) => {
    const [px, py] = toScreen(view, piece.bounds.minX, piece.bounds.minY);
    ctx.setTransform(ratio * view.scale, 0, 0, -ratio * view.scale, ratio * px, ratio * py);
    ctx.lineWidth = style.width / view.scale;
    ctx.setLineDash(style.dash.map((length) => length / view.scale));
    ctx.lineDashOffset = piece.before;
    ctx.stroke(path);
  };
  ctx.save();
  const { pieces } = trail;
  let last = -1;
  for (const [index, piece] of pieces.entries()) {
    if ((line.sample[piece.first] as number) > until) break;
    const whole = (line.sample[piece.last] as number) <= until;
    last = whole ? piece.last : lastBefore(line.sample, until);
    if (!sees(view, piece.bounds)) continue;
    if (whole) cache.paths[index] ??= pathOf(trail, piece, until);
    stroke(piece, whole ? (cache.paths[index] as Path2D) : pathOf(trail, piece, until));
  }
  const rest = trail.rest();
  if (rest.last >= rest.first && (line.sample[rest.first] as number) <= until) {
    last = lastBefore(line.sample, until);
    if (sees(view, rest.bounds)) stroke(rest, pathOf(trail, rest, until));
  }
  ctx.restore();
  const [x, y] = [line.x[last], line.y[last]];
  if (!end || x === undefined || y === undefined || Number.isNaN(x)) return;
  // What has not become a point of the line yet.
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

function lastBefore(samples: readonly number[], until: number): number {
  let [low, high] = [0, samples.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((samples[middle] as number) <= until) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
