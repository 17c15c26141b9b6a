/** What the top view draws: the ground, the ways, the base. Each function leaves the context as it found it, but for styles. */
import type { PlannedPath, Pose } from "../../model/model.ts";
import type { Palette } from "../theme.ts";
import { DEGREE, lengthWords, type Point, roundLength, toScreen, toWorld, type View } from "./geometry.ts";
import type { Dragged } from "./goal.ts";
import type { Silhouette } from "./silhouette.ts";
import type { Snapshot } from "./snapshot.ts";
import { banana, ellipse, NORMAL_95 } from "./uncertainty.ts";

export interface Scene {
  readonly ctx: CanvasRenderingContext2D;
  readonly view: View;
  readonly palette: Palette;
  /** Pixels of the canvas for one of the page. */
  readonly ratio: number;
}

const FONT = "12px system-ui, 'DejaVu Sans', sans-serif";
const SMALL = "11px system-ui, 'DejaVu Sans', sans-serif";

/** Text with a rim of the paper's colour, so that it is read on anything. */
export function label(
  { ctx, palette }: Scene,
  text: string,
  px: number,
  py: number,
  colour: string,
  align: CanvasTextAlign = "center",
): void {
  ctx.font = FONT;
  ctx.textAlign = align;
  ctx.textBaseline = "middle";
  ctx.lineJoin = "round";
  ctx.lineWidth = 3;
  ctx.strokeStyle = palette.paper;
  ctx.strokeText(text, px, py);
  ctx.fillStyle = colour;
  ctx.fillText(text, px, py);
}

/** Lines at round distances. */
export function drawGrid({ ctx, view, palette }: Scene): void {
  const { step, xs, ys } = gridLines(view);
  const lines = (zero: boolean) => {
    ctx.beginPath();
    for (const x of xs) {
      if (Math.abs(x) < step / 2 !== zero) continue;
      const px = Math.round(toScreen(view, x, 0)[0]) + 0.5;
      ctx.moveTo(px, 0);
      ctx.lineTo(px, view.height);
    }
    for (const y of ys) {
      if (Math.abs(y) < step / 2 !== zero) continue;
      const py = Math.round(toScreen(view, 0, y)[1]) + 0.5;
      ctx.moveTo(0, py);
      ctx.lineTo(view.width, py);
    }
    ctx.stroke();
  };
  ctx.lineWidth = 1;
  ctx.strokeStyle = palette.grid;
  lines(false);
  ctx.strokeStyle = palette.muted;
  ctx.globalAlpha = 0.45;
  lines(true);
  ctx.globalAlpha = 1;
}

function gridLines(view: View): { step: number; xs: number[]; ys: number[] } {
  const step = roundLength(64 / view.scale);
  const [left, bottom] = toWorld(view, 0, view.height);
  const [right, top] = toWorld(view, view.width, 0);
  const between = (from: number, to: number) => {
    const first = Math.ceil(from / step);
    return Array.from({ length: Math.max(0, Math.floor(to / step) - first + 1) }, (_, index) => (first + index) * step);
  };
  return { step, xs: between(left, right), ys: between(bottom, top) };
}

/** What the grid's lines are, at the edges. */
export function drawRulers({ ctx, view, palette }: Scene): void {
  const { step, xs, ys } = gridLines(view);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const words = (at: number) => (Math.abs(at) < step / 2 ? "0" : at.toFixed(decimals).replace("-", "−"));
  ctx.font = SMALL;
  ctx.fillStyle = palette.muted;
  ctx.textAlign = "center";
  ctx.textBaseline = "bottom";
  for (const x of xs) {
    const [px] = toScreen(view, x, 0);
    if (px > 40 && px < view.width - 150) ctx.fillText(words(x), px, view.height - 3);
  }
  ctx.textAlign = "left";
  ctx.textBaseline = "middle";
  for (const y of ys) {
    const [, py] = toScreen(view, 0, y);
    if (py > 48 && py < view.height - 22) ctx.fillText(words(y), 4, py);
  }
}

/** A bar for the scale. */
export function drawScaleBar(scene: Scene): void {
  const { ctx, view, palette } = scene;
  const length = roundLength(50 / view.scale);
  const pixels = length * view.scale;
  const [right, y] = [view.width - 14, view.height - 12];
  ctx.strokeStyle = palette.ink;
  ctx.lineWidth = 2;
  ctx.beginPath();
  ctx.moveTo(right - pixels, y - 5);
  ctx.lineTo(right - pixels, y);
  ctx.lineTo(right, y);
  ctx.lineTo(right, y - 5);
  ctx.stroke();
  label(scene, lengthWords(length), right - pixels / 2, y - 10, palette.ink);
}

