/** The strip of the states: a row of bands for each axis, with the state's word in each band that has room for it. */
import { STATES } from "../../model/model.ts";
import { inkOn, MAX_PIXEL_RATIO, type Palette } from "../theme.ts";
import type { Band } from "./bands.ts";
import { type Frame, LEFT, RIGHT } from "./chart.ts";

const FONT = "600 11px system-ui, 'DejaVu Sans', sans-serif";
export const ROW = 22;
const ROW_GAP = 4;
export const STATES_HEIGHT = 2 * ROW + 3 * ROW_GAP;

/** Colour of each state; and its hatch, which is there for who sees no colours: none, rising, none (but dark), falling. */
const COLOURS = ["hold", "accel", "move", "deccel"] as const;
const HATCHES = ["none", "rising", "none", "falling"] as const;

export interface StateStrip {
  readonly canvas: HTMLCanvasElement;
  draw(rows: readonly { readonly name: string; readonly bands: readonly Band[] }[], frame: Frame): void;
  resize(width: number): void;
  recolour(): void;
}

export function makeStates(canvas: HTMLCanvasElement, palette: () => Palette): StateStrip {
  const ctx = canvas.getContext("2d");
  if (!ctx) throw new Error("this browser draws no canvas");
  let width = 0;
  let ratio = 1;
  let fills: (string | CanvasPattern)[] = [];
  const widths = new Map<string, number>();
  canvas.dataset.picture = "States: move above, turn below";

  const makeFills = () => {
    fills = COLOURS.map((colour, state) => hatched(ctx, palette()[colour], HATCHES[state] as (typeof HATCHES)[number], ratio));
  };
  const wordWidth = (word: string) => {
    const known = widths.get(word) ?? ctx.measureText(word).width;
    widths.set(word, known);
    return known;
  };

  return {
    canvas,
    resize: (next) => {
      const pixels = Math.min(MAX_PIXEL_RATIO, devicePixelRatio || 1);
      if (next === width && pixels === ratio) return;
      width = next;
      ratio = pixels;
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(STATES_HEIGHT * ratio);
      canvas.style.width = `${width}px`;
      canvas.style.height = `${STATES_HEIGHT}px`;
      makeFills();
    },
    recolour: makeFills,
    draw: (rows, { stretch, cursor, ticks }) => {
      const { paper, grid, muted, deccel } = palette();
      const plot = width - LEFT - RIGHT;
      const place = (t: number) => LEFT + ((t - stretch.from) / (stretch.to - stretch.from)) * plot;
      ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
      ctx.fillStyle = paper;
      ctx.fillRect(0, 0, width, STATES_HEIGHT);
      ctx.fillStyle = grid;
      for (const tick of ticks) ctx.fillRect(Math.round(place(tick)), 0, 1, STATES_HEIGHT);
      ctx.font = FONT;
      ctx.textBaseline = "middle";
      rows.forEach(({ name, bands }, row) => {
        const top = ROW_GAP + row * (ROW + ROW_GAP);
        ctx.fillStyle = muted;
        ctx.textAlign = "right";
        ctx.fillText(name, LEFT - 6, top + ROW / 2);
        ctx.textAlign = "center";
        for (const { from, to, state } of bands) {
          ctx.fillStyle = fills[state] ?? muted;
          ctx.fillRect(LEFT + from, top, Math.max(0.75, to - from), ROW);
          const word = STATES[state] ?? "";
          if (to - from < wordWidth(word) + 10) continue;
          const colour = palette()[COLOURS[state] as (typeof COLOURS)[number]];
          const middle = LEFT + (from + to) / 2;
          // The hatch must not run through the word.
          ctx.fillStyle = colour;
          ctx.fillRect(middle - wordWidth(word) / 2 - 3, top + 4, wordWidth(word) + 6, ROW - 8);
          ctx.fillStyle = inkOn(colour);
          ctx.fillText(word, middle, top + ROW / 2 + 0.5);
        }
      });
      if (cursor === undefined || cursor < stretch.from || cursor > stretch.to) return;
      ctx.fillStyle = deccel;
      ctx.fillRect(Math.round(place(cursor)) - 1, 0, 2, STATES_HEIGHT);
    },
  };
}

/** A tile of a colour with slanted lines: they join over its edges. */
function hatched(ctx: CanvasRenderingContext2D, colour: string, hatch: (typeof HATCHES)[number], ratio: number): string | CanvasPattern {
  if (hatch === "none") return colour;
  const size = Math.round(8 * ratio);
  const tile = document.createElement("canvas");
  tile.width = size;
  tile.height = size;
  const draw = tile.getContext("2d");
  if (!draw) return colour;
  draw.fillStyle = colour;
  draw.fillRect(0, 0, size, size);
  draw.strokeStyle = inkOn(colour);
  draw.globalAlpha = 0.55;
  draw.lineWidth = 1.5 * ratio;
  draw.beginPath();
  for (const shift of [-size, 0, size]) {
    const [low, high] = hatch === "rising" ? [size, 0] : [0, size];
    draw.moveTo(shift - 2, low + (hatch === "rising" ? 2 : -2));
    draw.lineTo(shift + size + 2, high + (hatch === "rising" ? -2 : 2));
  }
  draw.stroke();
  const pattern = ctx.createPattern(tile, "repeat");
  pattern?.setTransform(new DOMMatrix([1 / ratio, 0, 0, 1 / ratio, 0, 0]));
  return pattern ?? colour;
}
