/** Ranges that do not jump about while data comes in, and ticks at round numbers. */
import { roundLength } from "../topview/geometry.ts";

export interface RangeWish {
  /** What is always in it. */
  readonly least: readonly [low: number, high: number];
  /** It is just that. */
  readonly fixed?: boolean;
}

/** A range that holds what there is: its ends are multiples of a round number, so that it changes seldom. */
export function niceRange(low: number | null, high: number | null, { least, fixed }: RangeWish): [number, number] {
  const [a, b] = [Math.min(least[0], low ?? least[0]), Math.max(least[1], high ?? least[1])];
  if (fixed && a === least[0] && b === least[1]) return [a, b];
  const step = roundLength(Math.max((b - a) / 4, 1e-9));
  const round = (value: number) => Number(value.toPrecision(12));
  return [round(Math.floor(a / step + 1e-9) * step), round(Math.ceil(b / step - 1e-9) * step)];
}

/** A range about what there is, not about zero: of a battery's voltage, the tenths matter. */
export function closeRange(low: number | null, high: number | null, span: number): [number, number] {
  if (low === null || high === null) return [0, span];
  const middle = (low + high) / 2;
  const half = Math.max(span / 2, ((high - low) / 2) * 1.1);
  return niceRange(middle - half, middle + half, { least: [middle - half, middle + half] });
}

/** Seconds between ticks, for labels that need so many pixels. */
export function timeStep(seconds: number, pixels: number, room: number): number {
  const least = (seconds * room) / Math.max(1, pixels);
  const minutes = [60, 120, 300, 600, 900, 1800, 3600, 7200, 14400];
  return least <= 20 ? roundLength(least) : (minutes.find((step) => step >= least) ?? least);
}

export function timeTicks(from: number, to: number, step: number): number[] {
  const ticks: number[] = [];
  for (let n = Math.ceil(from / step - 1e-9); n * step <= to + 1e-9 && ticks.length < 200; n += 1)
    ticks.push(Number((n * step).toPrecision(12)));
  return ticks;
}

/** A time of the base's clock: seconds, or minutes and seconds where there are many. */
export function timeWords(t: number, step: number): string {
  const sign = t < 0 ? "−" : "";
  const size = Math.abs(t);
  const digits = step >= 1 ? 0 : Math.min(3, Math.ceil(-Math.log10(step) - 1e-9));
  if (size < 120 && step < 60) return `${sign}${size.toFixed(digits)}`;
  const rounded = Number(size.toFixed(digits));
  const minutes = Math.floor(rounded / 60);
  const seconds = (rounded - 60 * minutes).toFixed(digits).padStart(digits > 0 ? digits + 3 : 2, "0");
  return `${sign}${minutes}:${seconds}`;
}
