/**
 * A base that is connected: what it says becomes what the views see, and what the views order becomes lines to it. After each connecting, and whenever the base has
 * started anew, all is asked again; nothing that moves is ever sent by itself.
 */

import { Client } from "../protocol/client.ts";
import { haltOf } from "../protocol/command.ts";
import { unwrap } from "../protocol/line.ts";
import { isLikePath, streamOf } from "../protocol/telemetry.ts";
import { type Clock, every, clock as pageClock } from "../transport/clock.ts";
import type { Opened, Transport } from "../transport/transport.ts";
import { Base } from "./base.ts";
import { Conversation } from "./conversation.ts";
import { changeAt } from "./faults.ts";
import { Meter } from "./meter.ts";
import type { Alarm, Connection, Cursor, Model, Spoken, Topic } from "./model.ts";
import { type Line, orders, ownStream } from "./orders.ts";
import { Polls } from "./polls.ts";
import { Seat } from "./seat.ts";
import { Simulated } from "./simulated.ts";
import { type NextFrame, nextFrame, Topics } from "./topics.ts";
import { read, type Told } from "./worldline.ts";

export interface LiveOptions {
  readonly clock?: Clock;
  readonly frame?: NextFrame;
  /** Nobody sees the page: it gives no signs of life then. */
  readonly isHidden?: () => boolean;
  readonly firstTag?: number;
}

const TICK_MS = 50;
/** What was not answered is asked again after this. */
const GREET_AGAIN_MS = 500;
/** Who comes back after a loss may find the seat taken by himself, and gets it again within this. */
const SEAT_MS = 15_000;
/** How long an alarm stands that nothing else ends. */
const WARNING_MS = 5000;
/** A true pose that is older is no fix: the base refuses 1.5 s. */
const MAX_AGE_S = 1;
const GREETING = ["Version", "ListParams", "GetStatus"] as const;
/** What may be there already, when a page comes to a base that is under way. */
const KNOWN_LATER = ["GetEstPos", "GetPath", "GetMap", "GetGains"] as const;

