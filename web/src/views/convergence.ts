/** The gains over time, each in a chart of its own (they have different units): the value, ± its deviation as a band, and the truth as a dashed line. */
import uPlot from "uplot";
import type { Gains } from "../model/model.ts";
import { h, setText } from "./dom.ts";
import { type GainName, gainWords } from "./gains.ts";

const HEIGHT = 112;
const LEAST_WIDTH = 160;

export interface Convergence {
  draw(gains: readonly Gains[], truth: readonly number[] | undefined): void;
  destroy(): void;
}

export function mount(element: HTMLElement, names: readonly GainName[]): Convergence {
  const ink = (name: string, otherwise: string) => getComputedStyle(element).getPropertyValue(name).trim() || otherwise;
  let charts: uPlot[] = [];
  let captions: HTMLElement[] = [];
  let drawn: (() => void) | undefined;
  const widthOf = (place: Element) => Math.max(LEAST_WIDTH, place.clientWidth);

  const build = () => {
    for (const chart of charts) chart.destroy();
    element.replaceChildren();
    const [muted, grid, line, truth] = [ink("--muted", "#555"), ink("--grid", "#ddd"), ink("--est", "#0072b2"), ink("--true", "#d55e00")];
    const axis: uPlot.Axis = { stroke: muted, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid }, font: "11px system-ui" };
    captions = [];
    charts = names.map(({ name }) => {
      const caption = h("span");
      const place = h("figure", { class: "gain" }, h("figcaption", {}, h("b", {}, name), " ", caption));
      captions.push(caption);
      element.append(place);
      return new uPlot(
        {
          width: widthOf(place),
          height: HEIGHT,
          legend: { show: false },
          cursor: { show: false },
          scales: { x: { time: false } },
          axes: [
            { ...axis, size: 26, values: (_, ticks) => ticks.map((tick) => `${tick} s`) },
            { ...axis, size: 54, values: (_, ticks) => ticks.map((tick) => String(Number(tick.toFixed(5)))) },
          ],
          series: [
            {},
            { stroke: "transparent", points: { show: false } },
            { stroke: "transparent", points: { show: false } },
            { stroke: line, width: 2, points: { show: false } },
            { stroke: truth, width: 1.5, dash: [6, 4], points: { show: false } },
          ],
          bands: [{ series: [2, 1], fill: `${line}33` }],
        },
        [[], [], [], [], []],
        place,
      );
    });
    drawn?.();
  };

  let width = 0;
  const sizes = new ResizeObserver(() => {
    if (element.clientWidth === width || element.clientWidth === 0) return;
    width = element.clientWidth;
    for (const chart of charts) chart.setSize({ width: widthOf(chart.root.parentElement ?? element), height: HEIGHT });
  });
  // Canvases take no notice of a change of the colours.
  const colours = new MutationObserver(build);
  build();
  sizes.observe(element);
  colours.observe(document.documentElement, { attributeFilter: ["data-theme"] });

  return {
    draw: (gains, truth) => {
      drawn = () => {
        const times = gains.map((each) => each.t);
        charts.forEach((chart, at) => {
          const values = gains.map((each) => each.values[at] ?? null);
          const off = (sign: number) => gains.map((each) => (each.values[at] ?? Number.NaN) + sign * (each.deviations[at] ?? Number.NaN));
          const known = truth?.[at];
          const caption = captions[at];
          const now = gains.at(-1);
          if (caption) setText(caption, gainWords(now?.values[at], now?.deviations[at], names[at]?.unit ?? "", known));
          chart.setData([times, off(-1), off(1), values, times.map(() => known ?? null)]);
        });
      };
      drawn();
    },
    destroy: () => {
      sizes.disconnect();
      colours.disconnect();
      for (const chart of charts) chart.destroy();
      element.replaceChildren();
    },
  };
}
