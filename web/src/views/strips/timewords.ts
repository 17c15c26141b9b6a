/** The time bar's arithmetic and words. */

export function spanWords(seconds: number): string {
  if (!Number.isFinite(seconds)) return "all";
  return seconds < 60 ? `${seconds} s` : `${seconds / 60} min`;
}

/** The time that is shown; and how long ago that was, if it is the past. */
export function clockWords(t: number, newest: number | undefined): string {
  const ago = newest === undefined ? 0 : newest - t;
  return newest === undefined || ago < 0.005 ? `${t.toFixed(2)} s` : `${t.toFixed(2)} s (−${ago.toFixed(ago < 10 ? 2 : 0)} s)`;
}

/** Where playing leads within a moment; it ends at what is newest. */
export function advance(t: number, by: number, newest: number): { readonly t: number; readonly ended: boolean } {
  // A page that was hidden plays on from where it was, and does not leap.
  const next = t + Math.max(0, Math.min(by, 1));
  return next >= newest ? { t: newest, ended: true } : { t: next, ended: false };
}