/** The ellipse, the banana, and the fan of the headings. */
export function drawDoubt(scene: Scene, { pose, covariance }: NonNullable<Snapshot["doubt"]>, colour: string, reach: number): void {
  const { ctx, view } = scene;
  const [px, py] = toScreen(view, pose.x, pose.y);
  const { a, b, angle } = ellipse(covariance);
  const outline = banana(pose, covariance);
  ctx.strokeStyle = colour;
  ctx.fillStyle = colour;
  if (outline) {
    ctx.beginPath();
    for (const [x, y] of outline) ctx.lineTo(...toScreen(view, x, y));
    ctx.closePath();
    ctx.globalAlpha = 0.16;
    ctx.fill();
    ctx.globalAlpha = 1;
    ctx.lineWidth = 1.75;
    ctx.stroke();
  }
  if (Number.isFinite(a)) {
    ctx.lineWidth = 1.25;
    ctx.setLineDash([3, 3]);
    ctx.beginPath();
    ctx.ellipse(px, py, a * view.scale, b * view.scale, -angle, 0, 2 * Math.PI);
    ctx.stroke();
    ctx.setLineDash([]);
  }
  const half = Math.min(180, NORMAL_95 * Math.sqrt(Math.max(0, covariance[5])));
  if (!Number.isFinite(half)) return;
  const [from, to] = [-(pose.theta + half) * DEGREE, -(pose.theta - half) * DEGREE];
  ctx.beginPath();
  if (half < 180) ctx.moveTo(px, py);
  ctx.arc(px, py, reach, from, to);
  ctx.closePath();
  ctx.globalAlpha = 0.13;
  ctx.fill();
  ctx.globalAlpha = 0.7;
  ctx.lineWidth = 1;
  ctx.stroke();
  ctx.globalAlpha = 1;
}

export interface BaseStyle {
  readonly colour: string;
  readonly fill: string;
  readonly wheels: string;
  readonly ghost: boolean;
}

/** The base to scale; where that is too small to see, an arrow of its own size besides. */
export function drawBase({ ctx, view, palette }: Scene, pose: Pose, shape: Silhouette, { colour, fill, wheels, ghost }: BaseStyle): void {
  const [px, py] = toScreen(view, pose.x, pose.y);
  const { body } = shape;
  const pixels = (metres: number) => metres * view.scale;
  ctx.save();
  ctx.translate(px, py);
  ctx.rotate(-pose.theta * DEGREE);
  ctx.lineWidth = ghost ? 1.5 : 2;
  ctx.setLineDash(ghost ? [4, 3] : []);
  ctx.strokeStyle = colour;
  if (shape.radius * view.scale >= 5) {
    ctx.beginPath();
    if (body.round) ctx.arc(0, 0, pixels(body.front), 0, 2 * Math.PI);
    else {
      const corner = pixels(Math.min(body.halfWidth, (body.front - body.rear) / 2));
      ctx.roundRect(pixels(body.rear), -pixels(body.halfWidth), pixels(body.front - body.rear), 2 * pixels(body.halfWidth), [
        corner * 0.25,
        corner * 0.7,
        corner * 0.7,
        corner * 0.25,
      ]);
    }
    ctx.globalAlpha = ghost ? 0.14 : 0.88;
    ctx.fillStyle = fill;
    ctx.fill();
    ctx.globalAlpha = 1;
    ctx.stroke();
    // The canvas's y points down: a wheel on the left is above.
    for (const wheel of shape.wheels) {
      ctx.save();
      ctx.translate(pixels(wheel.x), -pixels(wheel.y));
      ctx.rotate(-wheel.angle);
      const [length, width] = [pixels(shape.wheelDiameter), Math.max(1.5, pixels(shape.wheelWidth))];
      ctx.beginPath();
      ctx.roundRect(-length / 2, -width / 2, length, width, Math.min(3, width / 3));
      ctx.fillStyle = wheels;
      if (ghost) ctx.stroke();
      else ctx.fill();
      ctx.restore();
    }
  }
  ctx.setLineDash([]);
  const middle = (body.front + body.rear) / 2;
  const length = Math.min(36, Math.max(9, pixels(Math.min(body.front - body.rear, 3 * body.halfWidth)) * 0.42));
  const from = shape.radius * view.scale >= 9 ? pixels(middle) - length * 0.35 : -length * 0.5;
  ctx.beginPath();
  ctx.moveTo(from + length, 0);
  ctx.lineTo(from, -length * 0.52);
  ctx.lineTo(from + length * 0.28, 0);
  ctx.lineTo(from, length * 0.52);
  ctx.closePath();
  ctx.lineWidth = 1.5;
  if (ghost) ctx.stroke();
  else {
    ctx.fillStyle = colour;
    ctx.strokeStyle = palette.paper;
    ctx.stroke();
    ctx.fill();
  }
  ctx.restore();
}

