/** What was said, bounded: what the page asks by itself, many times a second, does not push out what people said. */
import type { Spoken } from "./model.ts";

/** Lines kept, at most. */
export const KEPT = 2000;
/** Of these, so much chatter: polls, their answers, telemetry. When there is twice as much, half is left out. */
const CHATTER = 400;

export class Conversation {
  readonly lines: Spoken[] = [];
  #chatter = new Set<Spoken>();

  add(line: Spoken, isChatter: boolean): void {
    this.lines.push(line);
    if (isChatter) this.#chatter.add(line);
    if (this.#chatter.size > 2 * CHATTER) this.#thin();
    if (this.lines.length > KEPT) this.#drop();
  }

  #thin(): void {
    const old = new Set([...this.#chatter].slice(0, this.#chatter.size - CHATTER));
    for (const line of old) this.#chatter.delete(line);
    const kept = this.lines.filter((line) => !old.has(line));
    this.lines.splice(0, this.lines.length, ...kept);
  }

  /** Several at once: it is not done for every line. */
  #drop(): void {
    for (const line of this.lines.splice(0, KEPT / 10)) this.#chatter.delete(line);
  }
}
