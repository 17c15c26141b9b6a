/**
 * The way that the base came, as few points as draw it. A straight metre is two points, standing is none; so what is drawn is bounded by the way's shape on
 * the screen, not by the number of samples.
 */
import type { Channel, History } from "../../model/model.ts";
import type { Bounds } from "./geometry.ts";

/** Deviation of the line that is kept from the samples, m: below a pixel at 2000 pixels a metre. */
const FINE_TOLERANCE = 2.5e-4;
/** Of the line that is drawn from the one that is kept, pixels. */
const DRAWN_TOLERANCE = 0.4;
/** Points of a piece that is drawn, or left out, as a whole. */
const PIECE = 64;
/** What no base drives within a sample: the estimate was set anew there, and no way leads to it. */
const JUMP = 0.3;
const JUMP_SPEED = 5;

/** Passes on those points of a line from which no other is farther than a tolerance. */
export class Sleeve {
  private readonly tolerance: number;
  private readonly emit: (x: number, y: number, index: number) => void;
  private anchorX = Number.NaN;
  private anchorY = Number.NaN;
  /** The last point; not passed on yet. */
  private x = Number.NaN;
  private y = Number.NaN;
  private index = -1;
  private farthest = 0;
  /** Directions, from `along`, in which the line may go on: each point since the anchor is within the tolerance of any of them. */
  private along = 0;
  private low = Number.NEGATIVE_INFINITY;
  private high = Number.POSITIVE_INFINITY;

  constructor(tolerance: number, emit: (x: number, y: number, index: number) => void) {
    this.tolerance = tolerance;
    this.emit = emit;
  }

  push(x: number, y: number, index: number): void {
    if (this.index < 0) this.restart(x, y, index);
    else if (!this.takes(x, y)) {
      this.restart(this.x, this.y, this.index);
      this.takes(x, y);
    }
    this.x = x;
    this.y = y;
    this.index = index;
  }

  /** Passes on the last point: the line ends there. */
  end(): void {
    if (this.index >= 0 && (this.x !== this.anchorX || this.y !== this.anchorY)) this.emit(this.x, this.y, this.index);
    this.index = -1;
  }

  private restart(x: number, y: number, index: number): void {
    this.anchorX = x;
    this.anchorY = y;
    this.farthest = 0;
    this.low = Number.NEGATIVE_INFINITY;
    this.high = Number.POSITIVE_INFINITY;
    this.emit(x, y, index);
  }

  private takes(x: number, y: number): boolean {
    const [dx, dy] = [x - this.anchorX, y - this.anchorY];
    const distance = Math.hypot(dx, dy);
    // It comes back: the turning point must be seen.
    if (distance < this.farthest - this.tolerance) return false;
    if (distance <= this.tolerance) return true;
    const direction = Math.atan2(dy, dx);
    if (this.farthest === 0) this.along = direction;
    const turned = direction - this.along;
    const off = turned - 2 * Math.PI * Math.round(turned / (2 * Math.PI));
    if (off < this.low || off > this.high) return false;
    const slack = Math.asin(Math.min(1, this.tolerance / distance));
    this.low = Math.max(this.low, off - slack);
    this.high = Math.min(this.high, off + slack);
    this.farthest = Math.max(this.farthest, distance);
    return true;
  }
}

/** Points of a line; x is NaN where it is broken. */
export interface Line {
  readonly x: number[];
  readonly y: number[];
  /** Which sample each is, of all that were ever pushed. */
  readonly sample: number[];
}

/** A piece of a line: its points from `first` to `last`, which is the next piece's first. */
export interface Piece {
  readonly first: number;
  readonly last: number;
  readonly bounds: Bounds;
  /** Length of the line before it, m: where in the dashes it begins. */
  readonly before: number;
}

const empty = (): Line => ({ x: [], y: [], sample: [] });

/** The way of two channels, x and y, kept up with a history. */
export class Trail {
  /** What is drawn. Points are only ever added, but where `generation` changes: then it is another line. */
  line = empty();
  generation = 0;
  readonly pieces: Piece[] = [];
  private fine = empty();
  private fineSleeve = new Sleeve(FINE_TOLERANCE, () => {});
  private sleeve = new Sleeve(1, () => {});
  private history: History | undefined;
  private seen = 0;
  private passed = 0;
  private level = Number.NaN;
  private last = { x: Number.NaN, y: Number.NaN, t: Number.NaN };
  private readonly xs: Channel;
  private readonly ys: Channel;

  constructor(xs: Channel, ys: Channel) {
    this.xs = xs;
    this.ys = ys;
  }