export class LiveModel implements Model {
  readonly kind = "live";
  readonly commands = orders(this.#line());
  cursor: Cursor = { t: undefined };
  alarm: Alarm | undefined;
  readonly #transport: Transport;
  readonly #clock: Clock;
  readonly #isHidden: () => boolean;
  readonly #topics: Topics;
  readonly #base: Base;
  readonly #client: Client;
  readonly #polls: Polls;
  readonly #seat: Seat;
  readonly #simulated: Simulated;
  readonly #conversation = new Conversation();
  readonly #meter = new Meter();
  /** Tags of the page's own questions, whose answers are no more than chatter. */
  readonly #chatter = new Set<number | undefined>();
  /** Changes with each connection and each start of the base: what was begun before does not go on. */
  #generation = 0;
  #forgetting = () => {};
  #looksAtGains = false;
  /** When a reply was heard, and telemetry was missed. */
  #repliedAt = Number.NEGATIVE_INFINITY;
  #missedAt = Number.NEGATIVE_INFINITY;
  #warning = () => {};
  #ticking = () => {};

  constructor(transport: Transport, options: LiveOptions = {}) {
    this.#transport = transport;
    this.#clock = options.clock ?? pageClock;
    this.#isHidden = options.isHidden ?? (() => typeof document !== "undefined" && document.hidden);
    this.#topics = new Topics(options.frame ?? nextFrame(this.#clock));
    this.#seat = new Seat(transport);
    this.#simulated = new Simulated(this.#clock);
    this.#base = new Base({
      changed: (...topics) => this.#topics.publish(...topics),
      want: (line) => this.#want(line),
      anew: () => this.#anew(),
      streaming: (on) => transport.expectTraffic(on),
      now: () => this.#clock.now(),
    });
    this.#client = new Client({
      clock: this.#clock,
      send: (line) => transport.send(line),
      sent: (line, isPoll) => this.#sent(line, isPoll),
      alarm: (text) => this.#raise(text),
      firstTag: options.firstTag ?? Math.floor(Math.random() * 65_536),
    });
    this.#polls = this.#makePolls();
    transport.attach({
      connecting: () => this.#connecting(),
      opened: (opened) => this.#opened(opened),
      line: (text) => this.#heard(text),
      world: (message) => this.#world(message),
      lost: (why, retryAt) => this.#lost(why, retryAt),
    });
  }

  /** Connects, and stays connected until `close`. */
  open(): void {
    this.#ticking = every(this.#clock, TICK_MS, () => this.#tick());
    this.#transport.open();
  }

  close(): void {
    this.#generation += 1;
    this.#ticking();
    this.#warning();
    this.#forgetting();
    this.#client.close("the page has left the base");
    this.#simulated.lost();
    this.#transport.close();
    this.#seat.closed();
    this.#topics.publish("connection");
  }

  get connection(): Connection {
    return this.#seat.connection;
  }

  get version() {
    return this.#base.version;
  }

  get history() {
    return this.#base.recorder.history;
  }

  get estimates() {
    return this.#base.estimates;
  }

  get status() {
    return this.#base.status;
  }

  get parameters() {
    return this.#base.parameters.all;
  }

  get unsaved() {
    return this.#base.parameters.unsaved;
  }

  get path() {
    return this.#base.path;
  }

  get map() {
    return this.#base.map;
  }

  get gains() {
    return this.#base.gains;
  }

  get geometry() {
    return this.#base.geometry;
  }

  get world() {
    return this.#simulated.world;
  }

  get spoken(): readonly Spoken[] {
    return this.#conversation.lines;
  }

  get statistics() {
    return this.#meter.reading(this.#base.damaged + this.#transport.traffic.damaged, this.#client.unanswered);
  }

  get streaming() {
    return this.#base.streaming;
  }

  get telemetryAt() {
    return this.#base.telemetryAt;
  }

  get mayDrive() {
    return this.#seat.role === "drive";
  }

  /** The fault that was latched at a time of the past, or `none`; undefined if that is not known. */
  faultAt(t: number): string | undefined {
    return changeAt(this.#base.faults, t)?.fault;
  }

  setCursor(t: number | undefined): void {
    this.cursor = { t };
    this.#topics.publish("cursor");
  }

  subscribe(topics: readonly Topic[], listener: () => void): () => void {
    return this.#topics.subscribe(topics, listener);
  }

  // The connection.

  #connecting(): void {
    this.#seat.connecting();
    this.#cut("the connection was lost");
  }

  #opened({ role, another }: Opened): void {
    if (another) {
      this.#base.forget();
      this.#base.version = undefined;
      this.#simulated.forget();
    }
    this.#seat.opened(role);
    this.#base.reconnected();
    this.#note(
      role === "drive" ? `connected to ${this.#transport.to}` : `connected to ${this.#transport.to}: another page drives, this one watches`,
    );
    if (role === "drive") {
      this.#forgetting();
      this.#client.opened(!another);
      void this.#greet();
    } else {
      this.#forgetting();
      this.#forgetting = this.#clock.after(SEAT_MS, () => this.#forgetHalts());
    }
    this.#topics.publish("connection");
  }

  /** The seat was not to be had again: a Stop of before would now stop what another page does. */
  #forgetHalts(): void {
    if (this.mayDrive || !this.#client.isHalting) return;
    this.#client.close("another page drives");
    this.#warn("Stop was not answered, and now another page drives: it cannot be sent from here");
  }

  #lost(why: string, retryAt: number | undefined): void {
    if (this.#seat.connection.state !== "lost") this.#note(`connection lost: ${why}`);
    this.#seat.lost(why, retryAt);
    this.#cut(why);
  }

  #cut(why: string): void {
    this.#generation += 1;
    this.#client.lost(why);
    this.#simulated.lost();
    this.#base.reconnected();
    this.#topics.publish("connection", "history");
  }

  /** The base has started anew: it has forgotten the telemetry that it was asked for, and all that has no place in its flash. */
  #anew(): void {
    this.#generation += 1;
    this.#client.restarted();
    this.#base.forget();
    this.#transport.expectTraffic(false);
    this.#note("the base has started anew");
    if (this.mayDrive) void this.#greet();
  }

  /** Asks all there is to know, until it is answered. */
  async #greet(): Promise<void> {
    this.#generation += 1;
    const generation = this.#generation;
    const isCurrent = () => generation === this.#generation;
    this.#polls.reset();
    const ask = (line: string) => this.#client.ask(line, { poll: true });
    const steps = [...GREETING.map((line) => () => ask(line)), () => ownStream({ ask }), ...KNOWN_LATER.map((line) => () => ask(line))];
    for (const step of steps) {
      while (isCurrent()) {
        try {
          await step();
          break;
        } catch {
          await new Promise<void>((resolve) => this.#clock.after(GREET_AGAIN_MS, resolve));
        }
      }
    }
  }

  // What is heard.

  #sent(line: string, isPoll: boolean): void {
    this.#base.sent(line);
    this.#speak("sent", line, isPoll);
    const { tag } = unwrap(line);
    if (isPoll) this.#chatter.add(tag);
    else this.#chatter.delete(tag);
  }

  #heard(line: string): void {
    const kind = this.#base.heard(line);
    if (kind === "damaged") {
      this.#note(`damaged line left out: ${line}`, true);
      return;
    }
    if (kind === "row") this.#client.touch();
    if (kind === "reply") {
      const { tag } = unwrap(line);
      this.#repliedAt = this.#clock.elapsed();
      this.#speak("heard", line, this.#chatter.delete(tag));
      this.#client.heard(line);
    } else if (kind !== "telemetry" || !this.#base.streaming) {
      // The page's own telemetry is on the strips; somebody who asked for another wants to read it.
      this.#speak("heard", line, kind !== "event");
    }
  }

  #world(message: string): void {
    const told = read(message);
    if (!told) return;
    this.#told(told);
    this.#topics.publish("world");
  }

  #told(told: Told): void {
    switch (told.kind) {
      case "hello":
        this.#simulated.hello(told.hello);
        this.#base.vehicle = told.hello.vehicle;
        this.#seatIs(told.hello.seatFree);
        break;
      case "world":
        this.#simulated.moment(told.world);
        this.#base.recorder.moment(told.world);
        break;
      case "seat":
        this.#seatIs(told.free);
        break;
      case "done":
        this.#simulated.done(told.id);
        break;
      case "refused":
        this.#simulated.refused(told.id, told.why);
        break;
      case "sent":
        this.#overheard(told.line);
        break;
    }
  }

  #seatIs(free: boolean): void {
    this.#seat.free(free);
    this.#topics.publish("connection");
  }

  /** What the driver sends; the first thing is the `Stream` that is on. */
  #overheard(line: string): void {
    this.#base.sent(line);
    this.#speak("sent", line, false);
    const stream = streamOf(unwrap(line).body);
    if (stream && !this.#base.recorder.stream) this.#base.joined(stream);
  }

  // What is asked.

  #tick(): void {
    const now = this.#clock.elapsed();
    this.#meter.tick(now, this.#transport.traffic);
    // Who looks elsewhere gives no signs of life: the base's deadman is in charge then.
    if (this.mayDrive && !this.#isHidden()) this.#polls.tick(now);
    this.#missTelemetry(now);
  }

  /** A base that answers and has fallen silent otherwise was reset, and nobody has heard it say so. */
  #missTelemetry(now: number): void {
    const { stream } = this.#base.recorder;
    if (!this.mayDrive || !stream || stream.period <= 0 || this.telemetryAt === 0) return;
    const missed = this.#clock.now() - this.telemetryAt > 1000 * Math.max(1, 5 * stream.period);
    if (!missed || now - this.#repliedAt > 500 || now - this.#missedAt < 3000) return;
    this.#missedAt = now;
    this.#note("telemetry has stopped: it is asked for again");
    ownStream({ ask: (line) => this.#client.ask(line, { poll: true }) }).catch(() => {});
  }

  #makePolls(): Polls {
    const base = this.#base;
    const moves = () => base.status !== undefined && (base.status.moveState !== "HOLD" || base.status.turnState !== "HOLD");
    const polls = [
      { line: "GetEstPos", pace: () => 200 },
      { line: "GetStatus", pace: () => 250 },
      { line: "GetPath", pace: () => (base.path.mode !== "idle" && !this.#isLikePath() ? 1000 : undefined) },
      { line: "GetMap", pace: () => (base.map && moves() ? 10_000 : undefined) },
      { line: "GetGains", pace: () => (base.calibrating || this.#looksAtGains ? 1000 : undefined) },
      { line: "ListParams", pace: () => undefined },
    ];
    return new Polls(polls, (line) => this.#client.ask(line, { poll: true }));
  }

  #isLikePath(): boolean {
    const { stream } = this.#base.recorder;
    return stream !== undefined && isLikePath(stream);
  }

  #want(line: string): void {
    // Rows of a path could not be told from such telemetry.
    if (!this.mayDrive || (line === "GetPath" && this.#isLikePath())) return;
    if (this.#polls.want(line)) return;
    // Not answered: the list of the parameters tells it later.
    this.#client.ask(line, { poll: true }).catch(() => this.#polls.want("ListParams"));
  }

  #line(): Line {
    const model = this;
    return {
      ask: (line, since = this.#client.halts) => model.#ask(line, since),
      get halts() {
        return model.#client.halts;
      },
      halt: (what) => model.#halt(what),
      note: (text) => model.#note(text),
      takeSeat: () => model.#transport.takeSeat?.(),
      world: (request) => {
        const send = model.#transport.sendWorld?.bind(model.#transport);
        if (!send) return Promise.reject(new Error("this base is no simulated one"));
        return model.#simulated.ask(request, send);
      },
      watchGains: (on) => {
        model.#looksAtGains = on;
        if (on) model.#want("GetGains");
      },
      truth: () => model.#truth(),
    };
  }

  #ask(line: string, since: number): Promise<string> {
    const blocked = this.#blocked();
    const halt = haltOf(line);
    if (halt) this.#topics.publish("events");
    if (blocked === undefined) return this.#client.ask(line, { since });
    // A Stop is one however it is asked for: it is sent as soon as it can be.
    if (halt) this.#halt(halt);
    return Promise.reject(new Error(blocked));
  }

  #blocked(): string | undefined {
    const { role } = this.#seat;
    if (role === "drive") return undefined;
    return role === "watch" ? "not sent: this page only watches" : "not sent: there is no connection to the base";
  }

  #halt(what: "Stop" | "EStop"): void {
    if (this.#seat.role === "watch") {
      this.#warn(`${what} was not sent: this page only watches, another one drives`);
      return;
    }
    this.#topics.publish("events");
    this.#client.halt(what).catch((error: Error) => this.#note(error.message));
  }

  #truth(): { x: number; y: number; theta: number; age: number } | undefined {
    const { world, age } = this.#simulated;
    const silent = this.#clock.now() - this.telemetryAt;
    if (!world || age === undefined || age > MAX_AGE_S || silent > 1000 * MAX_AGE_S) return undefined;
    return { ...world.pose, age };
  }

  // What is told.

  #speak(direction: Spoken["direction"], text: string, isChatter: boolean): void {
    this.#conversation.add({ at: this.#clock.now(), direction, text }, isChatter);
    this.#topics.publish("spoken");
  }

  #note(text: string, isChatter = false): void {
    this.#speak("note", text, isChatter);
  }

  #raise(text: string | undefined): void {
    this.#warning();
    this.alarm = text === undefined ? undefined : { text };
    this.#topics.publish("alarm");
  }

  /** An alarm about something that nothing will change. */
  #warn(text: string): void {
    this.#raise(text);
    this.#note(text);
    this.#warning = this.#clock.after(WARNING_MS, () => this.#raise(undefined));
  }
}
