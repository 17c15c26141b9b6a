/** What stretch of time is looked at: its length, which the time bar and the strips share, and where it lies. */

/** Lengths that are offered, s; Infinity: all there is. */
export const SPANS: readonly number[] = [5, 10, 30, 60, 120, 300, 600, 1200, Number.POSITIVE_INFINITY];
export const FIRST_SPAN = 30;

export interface Span {
  readonly seconds: number;
  /** The stretch that the strips show, once they have shown one. */
  shown: Stretch | undefined;
  set(seconds: number): void;
  /** Calls back when it has changed; the returned function ends that. */
  watch(changed: () => void): () => void;
}

function makeSpan(): Span {
  let seconds = FIRST_SPAN;
  const listeners = new Set<() => void>();
  return {
    get seconds() {
      return seconds;
    },
    shown: undefined,
    set: (next) => {
      if (next === seconds) return;
      seconds = next;
      for (const changed of listeners) changed();
    },
    watch: (changed) => {
      listeners.add(changed);
      return () => listeners.delete(changed);
    },
  };
}

/** There is one desk on a page, and one length of time that it shows. */
export const span: Span = makeSpan();

/** The next length up or down. */
export function neighbour(seconds: number, longer: boolean): number {
  return longer ? (SPANS.find((each) => each > seconds) ?? seconds) : (SPANS.findLast((each) => each < seconds) ?? seconds);
}

export interface Stretch {
  readonly from: number;
  readonly to: number;
}

/** How near to the edges the cursor comes before the stretch moves, as a share of it. */
const EDGE = 0.1;

/**
 * The stretch to show of what is there, from `oldest` to `newest`. Without a cursor it ends now. With one it stays where it was, as long as the cursor is
 * well within: a view that is paused stands still.
 */
export function stretch(seconds: number, oldest: number, newest: number, cursor: number | undefined, before: Stretch | undefined): Stretch {
  if (!(newest >= oldest)) return { from: 0, to: Number.isFinite(seconds) ? seconds : FIRST_SPAN };
  if (!Number.isFinite(seconds)) return { from: oldest, to: Math.max(newest, oldest + 1) };
  // As long as there is less than that, it fills from the left.
  if (newest - oldest <= seconds) return { from: oldest, to: oldest + seconds };
  if (cursor === undefined) return { from: newest - seconds, to: newest };
  const same = before && Math.abs(before.to - before.from - seconds) < 1e-6;
  const to = same ? before.to : Math.min(newest, cursor + seconds / 4);
  const margin = seconds * EDGE;
  let end = to;
  if (cursor > to - margin) end = Math.max(Math.min(newest, cursor + margin), Math.min(to, newest), cursor);
  else if (cursor < to - seconds + margin) end = cursor + seconds - margin;
  return { from: end - seconds, to: end };
}
