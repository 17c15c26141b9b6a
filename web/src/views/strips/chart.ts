/** One strip of lines: a chart without a legend and axis of its own; those are the column's. */
import uPlot from "uplot";
import type { Palette } from "../theme.ts";
import type { StripWish } from "./panels.ts";
import type { Columns } from "./pyramid.ts";
import type { Stretch } from "./span.ts";

/** Room for the values to the left of all strips, and to their right, pixels. */
export const LEFT = 50;
export const RIGHT = 10;
const FONT = "11px system-ui, 'DejaVu Sans', sans-serif";

export interface Frame {
  readonly stretch: Stretch;
  /** Instant that is looked at, if it is not now. */
  readonly cursor: number | undefined;
  readonly ticks: readonly number[];
}

export interface Chart {
  readonly plot: uPlot;
  draw(columns: Columns, frame: Frame): void;
  /** Shows the cross-hair at pixels from the left of the plot; undefined: none. */
  hover(px: number | undefined): void;
  resize(width: number, height: number): void;
  destroy(): void;
}

export function makeChart(element: HTMLElement, wish: StripWish, palette: () => Palette): Chart {
  let frame: Frame = { stretch: { from: 0, to: 1 }, cursor: undefined, ticks: [] };
  const grid = { stroke: () => palette().grid, width: 1 };
  const short = (value: number) => String(Number(value.toPrecision(6))).replace("-", "−");
  const plot = new uPlot(
    {
      width: 100,
      height: 60,
      padding: [5, RIGHT, 5, 0],
      legend: { show: false },
      cursor: {
        x: true,
        y: false,
        points: { size: 5 },
        drag: { x: false, y: false, setScale: false },
        // The column listens, for all of its strips.
        bind: {
          mousedown: () => null,
          mouseup: () => null,
          click: () => null,
          dblclick: () => null,
          mousemove: () => null,
          mouseleave: () => null,
          mouseenter: () => null,
        },
      },
      scales: { x: { time: false, auto: false }, y: { range: (_, low, high) => wish.range(low, high) } },
      axes: [
        { size: 0, gap: 0, values: (_, splits) => splits.map(() => ""), splits: () => [...frame.ticks], grid, ticks: { show: false } },
        {
          size: LEFT,
          gap: 4,
          font: FONT,
          stroke: () => palette().muted,
          grid,
          ticks: { show: false },
          space: 16,
          values: (_, splits) => splits.map(short),
        },
      ],
      series: [
        {},
        ...wish.lines.map(({ name, colour, dashed }) => ({
          label: name,
          stroke: () => palette()[colour],
          width: 1.5,
          ...(dashed ? { dash: [5, 4] } : {}),
          points: { show: false },
        })),
      ],
      hooks: { draw: [(drawn) => drawCursor(drawn, frame.cursor, palette().deccel)] },
    },
    [[], ...wish.lines.map(() => [])],
    element,
  );
  plot.ctx.canvas.dataset.picture = `${wish.title}${wish.unit ? ` [${wish.unit}]` : ""}: ${wish.lines.map(({ name, dashed }) => name + (dashed ? " (dashed)" : "")).join(", ")}`;

  return {
    plot,
    draw: ({ t, values }, next) => {
      frame = next;
      const { factor } = wish;
      const scaled = factor === 1 ? values : values.map((column) => column.map((value) => (value === null ? null : value * factor)));
      plot.batch(() => {
        plot.setData([t, ...scaled.map((column) => [...column])] as uPlot.AlignedData, false);
        plot.setScale("x", { min: next.stretch.from, max: next.stretch.to });
      });
    },
    hover: (px) => plot.setCursor(px === undefined ? { left: -10, top: -10 } : { left: px, top: 0 }, false),
    resize: (width, height) => {
      if (plot.width !== width || plot.height !== height) plot.setSize({ width, height });
    },
    destroy: () => plot.destroy(),
  };
}

function drawCursor(plot: uPlot, t: number | undefined, colour: string): void {
  if (t === undefined) return;
  const x = Math.round(plot.valToPos(t, "x", true));
  const { left, top, width, height } = plot.bbox;
  if (x < left || x > left + width) return;
  plot.ctx.fillStyle = colour;
  plot.ctx.fillRect(x - 1, top, 2 * uPlot.pxRatio, height);
}
