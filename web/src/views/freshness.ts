/** How old what is shown is. Instants are milliseconds of the clock that never leaps (`performance.now()`). */

/** What is older is not what is, s. */
export const STALE = 0.5;

/** Seconds since something was heard; undefined if it never was. */
export function secondsSince(at: number | undefined, now: number = performance.now()): number | undefined {
  return at === undefined ? undefined : Math.max(0, now - at) / 1000;
}
