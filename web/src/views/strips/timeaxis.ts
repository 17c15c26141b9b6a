/** The one time axis below all strips. */
import { MAX_PIXEL_RATIO, type Palette } from "../theme.ts";
import { type Frame, LEFT, RIGHT } from "./chart.ts";
import { timeWords } from "./scales.ts";

export const AXIS_HEIGHT = 20;

export interface TimeAxis {
  resize(width: number): void;
  draw(frame: Frame, step: number): void;
}

export function makeTimeAxis(canvas: HTMLCanvasElement, palette: () => Palette): TimeAxis {
  const ctx = canvas.getContext("2d");
  if (!ctx) throw new Error("this browser draws no canvas");
  let width = 0;
  let ratio = 1;
  canvas.dataset.picture = "";
  return {
    resize: (next) => {
      const pixels = Math.min(MAX_PIXEL_RATIO, devicePixelRatio || 1);
      if (next === width && pixels === ratio) return;
      width = next;
      ratio = pixels;
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(AXIS_HEIGHT * ratio);
      canvas.style.width = `${width}px`;
      canvas.style.height = `${AXIS_HEIGHT}px`;
    },
    draw: ({ stretch, ticks }, step) => {
      const { paper, muted } = palette();
      const plot = width - LEFT - RIGHT;
      ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
      ctx.fillStyle = paper;
      ctx.fillRect(0, 0, width, AXIS_HEIGHT);
      ctx.fillStyle = muted;
      ctx.font = "11px system-ui, 'DejaVu Sans', sans-serif";
      ctx.textBaseline = "middle";
      ctx.textAlign = "center";
      for (const tick of ticks) {
        const x = LEFT + ((tick - stretch.from) / (stretch.to - stretch.from)) * plot;
        ctx.fillRect(Math.round(x), 0, 1, 4);
        if (x > LEFT + 14 && x < width - 14) ctx.fillText(timeWords(tick, step), x, 12);
      }
      ctx.textAlign = "right";
      ctx.fillText("t [s]", LEFT - 6, 12);
    },
  };
}
