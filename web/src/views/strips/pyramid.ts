/**
 * The history at several resolutions, so that twenty minutes draw as fast as twenty seconds: a bucket of each level holds the least and the greatest value
 * of about four buckets of the level below. Nothing is thinned out: a spike of one sample is seen at any zoom.
 */
import type { Channel, History } from "../../model/model.ts";

const FACTOR = 4;
/** Up to half a million samples a bucket. */
const LEVELS = 9;
/** What lies farther apart is not joined: telemetry was not there, s. */
export const GAP = 0.5;

export type Cell = number | null;

/** Times and the values of some channels at them; null where nothing is known. */
export interface Columns {
  readonly t: number[];
  readonly values: readonly Cell[][];
}

/** The least and the greatest of each channel, by buckets; 1 in `falls`: the greatest came first. */
interface Extremes {
  readonly low: number[][];
  readonly high: number[][];
  readonly falls: number[][];
}

interface Buckets extends Extremes {
  /** The first sample of each, of all that were ever pushed. */
  readonly first: number[];
  readonly from: number[];
  readonly to: number[];
  /** Buckets of the level below, or samples, within. */
  readonly count: number[];
  /** The first sample that is not in any of them yet. */
  upTo: number;
}

function extremes(channels: number): Extremes {
  const columns = () => Array.from({ length: channels }, (): number[] => []);
  return { low: columns(), high: columns(), falls: columns() };
}

function empty(channels: number): Buckets {
  return { first: [], from: [], to: [], count: [], upTo: 0, ...extremes(channels) };
}

export class Pyramid {
  private readonly channels: readonly Channel[];
  private readonly columnOf: ReadonlyMap<Channel, number>;
  private levels: Buckets[] = [];
  private history: History | undefined;
  private seen = 0;
  /** The sample that is taken in. */
  private readonly sample: Extremes;

  constructor(channels: readonly Channel[]) {
    this.channels = channels;
    this.columnOf = new Map(channels.map((channel, index) => [channel, index]));
    this.sample = extremes(channels.length);
    for (const falls of this.sample.falls) falls[0] = 0;
  }

  /** Takes in what is new since the last time. */
  update(history: History): void {
    const oldest = history.pushed - history.length;
    if (history !== this.history || history.pushed < this.seen || oldest > this.seen) this.reset(history, oldest);
    const { low, high } = this.sample;
    for (; this.seen < history.pushed; this.seen += 1) {
      const index = this.seen - oldest;
      const t = history.at("t", index);
      this.channels.forEach((channel, column) => {
        const value = history.at(channel, index);
        (low[column] as number[])[0] = value;
        (high[column] as number[])[0] = value;
      });
      this.add(0, this.seen, t, t, this.sample, 0);
    }
    for (const level of this.levels) this.forget(level, oldest);
  }

  /** What is needed to draw some channels from t0 to t1 on so many pixels, and a little beyond, so that lines go on to the edges. */
  columns(channels: readonly Channel[], t0: number, t1: number, pixels: number): Columns {
    const { history } = this;
    if (!history || history.length === 0) return { t: [], values: channels.map(() => []) };
    const from = Math.max(0, history.indexAt(t0));
    const to = Math.min(history.length - 1, history.indexAt(t1) + 1);
    const perPixel = (to - from + 1) / Math.max(1, pixels);
    // Up to two buckets a pixel, two points each: what is beside each other on a pixel is not told apart.
    const height = Math.min(LEVELS, Math.max(0, Math.ceil(Math.log(perPixel / 2) / Math.log(FACTOR))));
    return height === 0 ? this.samples(history, channels, from, to) : this.extremes(channels, height, t0, t1);
  }

  private reset(history: History, oldest: number): void {
    this.history = history;
    this.seen = oldest;
    this.levels = Array.from({ length: LEVELS }, () => empty(this.channels.length));
  }

