/** A transport whose far end is a function of the test. */
import { notALine } from "../../src/transport/lines.ts";
import type { Listener, Role, Traffic, Transport } from "../../src/transport/transport.ts";

export class FakeTransport implements Transport {
  readonly to = "fake";
  readonly traffic: Traffic = { heardBytes: 0, sentBytes: 0, damaged: 0 };
  readonly sent: string[] = [];
  readonly requests: string[] = [];
  seatsAsked = 0;
  expects = false;
  isOpen = false;
  /** The base: what it answers to a line. */
  base: (line: string) => readonly string[] = () => [];
  #listener: Listener | undefined;

  attach(listener: Listener): void {
    this.#listener = listener;
  }

  open(): void {
    this.#listener?.connecting();
  }

  close(): void {
    this.isOpen = false;
  }

  takeSeat(): void {
    this.seatsAsked += 1;
  }

  expectTraffic(on: boolean): void {
    this.expects = on;
  }

  send(line: string): void {
    const why = notALine(line);
    if (why) throw new Error(why);
    if (!this.isOpen) throw new Error("not open");
    this.sent.push(line);
    const replies = this.base(line);
    // No reply comes before its command has left.
    queueMicrotask(() => {
      for (const reply of replies) this.hear(reply);
    });
  }

  sendWorld(message: string): void {
    this.requests.push(message);
  }

  // What the test does.

  comes(role: Role = "drive", another = false): void {
    this.isOpen = true;
    this.#listener?.opened({ role, another });
  }

  goes(why = "cut"): void {
    this.isOpen = false;
    this.#listener?.lost(why, undefined);
  }

  hear(line: string): void {
    if (this.isOpen) this.#listener?.line(line);
  }

  world(message: unknown): void {
    this.#listener?.world(JSON.stringify(message));
  }
}
