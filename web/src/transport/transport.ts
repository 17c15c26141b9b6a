/** A way to a base, line by line: a simulator's WebSocket or a serial port. It comes back by itself after a loss, and says nothing of its own that moves. */

/** Who drives gives orders; who watches hears all and says nothing. */
export type Role = "drive" | "watch";

export interface Opened {
  readonly role: Role;
  /** It may be another base than before: nothing of the old one holds. */
  readonly another: boolean;
}

/** What becomes of a transport. One listener has it. */
export interface Listener {
  connecting(): void;
  opened(opened: Opened): void;
  /** A line that the base sent, without its end; printable ASCII and tabs, at most 255 of them. */
  line(text: string): void;
  /** The simulated world, where there is one: JSON. */
  world(message: string): void;
  /** It is lost, or did not come about. `retryAt`: when it tries again by itself, by the page's clock; undefined if it waits for something else. */
  lost(why: string, retryAt: number | undefined): void;
}

/** What has gone through so far. */
export interface Traffic {
  heardBytes: number;
  sentBytes: number;
  /** Lines that were left out since they cannot be of a base. */
  damaged: number;
}

export interface Transport {
  /** What it leads to, for the user. */
  readonly to: string;
  readonly traffic: Traffic;
  attach(listener: Listener): void;
  /** Connects, and again after each loss until `close`. */
  open(): void;
  close(): void;
  /** Sends one line. Throws what the user should know: it is none, or nobody would hear it. */
  send(line: string): void;
  /** Telemetry is on (or off): while it is, 3 s of silence are a loss. */
  expectTraffic(on: boolean): void;
  /** A request to the simulated world: JSON. */
  sendWorld?(message: string): void;
  /** Who watches connects as the driver; if the seat is taken, it stays a watcher. */
  takeSeat?(): void;
}

/** So long may a line be silent that telemetry is expected on, ms. */
export const SILENCE_MS = 3000;

/** Waits longer after each failure: 0.5, 1, 2, 4, 5 s and so on. */
export class Backoff {
  #next = FIRST_MS;

  /** Milliseconds to wait now. */
  next(): number {
    const wait = this.#next;
    this.#next = Math.min(2 * wait, LONGEST_MS);
    return wait;
  }

  reset(): void {
    this.#next = FIRST_MS;
  }
}

const FIRST_MS = 500;
const LONGEST_MS = 5000;
