/** Which fault was latched when. */
import type { Status } from "./model.ts";

/** A fault that was latched from then on; `none`: there was none. */
export interface FaultChange {
  readonly t: number;
  readonly fault: string;
  readonly place?: Status["place"];
}

/** The last change that is not later than t; the changes are in the order of their times. */
export function changeAt(changes: readonly FaultChange[], t: number): FaultChange | undefined {
  let below = -1;
  let above = changes.length;
  while (above - below > 1) {
    const middle = (below + above) >> 1;
    if ((changes[middle]?.t ?? 0) <= t) below = middle;
    else above = middle;
  }
  return changes[below];
}
