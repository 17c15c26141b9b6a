/**
 * The client's half of the serial protocol: which line is sent when, and which reply is whose.
 *
 * * Every line has a tag and a check. At most three wait for their replies: the base takes four, and the fourth place is for a Stop.
 * * Stop and EStop go at once, past all that waits here. What was asked for before and is not sent yet never is. A Stop that is not answered is sent again each half
 *   second, for as long as it takes, also when a lost connection is back.
 * * Replies come in the order of their commands. One for a later command says that the earlier one's was lost on the way.
 * * Nothing else outlives a lost connection.
 */
import type { Clock } from "../transport/clock.ts";
import { MAX_LINE } from "../transport/lines.ts";
import { type Halt, haltOf, patience } from "./command.ts";
import { unwrap, wrap } from "./line.ts";

/** A command was given up since a Stop was asked for after it. */
export class Overtaken extends Error {
  constructor(body: string, by: Halt) {
    super(`“${body}” was not sent: overtaken by ${by}`);
    this.name = "Overtaken";
  }
}

/** A command got no reply: whether the base has obeyed is not known. */
export class Unanswered extends Error {
  constructor(body: string) {
    super(`“${body}” was not answered`);
    this.name = "Unanswered";
  }
}

export interface Surroundings {
  readonly clock: Clock;
  /** Puts a line on the way; throws if that cannot be. */
  readonly send: (line: string) => void;
  /** A line has gone out. */
  readonly sent: (line: string, isPoll: boolean) => void;
  /** A Stop waits too long for its answer (or no longer does). */
  readonly alarm: (text: string | undefined) => void;
  /** The tags begin with this one: another page's late replies are not ours. */
  readonly firstTag: number;
}

export interface Asking {
  /** The page's own question: it goes after what the user asks. */
  readonly poll?: boolean;
  /** The count of Stops when this was decided: a Stop since then overtakes it. */
  readonly since?: number;
}

interface Waiting {
  readonly body: string;
  readonly poll: boolean;
  readonly resolve: (reply: string) => void;
  readonly reject: (error: Error) => void;
}

interface Sent extends Waiting {
  readonly tag: number;
  readonly order: number;
}

/** A Stop or EStop that has not been answered yet. */
interface Halting {
  readonly what: Halt;
  readonly tags: Map<number, number>;
  /** However often it was asked for, this is its answer. */
  readonly answer: Promise<string>;
  readonly resolve: (reply: string) => void;
  readonly reject: (error: Error) => void;
  cancel: () => void;
  isLate: boolean;
  refusals: number;
}

const MAX_UNANSWERED = 3;
const MAX_WAITING = 64;
const HALT_MS = 1000;
const AGAIN_MS = 500;
/** A Stop that was refused (noise has hit it) is sent again after this. */
const REFUSED_MS = 50;
/** So many without a reply, one after the other, are more than noise on the line. */
const MANY_MISSED = 3;
/** Tags of a Stop that are remembered: the last so many. */
const HALT_TAGS = 16;

export class Client {
  readonly #around: Surroundings;
  #tag: number;
  #order = 0;
  #isOpen = false;
  #waiting: Waiting[] = [];
  #polls: Waiting[] = [];
  #sent: Sent[] = [];
  #halts = new Map<Halt, Halting>();
  #deadline = () => {};
  /** Stops and EStops asked for so far. */
  halts = 0;
  /** Commands that got no reply. */
  unanswered = 0;
  #missedInARow = 0;

  constructor(around: Surroundings) {
    this.#around = around;
    this.#tag = around.firstTag & 0xffff;
  }

  /** Several commands in a row got no reply, and none has got one since. */
  get isUnresponsive(): boolean {
    return this.#missedInARow >= MANY_MISSED;
  }

  /** A Stop or an EStop waits for its answer. */
  get isHalting(): boolean {
    return this.#halts.size > 0;
  }