/** The postures that are left to drive, with their legs from where the base is. */
export function drawPlan(scene: Scene, plan: PlannedPath, pose: Pose | undefined): void {
  const { ctx, view, palette } = scene;
  if (plan.postures.length === 0) return;
  const driven = plan.mode !== "idle";
  ctx.strokeStyle = palette.plan;
  ctx.lineWidth = 2;
  ctx.globalAlpha = driven ? 1 : 0.55;
  ctx.setLineDash([2, 4]);
  ctx.lineCap = "round";
  ctx.beginPath();
  if (pose && driven) ctx.moveTo(...toScreen(view, pose.x, pose.y));
  for (const posture of plan.postures) ctx.lineTo(...toScreen(view, posture.x, posture.y));
  ctx.stroke();
  ctx.setLineDash([]);
  for (const { number, x, y, theta } of plan.postures) {
    const [px, py] = toScreen(view, x, y);
    if (theta !== undefined) drawHeading(ctx, px, py, theta, 26);
    ctx.beginPath();
    ctx.arc(px, py, 9, 0, 2 * Math.PI);
    ctx.fillStyle = palette.paper;
    ctx.fill();
    ctx.stroke();
    ctx.font = `bold ${SMALL}`;
    ctx.textAlign = "center";
    ctx.textBaseline = "middle";
    ctx.fillStyle = palette.plan;
    ctx.fillText(String(number), px, py + 0.5);
  }
  ctx.globalAlpha = 1;
  if (!driven) {
    const last = plan.postures.at(-1);
    if (last) label(scene, "queued, not driven", ...below(toScreen(view, last.x, last.y), 20), palette.plan);
  }
}

/** A goal that is being given, and what it will be. */
export function drawGoal(scene: Scene, { goal, append }: Dragged, words: string): void {
  const { ctx, view, palette } = scene;
  const [px, py] = toScreen(view, goal.x, goal.y);
  ctx.strokeStyle = palette.goal;
  ctx.lineWidth = 2;
  if (goal.theta !== undefined) drawHeading(ctx, px, py, goal.theta, 46);
  ctx.beginPath();
  ctx.arc(px, py, 8, 0, 2 * Math.PI);
  for (const [dx, dy] of [
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
  ] as const) {
    ctx.moveTo(px + 4 * dx, py + 4 * dy);
    ctx.lineTo(px + 14 * dx, py + 14 * dy);
  }
  ctx.stroke();
  const heading = goal.theta === undefined ? "" : ` ${goal.theta}°`;
  label(scene, `${append ? "add " : "go to "}${goal.x.toFixed(2)} ${goal.y.toFixed(2)}${heading}`, ...below([px, py], 26), palette.goal);
  if (words) label(scene, words, ...below([px, py], 42), palette.goal);
}

function below([px, py]: Point, by: number): [number, number] {
  return [px, py + by];
}

function drawHeading(ctx: CanvasRenderingContext2D, px: number, py: number, theta: number, length: number): void {
  const [cos, sin] = [Math.cos(theta * DEGREE), -Math.sin(theta * DEGREE)];
  const [tipX, tipY] = [px + length * cos, py + length * sin];
  ctx.beginPath();
  ctx.moveTo(px, py);
  ctx.lineTo(tipX, tipY);
  ctx.lineTo(tipX - 8 * cos - 5 * sin, tipY - 8 * sin + 5 * cos);
  ctx.moveTo(tipX, tipY);
  ctx.lineTo(tipX - 8 * cos + 5 * sin, tipY - 8 * sin - 5 * cos);
  ctx.stroke();
}

/** A sign below the buttons, for what must not be overlooked. */
export function drawSign({ ctx, view }: Scene, text: string, back: string, ink: string, line: number): void {
  ctx.font = `bold ${FONT}`;
  const width = ctx.measureText(text).width + 20;
  const y = 46 + 28 * line;
  ctx.fillStyle = back;
  ctx.beginPath();
  ctx.roundRect((view.width - width) / 2, y, width, 24, 6);
  ctx.fill();
  ctx.fillStyle = ink;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.fillText(text, view.width / 2, y + 12);
}
