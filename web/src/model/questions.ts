/** What the page asks of a base by itself: all there is to know when it comes to one, and from there on what changes. Nothing here moves anything. */
import type { Client } from "../protocol/client.ts";
import { isLikePath } from "../protocol/telemetry.ts";
import type { Clock } from "../transport/clock.ts";
import type { Base } from "./base.ts";
import { ownStream } from "./orders.ts";
import { Polls } from "./polls.ts";

const GREETING = ["Version", "ListParams", "GetStatus"] as const;
/** What may be there already, when a page comes to a base that is under way. */
const KNOWN_LATER = ["GetEstPos", "GetPath", "GetMap", "GetGains"] as const;
/** What was not answered is asked again after this. */
const AGAIN_MS = 500;
/** Telemetry is missed when it has been silent for this, or for five periods, while the base has answered just now; and asked for again at most so often. */
const SILENT_MS = 1000;
const JUST_NOW_MS = 500;
const MISSED_AGAIN_MS = 3000;

export interface Asked {
  readonly client: Client;
  readonly base: Base;
  readonly clock: Clock;
  /** The base may be asked: this page drives it. */
  readonly mayAsk: () => boolean;
  /** Nobody sees the page. */
  readonly isHidden: () => boolean;
  readonly note: (text: string) => void;
}

export class Questions {
  readonly #of: Asked;
  readonly #polls: Polls;
  /** Changes with each beginning: what was begun before does not go on. */
  #generation = 0;
  #looksAtGains = false;
  #repliedAt = Number.NEGATIVE_INFINITY;
  #missedAt = Number.NEGATIVE_INFINITY;

  constructor(of: Asked) {
    const { base } = of;
    const moves = () => base.status !== undefined && (base.status.moveState !== "HOLD" || base.status.turnState !== "HOLD");
    this.#of = of;
    this.#polls = new Polls(
      [
        { line: "GetEstPos", pace: () => 200 },
        { line: "GetStatus", pace: () => 250 },
        { line: "GetPath", pace: () => (base.path.mode !== "idle" && !this.#isLikePath() ? 1000 : undefined) },
        { line: "GetMap", pace: () => (base.map && moves() ? 10_000 : undefined) },
        { line: "GetGains", pace: () => (base.calibrating || this.#looksAtGains ? 1000 : undefined) },
        { line: "ListParams", pace: () => undefined },
      ],
      this.#ask,
    );
  }

  /** Asks all there is to know, until it is answered. */
  async begin(): Promise<void> {
    this.end();
    const generation = this.#generation;
    const isCurrent = () => generation === this.#generation;
    this.#polls.reset();
    const ask = (line: string) => () => this.#ask(line);
    for (const step of [...GREETING.map(ask), () => ownStream({ ask: this.#ask }), ...KNOWN_LATER.map(ask)]) {
      while (isCurrent()) {
        try {
          await step();
          break;
        } catch {
          await new Promise<void>((resolve) => this.#of.clock.after(AGAIN_MS, resolve));
        }
      }
    }
  }

  /** What was begun does not go on. */
  end(): void {
    this.#generation += 1;
  }

  /** This should be asked when there is a chance. */
  want(line: string): void {
    // Rows of a path could not be told from such telemetry.
    if (!this.#of.mayAsk() || (line === "GetPath" && this.#isLikePath())) return;
    if (this.#polls.want(line)) return;
    // Not answered: the list of the parameters tells it later.
    this.#ask(line).catch(() => this.#polls.want("ListParams"));
  }

  watchGains(on: boolean): void {
    this.#looksAtGains = on;
    if (on) this.want("GetGains");
  }

  /** The base has answered something. */
  replied(): void {
    this.#repliedAt = this.#of.clock.elapsed();
  }

  tick(): void {
    if (!this.#of.mayAsk()) return;
    const now = this.#of.clock.elapsed();
    // Who looks elsewhere gives no signs of life: the base's deadman is in charge then.
    if (!this.#of.isHidden()) this.#polls.tick(now);
    this.#missTelemetry(now);
  }

  readonly #ask = (line: string): Promise<string> => this.#of.client.ask(line, { poll: true });

  /** A base that answers and has fallen silent otherwise was reset, and nobody has heard it say so. */
  #missTelemetry(now: number): void {
    const { base, clock, note } = this.#of;
    const { stream } = base.recorder;
    if (!stream || stream.period <= 0 || base.rowAt === undefined) return;
    const isSilent = clock.elapsed() - base.rowAt > Math.max(SILENT_MS, 5000 * stream.period);
    if (!isSilent || now - this.#repliedAt > JUST_NOW_MS || now - this.#missedAt < MISSED_AGAIN_MS) return;
    this.#missedAt = now;
    note("telemetry has stopped: it is asked for again");
    // It is missed again, if that was not answered.
    ownStream({ ask: this.#ask }).catch(() => {});
  }

  #isLikePath(): boolean {
    const { stream } = this.#of.base.recorder;
    return stream !== undefined && isLikePath(stream);
  }
}
