/**
 * What lies under the base and changes seldom (grid, map, the ways already driven), on a canvas of its own that is somewhat larger than what is seen. A
 * frame copies a part of it; it is drawn anew when the view has moved beyond its margin, or is zoomed. Ways that grow are added to it.
 */
import type { MapSketch } from "../../model/model.ts";
import { drawGrid, type Scene } from "./draw.ts";
import { drawMap } from "./drawmap.ts";
import { drawPieces, type TrailStyle, wholePieces } from "./drawtrail.ts";
import type { View } from "./geometry.ts";
import type { Trail } from "./trail.ts";

/** A way with its look, and up to which sample it is drawn. */
export interface Way {
  readonly trail: Trail;
  readonly style: TrailStyle;
}

/** Margin on each side, as a share of what is seen. */
const MARGIN = 0.25;

export class Ground {
  private readonly canvas = document.createElement("canvas");
  private readonly ctx: CanvasRenderingContext2D;
  private drawn: { view: View; key: readonly unknown[]; pieces: number[] } | undefined;

  constructor() {
    const ctx = this.canvas.getContext("2d", { alpha: false });
    if (!ctx) throw new Error("this browser draws no canvas");
    this.ctx = ctx;
  }

  /** Copies what is seen of it onto a scene. `present`: the map is that of the time that is shown. */
  draw(scene: Scene, map: MapSketch | undefined, present: boolean, ways: readonly Way[], until: number): void {
    const { view, palette, ratio } = scene;
    const [across, down] = [Math.ceil(view.width * MARGIN), Math.ceil(view.height * MARGIN)];
    const key = [view.scale, view.width, view.height, ratio, palette, map, present, ...ways.map(({ trail }) => trail.generation)];
    const whole = ways.map(({ trail }) => wholePieces(trail, until));
    const off = this.drawn && this.offset(view, this.drawn.view);
    const same =
      this.drawn?.key.every((part, index) => part === key[index]) &&
      off !== undefined &&
      Math.abs(off[0]) <= across &&
      Math.abs(off[1]) <= down &&
      this.drawn.pieces.every((count, index) => count <= (whole[index] as number));
    if (!same)
      this.begin(
        { ...scene, ctx: this.ctx, view: { ...view, width: view.width + 2 * across, height: view.height + 2 * down } },
        map,
        present,
        key,
      );
    const { drawn } = this;
    if (!drawn) return;
    ways.forEach(({ trail, style }, index) => {
      const [from, to] = [drawn.pieces[index] ?? 0, whole[index] as number];
      if (to > from) drawPieces({ ...scene, ctx: this.ctx, view: drawn.view }, trail, from, to, style);
      drawn.pieces[index] = to;
    });
    const [dx, dy] = this.offset(view, drawn.view);
    scene.ctx.setTransform(1, 0, 0, 1, 0, 0);
    scene.ctx.drawImage(this.canvas, -Math.round((across + dx) * ratio), -Math.round((down + dy) * ratio));
    scene.ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  /** By how many pixels the middle of the view lies right of and below that of the ground. */
  private offset(view: View, ground: View): readonly [number, number] {
    return [(view.x - ground.x) * view.scale, (ground.y - view.y) * view.scale];
  }

  private begin(scene: Scene, map: MapSketch | undefined, present: boolean, key: readonly unknown[]): void {
    const { ctx, view, ratio, palette } = scene;
    const [width, height] = [Math.ceil(view.width * ratio), Math.ceil(view.height * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.fillStyle = palette.paper;
    ctx.fillRect(0, 0, view.width, view.height);
    drawGrid(scene);
    if (map) {
      ctx.globalAlpha = present ? 1 : 0.4;
      drawMap(scene, map);
      ctx.globalAlpha = 1;
    }
    this.drawn = { view, key, pieces: [] };
  }
}
