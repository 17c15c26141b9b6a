/** Collects what a log has, row by row, into a recording. */

import type { FaultChange } from "../model/faults.ts";
import { blank } from "../model/history.ts";
import type { Recording } from "../model/log.ts";
import { CHANNELS, type Channel, type Estimate, type Geometry, type History, type Sample, type Spoken } from "../model/model.ts";
import type { Wheels } from "./wheels.ts";

/** More rows than 11 hours at 50 Hz are no log that a page can show. */
export const MAX_ROWS = 2_000_000;
const FIRST_ROOM = 4096;

/** Columns that grow; those that never had a number cost nothing. */
class Columns implements History {
  length = 0;
  #columns = new Map<Channel, Float64Array>();
  #room = FIRST_ROOM;

  get capacity(): number {
    return Math.max(1, this.length);
  }

  get pushed(): number {
    return this.length;
  }

  add(sample: Readonly<Sample>): void {
    if (this.length === this.#room) this.#grow();
    for (const channel of CHANNELS) {
      const value = sample[channel];
      const column = this.#columns.get(channel);
      if (column) column[this.length] = value;
      else if (!Number.isNaN(value)) this.#begin(channel)[this.length] = value;
    }
    this.length += 1;
  }

  at(channel: Channel, index: number): number {
    return index >= 0 && index < this.length ? (this.#columns.get(channel)?.[index] ?? Number.NaN) : Number.NaN;
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

  #begin(channel: Channel): Float64Array {
    const column = new Float64Array(this.#room).fill(Number.NaN);
    this.#columns.set(channel, column);
    return column;
  }

  #grow(): void {
    this.#room *= 2;
    for (const [channel, column] of this.#columns) {
      const wider = new Float64Array(this.#room).fill(Number.NaN);
      wider.set(column);
      this.#columns.set(channel, wider);
    }
  }
}

/** At most so many estimates with covariance are kept: the ellipse is looked up by time. */
const MAX_ESTIMATES = 100_000;
const MAX_SPOKEN = 2000;

export class Builder {
  readonly sample: Sample = blank();
  geometry: Geometry;
  /** Of a log of counts. */
  readonly wheels: Wheels;
  #columns = new Columns();
  #estimates: Estimate[] = [];
  #faults: FaultChange[] = [];
  #spoken: Spoken[] = [];
  #last = Number.NEGATIVE_INFINITY;
  /** Every so many of the estimates are kept. */
  #stride = 1;
  #told = 0;

  constructor(geometry: Geometry, wheels: Wheels) {
    this.geometry = geometry;
    this.wheels = wheels;
  }

  get rows(): number {
    return this.#columns.length;
  }

  /** Takes `sample` as the next row. Throws what is wrong with it. */
  row(): void {
    const { t } = this.sample;
    if (!Number.isFinite(t)) throw new Error("column `t`: there is no time");
    if (t < this.#last) throw new Error(`column \`t\`: ${t} is before ${this.#last} of the previous row`);
    if (this.rows >= MAX_ROWS) throw new Error(`there are more than ${MAX_ROWS} rows`);
    this.#last = t;
    this.#columns.add(this.sample);
  }

  clear(): void {
    for (const channel of CHANNELS) this.sample[channel] = Number.NaN;
  }

  estimate(estimate: Estimate): void {
    this.#told += 1;
    if (this.#told % this.#stride !== 0) return;
    this.#estimates.push(estimate);
    if (this.#estimates.length < MAX_ESTIMATES) return;
    // Every second one goes, rather than the beginning or the end.
    this.#estimates = this.#estimates.filter((_, at) => at % 2 === 0);
    this.#stride *= 2;
  }

  fault(change: FaultChange): void {
    if (change.fault !== this.#faults.at(-1)?.fault) this.#faults.push(change);
  }

  say(spoken: Spoken): void {
    this.#spoken.push(spoken);
    if (this.#spoken.length > 2 * MAX_SPOKEN) this.#spoken = this.#spoken.slice(-MAX_SPOKEN);
  }

  /** How it was read, where that is a matter of opinion. */
  note(text: string): void {
    this.say({ at: Date.now(), direction: "note", text });
  }

  finish(name: string): Recording {
    if (this.rows === 0) throw new Error("there is no row in it");
    return {
      name,
      history: this.#columns,
      estimates: this.#estimates,
      faults: this.#faults,
      spoken: this.#spoken.slice(-MAX_SPOKEN),
      geometry: this.geometry,
    };
  }
}
