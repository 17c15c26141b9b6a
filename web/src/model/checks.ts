/** Whether the base sends all its lines with checks (`require_crc`): a line without one is a damaged one then, which has lost its end. */
import type { Opened } from "../protocol/line.ts";

/** So many rows of telemetry without a check, and none with one between them, are a base that sends none: noise does not hit each. */
const BARE_ROWS = 20;

export class Checks {
  #required = false;
  #bare = 0;

  /** The parameter was told. */
  told(required: boolean): void {
    this.#required = required;
    this.#bare = 0;
  }

  /** The parameter may have another value now: what has no check is believed until it is told. */
  unknown(): void {
    this.told(false);
  }

  /** The line can be believed. `isRow`: it is one that comes unasked all the time. */
  pass(check: Opened["check"], isRow: boolean): boolean {
    if (check === "bad") return false;
    if (!this.#required) return true;
    if (check === "good") {
      if (isRow) this.#bare = 0;
      return true;
    }
    if (isRow) this.#bare += 1;
    if (this.#bare < BARE_ROWS) return false;
    this.unknown();
    return true;
  }
}