  /** Adds what is at an index of a level below to a level. What is full there is passed on to the next one. */
  private add(height: number, first: number, from: number, to: number, source: Extremes, at: number): void {
    const level = this.levels[height] as Buckets;
    const open = level.count.length - 1;
    if (open < 0 || (level.count[open] as number) >= FACTOR || from - (level.to[open] as number) > GAP) {
      if (open >= 0 && height + 1 < LEVELS) {
        const above = this.levels[height + 1] as Buckets;
        above.upTo = first;
        this.add(height + 1, level.first[open] as number, level.from[open] as number, level.to[open] as number, level, open);
      }
      level.first.push(first);
      level.from.push(from);
      level.to.push(to);
      level.count.push(1);
      for (const name of ["low", "high", "falls"] as const) {
        for (let column = 0; column < level[name].length; column += 1) level[name][column]?.push(source[name][column]?.[at] as number);
      }
      return;
    }
    level.to[open] = to;
    level.count[open] = (level.count[open] as number) + 1;
    for (let column = 0; column < level.low.length; column += 1) {
      const [low, high, falls] = [level.low[column] as number[], level.high[column] as number[], level.falls[column] as number[]];
      const [least, greatest] = [source.low[column]?.[at] as number, source.high[column]?.[at] as number];
      if (Number.isNaN(least)) continue;
      // Not `least < low`: a bucket that has no value yet takes the first one.
      const lower = !(least >= (low[open] as number));
      const higher = !(greatest <= (high[open] as number));
      if (lower) low[open] = least;
      if (higher) high[open] = greatest;
      if (lower || higher) falls[open] = lower && higher ? (source.falls[column]?.[at] as number) : lower ? 1 : 0;
    }
  }

  private forget(level: Buckets, oldest: number): void {
    const { first } = level;
    // When half of it is old, so that each bucket is copied once.
    const half = first[first.length >> 1];
    if (half === undefined || half >= oldest) return;
    const cut = first.findIndex((sample) => sample >= oldest);
    const drop = Math.max(0, (cut < 0 ? first.length : cut) - 1);
    for (const column of [level.first, level.from, level.to, level.count, ...level.low, ...level.high, ...level.falls])
      column.splice(0, drop);
  }

  private samples(history: History, channels: readonly Channel[], from: number, to: number): Columns {
    const t: number[] = [];
    const values = channels.map((): Cell[] => []);
    for (let index = from; index <= to; index += 1) {
      const time = history.at("t", index);
      this.breakBefore(t, values, time);
      t.push(time);
      for (let column = 0; column < channels.length; column += 1) {
        const value = history.at(channels[column] as Channel, index);
        values[column]?.push(Number.isNaN(value) ? null : value);
      }
    }
    return { t, values };
  }

  private extremes(channels: readonly Channel[], height: number, t0: number, t1: number): Columns {
    const out: Columns = { t: [], values: channels.map((): Cell[] => []) };
    const columns = channels.map((channel) => this.columnOf.get(channel) ?? -1);
    // What a level does not have yet, the one below has, in a few buckets.
    let upTo = Number.NEGATIVE_INFINITY;
    for (let each = height - 1; each >= 0; each -= 1) {
      const level = this.levels[each] as Buckets;
      const begin = Math.max(lastNotAfter(level.from, t0) - 1, lastNotAfter(level.first, upTo - 1) + 1, 0);
      for (let at = begin; at < level.from.length; at += 1) {
        this.put(out, level, at, columns);
        if ((level.from[at] as number) > t1) return out;
      }
      upTo = Math.max(upTo, level.upTo);
    }
    return out;
  }

  private put({ t, values }: Columns, level: Buckets, at: number, columns: readonly number[]): void {
    const [from, to] = [level.from[at] as number, level.to[at] as number];
    this.breakBefore(t, values, from);
    t.push(from);
    if (to > from) t.push(to);
    columns.forEach((column, each) => {
      const [low, high] = [level.low[column]?.[at] ?? Number.NaN, level.high[column]?.[at] ?? Number.NaN];
      const [a, b] = level.falls[column]?.[at] ? [high, low] : [low, high];
      const known = !Number.isNaN(low);
      values[each]?.push(known ? a : null);
      if (to > from) values[each]?.push(known ? b : null);
    });
  }

  private breakBefore(t: number[], values: readonly Cell[][], time: number): void {
    const last = t.at(-1);
    if (last === undefined || time - last <= GAP) return;
    t.push((last + time) / 2);
    for (const column of values) column.push(null);
  }
}

/** The index of the last number that is not above a limit; −1 if all are. They ascend. */
export function lastNotAfter(numbers: readonly number[], limit: number): number {
  let [low, high] = [0, numbers.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((numbers[middle] as number) <= limit) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
