/** How the line is doing: bytes a second, over the last second or so. */
import type { Traffic } from "../transport/transport.ts";
import type { LineStatistics } from "./model.ts";

const SPAN_MS = 1000;

export class Meter {
  #at = 0;
  #heard = 0;
  #sent = 0;
  #rates = { heardBytesPerSecond: 0, sentBytesPerSecond: 0 };

  tick(now: number, traffic: Traffic): void {
    const ms = now - this.#at;
    if (ms < SPAN_MS) return;
    this.#rates = {
      heardBytesPerSecond: ((traffic.heardBytes - this.#heard) / ms) * 1000,
      sentBytesPerSecond: ((traffic.sentBytes - this.#sent) / ms) * 1000,
    };
    this.#at = now;
    this.#heard = traffic.heardBytes;
    this.#sent = traffic.sentBytes;
  }

  reading(damagedLines: number, unanswered: number): LineStatistics {
    return { ...this.#rates, damagedLines, unanswered };
  }
}
