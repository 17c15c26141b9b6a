/** The states of an axis as bands: how long each lasted, and what of it is seen. */
import type { Channel, History } from "../../model/model.ts";
import { GAP, lastNotAfter } from "./pyramid.ts";

/** A band on the screen: from one pixel to another, in a state (an index into STATES). */
export interface Band {
  readonly from: number;
  readonly to: number;
  readonly state: number;
}

/** Runs of the same state, kept up with a history. */
export class Runs {
  private readonly channel: Channel;
  private from: number[] = [];
  private to: number[] = [];
  private state: number[] = [];
  private history: History | undefined;
  private seen = 0;

  constructor(channel: Channel) {
    this.channel = channel;
  }

  get length(): number {
    return this.state.length;
  }

  update(history: History): void {
    const oldest = history.pushed - history.length;
    if (history !== this.history || history.pushed < this.seen || oldest > this.seen) {
      this.history = history;
      this.seen = oldest;
      this.from = [];
      this.to = [];
      this.state = [];
    }
    for (; this.seen < history.pushed; this.seen += 1) {
      const index = this.seen - oldest;
      this.take(history.at("t", index), history.at(this.channel, index));
    }
    const gone = lastNotAfter(this.to, history.at("t", 0)) + 1;
    if (gone > 1000) for (const column of [this.from, this.to, this.state]) column.splice(0, gone);
  }

  private take(t: number, state: number): void {
    const last = this.state.length - 1;
    const joined = last >= 0 && t - (this.to[last] as number) <= GAP;
    // A state lasts until the next sample: what is between is not known better.
    if (joined) this.to[last] = t;
    if (Number.isNaN(state)) {
      if (joined) this.push(t, -1);
      return;
    }
    if (!joined || this.state[last] !== state) this.push(t, state);
  }

  private push(t: number, state: number): void {
    if (state < 0 && this.state.at(-1) === state) return;
    this.from.push(t);
    this.to.push(t);
    this.state.push(state);
  }

  /**
   * The bands from t0 to t1 on so many pixels. Runs that are shorter than a pixel are taken together, as the state that lasted longest of them: so there are
   * no more bands than pixels, however often a state has changed.
   */
  bands(t0: number, t1: number, pixels: number): Band[] {
    const out: Band[] = [];
    const scale = pixels / (t1 - t0);
    const place = (t: number) => Math.min(pixels, Math.max(0, (t - t0) * scale));
    let small = { from: 0, to: 0, lasted: new Map<number, number>() };
    const flush = () => {
      const [longest] = [...small.lasted].sort((a, b) => b[1] - a[1]);
      if (longest && longest[0] >= 0) add(out, { from: small.from, to: small.to, state: longest[0] });
      small = { from: 0, to: 0, lasted: new Map() };
    };
    for (let index = Math.max(0, lastNotAfter(this.to, t0)); index < this.state.length && (this.from[index] as number) <= t1; index += 1) {
      const [from, to, state] = [place(this.from[index] as number), place(this.to[index] as number), this.state[index] as number];
      if (to - from >= 1) {
        flush();
        if (state >= 0) add(out, { from, to, state });
        continue;
      }
      if (small.lasted.size > 0 && from - small.to > 1) flush();
      if (small.lasted.size === 0) small.from = from;
      small.to = to;
      small.lasted.set(state, (small.lasted.get(state) ?? 0) + to - from);
      if (small.to - small.from >= 1) flush();
    }
    flush();
    return out;
  }
}

function add(out: Band[], band: Band): void {
  const last = out.at(-1);
  if (last && last.state === band.state && band.from - last.to < 1e-9) out[out.length - 1] = { ...last, to: band.to };
  else if (band.to > band.from) out.push(band);
}
