/** The history of a base: a ring of samples, a column of numbers for each channel. */
import { CHANNELS, type Channel, type History, type Sample } from "./model.ts";

/** 20 minutes at 50 Hz. */
export const LIVE_CAPACITY = 60_000;

export class Ring implements History {
  readonly capacity: number;
  pushed = 0;
  length = 0;
  /** Where the next sample goes. */
  #next = 0;
  #columns = new Map<Channel, Float64Array>();

  /** With `absent` channels, which nobody will ever push: they cost no room. */
  constructor(capacity: number, absent: ReadonlySet<Channel> = new Set()) {
    this.capacity = capacity;
    for (const channel of CHANNELS) {
      if (!absent.has(channel)) this.#columns.set(channel, new Float64Array(capacity));
    }
  }

  /** False for a sample that is older than the last one, or whose time is no number: it has no place here. */
  push(sample: Readonly<Sample>): boolean {
    if (!Number.isFinite(sample.t) || sample.t < this.last) return false;
    for (const [channel, column] of this.#columns) column[this.#next] = sample[channel];
    this.#next = (this.#next + 1) % this.capacity;
    this.length = Math.min(this.length + 1, this.capacity);
    this.pushed += 1;
    return true;
  }

  /** The time of the last sample; before all times if there is none. */
  get last(): number {
    return this.length === 0 ? Number.NEGATIVE_INFINITY : this.at("t", this.length - 1);
  }

  /** Forgets all. Whoever goes by `pushed` sees that something is new. */
  clear(): void {
    this.length = 0;
    this.#next = 0;
    this.pushed += 1;
  }

  at(channel: Channel, index: number): number {
    const column = this.#columns.get(channel);
    if (!column || index < 0 || index >= this.length) return Number.NaN;
    return column[(this.#next - this.length + index + this.capacity) % this.capacity] ?? Number.NaN;
  }

  indexAt(t: number): number {
    let below = -1;
    let above = this.length;
    while (above - below > 1) {
      const middle = (below + above) >> 1;
      if (this.at("t", middle) <= t) below = middle;
      else above = middle;
    }
    return below;
  }
}

/** A sample of which nothing is known. */
export function blank(): Sample {
  return Object.fromEntries(CHANNELS.map((channel) => [channel, Number.NaN])) as Sample;
}
