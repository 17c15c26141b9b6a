/** What a browser keeps for the page. A page from a file, or a private window, may have no storage: then nothing is kept, and nothing else changes. */

export function recall(storage: "localStorage" | "sessionStorage", key: string): string | undefined {
  try {
    return globalThis[storage].getItem(`vehicle-controller ${key}`) ?? undefined;
  } catch {
    return undefined;
  }
}

export function keep(storage: "localStorage" | "sessionStorage", key: string, value: string): void {
  try {
    globalThis[storage].setItem(`vehicle-controller ${key}`, value);
  } catch {
    // As said above: not kept.
  }
}
