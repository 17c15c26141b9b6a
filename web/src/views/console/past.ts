/** What was sent before, for the arrows. */

const KEPT = 200;

export class Past {
  #lines: string[];
  #at: number;
  /** What was being typed when the past was entered. */
  #draft = "";

  /** From what was kept: one line each. */
  constructor(kept: string | undefined) {
    this.#lines = (kept ?? "").split("\n").filter((line) => line !== "");
    this.#at = this.#lines.length;
  }

  add(line: string): void {
    if (line !== this.#lines.at(-1)) this.#lines.push(line);
    if (this.#lines.length > KEPT) this.#lines.shift();
    this.#at = this.#lines.length;
  }

  /** The line before (or, by 1, after) the one that is shown; undefined at the ends. */
  step(by: -1 | 1, shown: string): string | undefined {
    const to = this.#at + by;
    if (to < 0 || to > this.#lines.length) return undefined;
    if (this.#at === this.#lines.length) this.#draft = shown;
    this.#at = to;
    return to === this.#lines.length ? this.#draft : this.#lines[to];
  }

  toString(): string {
    return this.#lines.join("\n");
  }
}
