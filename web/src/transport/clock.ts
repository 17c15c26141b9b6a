/** Time as the page has it. Everything that waits takes one of these, so that tests need not. */

export interface Clock {
  /** Milliseconds since 1970, for what is shown: it leaps when somebody sets the clock. */
  now(): number;
  /** Milliseconds since anything, for durations: it never leaps back. */
  elapsed(): number;
  /** Calls back once; the returned function forgets it. */
  after(ms: number, run: () => void): () => void;
}

export const clock: Clock = {
  now: () => Date.now(),
  elapsed: () => performance.now(),
  after: (ms, run) => {
    const timer = setTimeout(run, ms);
    return () => clearTimeout(timer);
  },
};

/** Calls back at a pace until the returned function is called. */
export function every(at: Clock, ms: number, run: () => void): () => void {
  let cancel = () => {};
  const again = () => {
    cancel = at.after(ms, () => {
      again();
      run();
    });
  };
  again();
  return () => cancel();
}