  /** Takes in what is new, and makes it fit for a scale (pixels a metre). */
  update(history: History, scale: number): void {
    const oldest = history.pushed - history.length;
    // What the history has forgotten goes when it is half of what is kept: so each point is copied once.
    const half = this.fine.sample[this.fine.sample.length >> 1];
    if (history !== this.history || history.pushed < this.seen || (half !== undefined && half < oldest)) this.reset(history, oldest);
    this.take(history, oldest);
    const level = 2 ** Math.ceil(Math.log2(scale));
    if (level !== this.level) this.redraw(level);
    this.pass();
  }

  private reset(history: History, oldest: number): void {
    this.history = history;
    this.seen = oldest;
    this.fine = empty();
    this.fineSleeve = new Sleeve(FINE_TOLERANCE, (x, y, index) => add(this.fine, x, y, index));
    this.last = { x: Number.NaN, y: Number.NaN, t: Number.NaN };
    this.level = Number.NaN;
  }

  private take(history: History, oldest: number): void {
    for (let sample = Math.max(this.seen, oldest); sample < history.pushed; sample += 1) {
      const index = sample - oldest;
      const [x, y, t] = [history.at(this.xs, index), history.at(this.ys, index), history.at("t", index)];
      if (Number.isNaN(x) || Number.isNaN(y)) this.breakAt(sample);
      else {
        const { last } = this;
        const jump = Math.hypot(x - last.x, y - last.y);
        if (jump > JUMP + JUMP_SPEED * Math.max(0, t - last.t)) this.breakAt(sample);
        this.fineSleeve.push(x, y, sample);
      }
      this.last = { x, y, t };
    }
    this.seen = history.pushed;
  }

  private breakAt(sample: number): void {
    this.fineSleeve.end();
    if (!Number.isNaN(this.fine.x.at(-1) ?? Number.NaN)) add(this.fine, Number.NaN, Number.NaN, sample);
  }

  private redraw(level: number): void {
    this.level = level;
    this.line = empty();
    this.generation += 1;
    this.pieces.length = 0;
    this.passed = 0;
    this.sleeve = new Sleeve(DRAWN_TOLERANCE / level, (x, y, index) => add(this.line, x, y, index));
  }

  private pass(): void {
    const { x, y, sample } = this.fine;
    for (; this.passed < sample.length; this.passed += 1) {
      const [px, py, index] = [x[this.passed] as number, y[this.passed] as number, sample[this.passed] as number];
      if (Number.isNaN(px)) {
        this.sleeve.end();
        add(this.line, px, py, index);
      } else this.sleeve.push(px, py, index);
    }
    this.cut();
  }

  private cut(): void {
    let first = this.pieces.at(-1)?.last ?? 0;
    while (this.line.x.length - 1 - first >= PIECE) {
      const last = first + PIECE;
      const before = this.pieces.at(-1);
      this.pieces.push({
        first,
        last,
        bounds: boundsOf(this.line, first, last),
        before: before ? before.before + lengthOf(this.line, before) : 0,
      });
      first = last;
    }
  }

  /** The piece that is not full yet, up to the newest point. */
  rest(): Piece {
    const before = this.pieces.at(-1);
    const [first, last] = [before?.last ?? 0, this.line.x.length - 1];
    return { first, last, bounds: boundsOf(this.line, first, last), before: before ? before.before + lengthOf(this.line, before) : 0 };
  }

  /**
   * What is not in the line yet: from its last point over the newest one that was kept. The newest sample itself is for the caller to add, since he
   * knows where the base is.
   */
  get pending(): readonly [x: number, y: number] | undefined {
    const [x, y] = [this.fine.x.at(-1), this.fine.y.at(-1)];
    return x === undefined || y === undefined || Number.isNaN(x) ? undefined : [x, y];
  }
}

function add(line: Line, x: number, y: number, index: number): void {
  line.x.push(x);
  line.y.push(y);
  line.sample.push(index);
}

function boundsOf({ x, y }: Line, first: number, last: number): Bounds {
  let [minX, minY, maxX, maxY] = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (let index = first; index <= last; index += 1) {
    const [px, py] = [x[index] as number, y[index] as number];
    if (px < minX) minX = px;
    if (px > maxX) maxX = px;
    if (py < minY) minY = py;
    if (py > maxY) maxY = py;
  }
  return { minX, minY, maxX, maxY };
}

function lengthOf({ x, y }: Line, { first, last }: Piece): number {
  let length = 0;
  for (let index = first; index < last; index += 1) {
    const step = Math.hypot((x[index + 1] as number) - (x[index] as number), (y[index + 1] as number) - (y[index] as number));
    if (!Number.isNaN(step)) length += step;
  }
  return length;
}
