/**
 * The base's own clock, as the page can tell it from the simulated world's messages. Each says what it was when the message left, and comes a little later, now
 * more and now less, but never earlier: of the last few, the one that came quickest tells it best.
 */

/** Messages that are older say less: the simulation may have fallen behind since. */
const WINDOW_S = 0.5;

export class BaseClock {
  #heard: { readonly t: number; readonly at: number }[] = [];

  /** A message of the base's time t came at a time of the page, s. */
  heard(t: number, at: number): void {
    // The base has started anew.
    if (t < (this.#heard.at(-1)?.t ?? t)) this.#heard = [];
    this.#heard.push({ t, at });
    while ((this.#heard[0]?.at ?? at) < at - WINDOW_S) this.#heard.shift();
  }

  /** The base's time at a time of the page; undefined if nothing was heard. `speed`: simulated seconds a second. */
  now(at: number, speed: number): number | undefined {
    if (this.#heard.length === 0) return undefined;
    return Math.max(...this.#heard.map((one) => one.t + (at - one.at) * speed));
  }

  forget(): void {
    this.#heard = [];
  }
}