  /** Resolved with the base's reply, be it OK, data or ERR; rejected if there is none. */
  ask(body: string, asking: Asking = {}): Promise<string> {
    const halt = haltOf(body);
    if (halt) return this.halt(halt);
    const { poll = false, since = this.halts } = asking;
    if (!this.#isOpen) return Promise.reject(new Error("not sent: there is no connection to the base"));
    if (since !== this.halts) return Promise.reject(new Overtaken(body, "Stop"));
    if (wrap(65_535, body).length > MAX_LINE) return Promise.reject(new Error(`not sent: the line is too long, with its tag and check`));
    const queue = poll ? this.#polls : this.#waiting;
    if (queue.length >= MAX_WAITING) return Promise.reject(new Error("not sent: too many commands wait"));
    return new Promise((resolve, reject) => {
      queue.push({ body, poll, resolve, reject });
      this.#pump();
    });
  }

  /** Sends it before anything else, now. Resolved when the base has answered OK, however long that takes. */
  halt(what: Halt): Promise<string> {
    this.halts += 1;
    for (const waiting of [...this.#waiting.splice(0), ...this.#polls.splice(0)]) waiting.reject(new Overtaken(waiting.body, what));
    const halting = this.#halts.get(what) ?? begin(what);
    this.#halts.set(what, halting);
    halting.cancel();
    this.#sendHalt(halting, HALT_MS);
    return halting.answer;
  }

  /** The line is open. A Stop that was not answered is sent first, also to what may be another base: it harms none, and one that is forgotten may. */
  opened(): void {
    this.#isOpen = true;
    const urgent = [this.#halts.get("EStop"), this.#halts.get("Stop")];
    for (const halting of urgent) {
      if (!halting) continue;
      halting.cancel();
      this.#sendHalt(halting, HALT_MS);
    }
    this.#missedInARow = 0;
    this.#realarm();
  }

  /** The line is lost: nothing that waits is sent any more, but a Stop. */
  lost(why: string): void {
    this.#isOpen = false;
    this.#deadline();
    const all = [...this.#sent.splice(0), ...this.#waiting.splice(0), ...this.#polls.splice(0)];
    for (const one of all) one.reject(new Error(`“${one.body}”: ${why}`));
    for (const halting of this.#halts.values()) halting.tags.clear();
    this.#realarm();
  }

  /** The base has started anew: it knows nothing of what waited for its reply, and what waits here was meant for before. */
  restarted(): void {
    const all = [...this.#sent.splice(0), ...this.#waiting.splice(0), ...this.#polls.splice(0)];
    this.#deadline();
    for (const one of all) one.reject(new Error(`“${one.body}”: the base has started anew`));
  }

  /** For good: nobody drives this base from here any more. */
  close(why: string): void {
    this.lost(why);
    this.#forgetHalts(why);
  }

  /** Something came that belongs to the reply before: the base is at it. */
  touch(): void {
    if (this.#sent.length > 0) this.#await();
  }

  /** A reply came; true if it is the answer to a command of this client's. */
  heard(line: string): boolean {
    const { tag, body } = unwrap(line);
    if (tag === undefined) return false;
    for (const halting of this.#halts.values()) {
      const order = halting.tags.get(tag);
      if (order === undefined) continue;
      this.#missed(order);
      this.#missedInARow = 0;
      if (body === "OK") this.#halted(halting);
      else this.#refused(halting, tag);
      return true;
    }
    const at = this.#sent.findIndex((sent) => sent.tag === tag);
    const sent = this.#sent[at];
    if (!sent) return false;
    this.#missed(sent.order);
    this.#missedInARow = 0;
    this.#sent.splice(this.#sent.indexOf(sent), 1);
    sent.resolve(body);
    this.#await();
    this.#pump();
    return true;
  }

  #pump(): void {
    while (this.#isOpen && this.#sent.length < MAX_UNANSWERED) {
      const next = this.#waiting.shift() ?? this.#polls.shift();
      if (!next) return;
      const tag = this.#nextTag();
      if (!this.#put(wrap(tag, next.body), next.poll, next.reject)) continue;
      this.#order += 1;
      this.#sent.push({ ...next, tag, order: this.#order });
      if (this.#sent.length === 1) this.#await();
    }
  }

  #put(line: string, poll: boolean, failed: (error: Error) => void): boolean {
    try {
      this.#around.send(line);
    } catch (error) {
      failed(error instanceof Error ? error : new Error(String(error)));
      return false;
    }
    this.#around.sent(line, poll);
    return true;
  }

  /** What was sent before the one that is answered now, and is not answered: its reply was lost on the way. */
  #missed(order: number): void {
    const missed = this.#sent.filter((sent) => sent.order < order);
    this.#sent = this.#sent.filter((sent) => sent.order >= order);
    for (const sent of missed) this.#giveUp(sent);
    if (missed.length > 0) {
      this.#await();
      this.#pump();
    }
  }

  #giveUp(sent: Sent): void {
    this.unanswered += 1;
    this.#missedInARow += 1;
    sent.reject(new Unanswered(sent.body));
  }

  /** The first of those that wait has its time from now on. */
  #await(): void {
    this.#deadline();
    const [first] = this.#sent;
    if (!first) return;
    this.#deadline = this.#around.clock.after(patience(first.body), () => {
      this.#sent = this.#sent.filter((sent) => sent !== first);
      this.#giveUp(first);
      this.#await();
      this.#pump();
    });
  }

  #sendHalt(halting: Halting, wait: number): void {
    if (this.#isOpen) {
      const tag = this.#nextTag();
      const gone = this.#put(wrap(tag, halting.what), false, () => {});
      if (gone) {
        this.#order += 1;
        halting.tags.set(tag, this.#order);
        const [oldest] = halting.tags.keys();
        if (halting.tags.size > HALT_TAGS && oldest !== undefined) halting.tags.delete(oldest);
      }
    }
    if (!this.#isOpen) this.#late(halting);
    // What is sent may be answered while it is sent.
    if (this.#halts.get(halting.what) !== halting) return;
    halting.cancel = this.#around.clock.after(wait, () => {
      this.#late(halting);
      this.#sendHalt(halting, AGAIN_MS);
    });
  }

  #refused(halting: Halting, tag: number): void {
    halting.tags.delete(tag);
    halting.refusals += 1;
    if (halting.refusals > 1) this.#late(halting);
    halting.cancel();
    halting.cancel = this.#around.clock.after(REFUSED_MS, () => this.#sendHalt(halting, AGAIN_MS));
  }

  #late(halting: Halting): void {
    halting.isLate = true;
    this.#alarm();
  }

  #halted(halting: Halting): void {
    halting.cancel();
    this.#halts.delete(halting.what);
    halting.resolve("OK");
    this.#alarm();
  }

  #forgetHalts(why: string): void {
    for (const halting of this.#halts.values()) {
      halting.cancel();
      halting.reject(new Error(`“${halting.what}”: ${why}`));
    }
    this.#halts.clear();
    this.#alarm();
  }

  /** What the alarm says of the connection is no longer so. */
  #realarm(): void {
    if ([...this.#halts.values()].some((halting) => halting.isLate)) this.#alarm();
  }

  #alarm(): void {
    const late = [...this.#halts.values()].filter((halting) => halting.isLate).map((halting) => halting.what);
    if (late.length === 0) this.#around.alarm(undefined);
    else this.#around.alarm(`${late.join(" and ")} is not answered${this.#isOpen ? "" : ": there is no connection to the base"}`);
  }

  #nextTag(): number {
    const tag = this.#tag;
    this.#tag = (tag + 1) & 0xffff;
    return tag;
  }
}

function begin(what: Halt): Halting {
  let [resolve, reject]: [Halting["resolve"], Halting["reject"]] = [() => {}, () => {}];
  const answer = new Promise<string>((yes, no) => {
    [resolve, reject] = [yes, no];
  });
  return { what, tags: new Map(), answer, resolve, reject, cancel: () => {}, isLate: false, refusals: 0 };
}
