/** How long frames take in a page, and how often they come. */

export interface Frames {
  /** Milliseconds from a frame's first callback until the page is done with it: scripts, style, layout, recording what is painted. */
  readonly work: number[];
  /** Milliseconds between frames. */
  readonly intervals: number[];
}

declare global {
  interface Window {
    frames_: { take(): Frames };
  }
}

/** Runs in the page. A message that is posted in a frame's first callback is delivered after the frame; what else was waiting then is counted with it. */
export function inFrames(): void {
  let frames: Frames = { work: [], intervals: [] };
  let last = Number.NaN;
  let begun = 0;
  const { port1, port2 } = new MessageChannel();
  port1.onmessage = () => frames.work.push(performance.now() - begun);
  const look = () => {
    requestAnimationFrame(look);
    begun = performance.now();
    if (!Number.isNaN(last)) frames.intervals.push(begun - last);
    last = begun;
    port2.postMessage(undefined);
  };
  requestAnimationFrame(look);
  window.frames_ = {
    take: () => {
      const taken = frames;
      frames = { work: [], intervals: [] };
      last = Number.NaN;
      return taken;
    },
  };
}

/** Quantiles of many values, to a tenth, in bounded memory. */
export class Quantiles {
  #bins = new Uint32Array(20_001);
  #count = 0;
  max = 0;

  add(value: number): void {
    const bin = Math.min(this.#bins.length - 1, Math.max(0, Math.round(value * 10)));
    this.#bins[bin] = (this.#bins[bin] ?? 0) + 1;
    this.#count += 1;
    this.max = Math.max(this.max, value);
  }

  at(share: number): number {
    let seen = 0;
    for (const [bin, count] of this.#bins.entries()) {
      seen += count;
      if (seen >= share * this.#count) return bin / 10;
    }
    return Number.NaN;
  }

  text(unit: string): string {
    return `p50 ${this.at(0.5).toFixed(1)}, p95 ${this.at(0.95).toFixed(1)}, p99 ${this.at(0.99).toFixed(1)}, max ${this.max.toFixed(1)} ${unit} (${this.#count} frames)`;
  }
}
