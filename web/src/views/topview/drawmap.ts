/** The base's map: meadows, the circles in which places certainly lie, arcs, freeways, landmarks. */
import type { MapPlace, MapSketch, Pose } from "../../model/model.ts";
import { label, type Scene } from "./draw.ts";
import { toScreen } from "./geometry.ts";

type Laid = MapPlace & { readonly pose: Pose };

export function drawMap(scene: Scene, map: MapSketch): void {
  const { ctx, view, palette } = scene;
  const laid = map.places.filter((place): place is Laid => place.pose !== undefined);
  const byName = new Map(laid.map((place) => [place.name, place]));

  for (const { from, to, freeway } of map.arcs) {
    const [a, b] = [byName.get(from)?.pose, byName.get(to)?.pose];
    if (a && b) drawArc(scene, a, b, freeway);
  }
  for (const { pose, radius, bound, name } of laid) {
    const [px, py] = toScreen(view, pose.x, pose.y);
    const anchor = name === map.anchor;
    ctx.strokeStyle = palette.muted;
    ctx.fillStyle = palette.goal;
    ctx.beginPath();
    ctx.arc(px, py, radius * view.scale, 0, 2 * Math.PI);
    ctx.globalAlpha = 0.12;
    ctx.fill();
    ctx.globalAlpha = 1;
    ctx.strokeStyle = palette.goal;
    ctx.lineWidth = anchor ? 2.5 : 1.25;
    ctx.stroke();
    if (bound > 0) {
      ctx.lineWidth = 1;
      ctx.setLineDash([8, 4, 2, 4]);
      ctx.strokeStyle = palette.muted;
      ctx.beginPath();
      ctx.arc(px, py, bound * view.scale, 0, 2 * Math.PI);
      ctx.stroke();
      ctx.setLineDash([]);
    }
  }
  for (const { landmarks } of map.places) {
    for (const { name, x, y } of landmarks) {
      if (x === undefined || y === undefined) continue;
      const [px, py] = toScreen(view, x, y);
      ctx.fillStyle = palette.ink;
      ctx.beginPath();
      ctx.moveTo(px, py - 6);
      ctx.lineTo(px + 5, py);
      ctx.lineTo(px, py + 6);
      ctx.lineTo(px - 5, py);
      ctx.closePath();
      ctx.fill();
      label(scene, name, px + 9, py, palette.ink, "left");
    }
  }
  for (const { pose, name, radius, landmarks } of laid) {
    const [px, py] = toScreen(view, pose.x, pose.y);
    const unseen = landmarks.filter(({ x, y }) => x === undefined || y === undefined).map((landmark) => landmark.name);
    const words = [name, name === map.anchor ? "(anchor)" : "", unseen.length > 0 ? `◆ ${unseen.join(", ")}` : ""]
      .filter(Boolean)
      .join(" ");
    label(scene, words, px, py - Math.max(10, Math.min(radius * view.scale, view.height / 4)) - 9, palette.goal);
  }
}

function drawArc({ ctx, view, palette }: Scene, a: Pose, b: Pose, freeway: number | undefined): void {
  const [ax, ay] = toScreen(view, a.x, a.y);
  const [bx, by] = toScreen(view, b.x, b.y);
  const length = Math.hypot(bx - ax, by - ay);
  if (length < 1) return;
  const [ux, uy] = [(bx - ax) / length, (by - ay) / length];
  if (freeway !== undefined) {
    // A corridor without a known width is a line of sight: drawn, but thin.
    const half = Math.max(1.5, (freeway * view.scale) / 2);
    ctx.fillStyle = palette.muted;
    ctx.globalAlpha = 0.16;
    ctx.beginPath();
    ctx.moveTo(ax - uy * half, ay + ux * half);
    ctx.lineTo(bx - uy * half, by + ux * half);
    ctx.lineTo(bx + uy * half, by - ux * half);
    ctx.lineTo(ax + uy * half, ay - ux * half);
    ctx.fill();
    ctx.globalAlpha = 1;
  }
  ctx.strokeStyle = palette.muted;
  ctx.lineWidth = 1;
  ctx.beginPath();
  ctx.moveTo(ax, ay);
  ctx.lineTo(bx, by);
  const [mx, my] = [ax + ux * length * 0.55, ay + uy * length * 0.55];
  ctx.moveTo(mx - 7 * ux - 4 * uy, my - 7 * uy + 4 * ux);
  ctx.lineTo(mx, my);
  ctx.lineTo(mx - 7 * ux + 4 * uy, my - 7 * uy - 4 * ux);
  ctx.stroke();
}
