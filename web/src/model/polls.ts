/** The questions that the page asks of itself, each at its pace. None is asked while one of its kind is unanswered. */

export interface Poll {
  readonly line: string;
  /** Milliseconds between two of them; undefined: not now. */
  readonly pace: () => number | undefined;
}

interface Turn {
  readonly poll: Poll;
  lastAt: number;
  isAsked: boolean;
  isWanted: boolean;
}

export class Polls {
  readonly #ask: (line: string) => Promise<unknown>;
  #turns: Turn[];

  constructor(polls: readonly Poll[], ask: (line: string) => Promise<unknown>) {
    this.#ask = ask;
    this.#turns = polls.map((poll) => ({ poll, lastAt: Number.NEGATIVE_INFINITY, isAsked: false, isWanted: false }));
  }

  /** To be asked next time, whatever its pace; false if it is none of these. */
  want(line: string): boolean {
    const turn = this.#turns.find(({ poll }) => poll.line === line);
    if (turn) turn.isWanted = true;
    return turn !== undefined;
  }

  /** Another connection: what was asked on the one before is nobody's. */
  reset(): void {
    this.#turns = this.#turns.map(({ poll }) => ({ poll, lastAt: Number.NEGATIVE_INFINITY, isAsked: false, isWanted: false }));
  }

  /** Asks what is due. */
  tick(now: number): void {
    for (const turn of this.#turns) {
      const pace = turn.poll.pace();
      const isDue = turn.isWanted || (pace !== undefined && now - turn.lastAt >= pace);
      if (turn.isAsked || !isDue) continue;
      turn.isAsked = true;
      turn.isWanted = false;
      // In step with the clock, so that a tick that comes late does not make it slower.
      turn.lastAt = pace !== undefined && now - turn.lastAt < 2 * pace ? turn.lastAt + pace : now;
      const done = () => {
        turn.isAsked = false;
      };
      // What is not answered is asked again in its turn.
      this.#ask(turn.poll.line).then(done, done);
    }
  }
}
