/** Feeds the base fixes from the true pose of the simulated world, at a steady pace, with reproducible noise. */

/** One fix: resolved with the base's reply. The number makes each fix's noise its own. */
export type Give = (number: number) => Promise<string>;

export interface Tally {
  readonly running: boolean;
  readonly taken: number;
  readonly refused: number;
  /** The last reply, or why it stopped. */
  readonly last: string;
}

export interface Clock {
  every(ms: number, tick: () => void): () => void;
}

export const clock: Clock = {
  every: (ms, tick) => {
    const timer = setInterval(tick, ms);
    return () => clearInterval(timer);
  },
};

export class Fixes {
  #changed: (tally: Tally) => void;
  #clock: Clock;
  #end: (() => void) | undefined;
  #tally: Tally = { running: false, taken: 0, refused: 0, last: "" };

  constructor(changed: (tally: Tally) => void, at: Clock = clock) {
    this.#changed = changed;
    this.#clock = at;
  }

  get running(): boolean {
    return this.#tally.running;
  }

  /** Gives a fix each period while `may` says so: not while nobody looks, since a fix is a sign of life to the base. */
  start(periodS: number, give: Give, may: () => boolean): void {
    this.stop("");
    this.#tell({ running: true, taken: 0, refused: 0, last: "" });
    let number = 0;
    let waiting = false;
    // Replies of a run that was ended are nobody's.
    let current = true;
    const one = async () => {
      if (waiting || !may()) return;
      waiting = true;
      const { taken, refused } = this.#tally;
      try {
        const reply = await give(number++);
        if (!current) return;
        const ok = reply.startsWith("Observed");
        this.#tell({ running: true, taken: taken + Number(ok), refused: refused + Number(!ok), last: reply });
      } catch (error) {
        if (current) this.stop(error instanceof Error ? error.message : String(error));
      } finally {
        waiting = false;
      }
    };
    const end = this.#clock.every(periodS * 1000, () => void one());
    this.#end = () => {
      current = false;
      end();
    };
    void one();
  }

  stop(why: string): void {
    if (!this.#end) return;
    this.#end();
    this.#end = undefined;
    this.#tell({ ...this.#tally, running: false, last: why || this.#tally.last });
  }

  #tell(tally: Tally): void {
    this.#tally = tally;
    this.#changed(tally);
  }
}
