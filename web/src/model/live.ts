/**
 * A base that is connected: what it says becomes what the views see, and what the views order becomes lines to it. After each connecting, and whenever the base has
 * started anew, all is asked again; nothing that moves is ever sent by itself.
 */

import { Client } from "../protocol/client.ts";
import { haltOf } from "../protocol/command.ts";
import { unwrap } from "../protocol/line.ts";
import { streamOf } from "../protocol/telemetry.ts";
import { type Clock, every, clock as pageClock } from "../transport/clock.ts";
import type { Opened, Transport } from "../transport/transport.ts";
import { Base } from "./base.ts";
import { changeAt } from "./faults.ts";
import { Meter } from "./meter.ts";
import type { Connection, Cursor, Model, Spoken, Topic } from "./model.ts";
import { type Line, orders } from "./orders.ts";
import { Questions } from "./questions.ts";
import { Seat } from "./seat.ts";
import { Simulated } from "./simulated.ts";
import { type NextFrame, nextFrame, Topics } from "./topics.ts";
import { Voice } from "./voice.ts";
import { read, type Told } from "./worldline.ts";

export interface LiveOptions {
  readonly clock?: Clock;
  readonly frame?: NextFrame;
  /** Nobody sees the page: it gives no signs of life then. */
  readonly isHidden?: () => boolean;
  readonly firstTag?: number;
}

const TICK_MS = 50;
/** Who comes back after a loss may find the seat taken by himself, and gets it again within this. */
const SEAT_MS = 15_000;

export class LiveModel implements Model {
  readonly kind = "live";
  readonly commands = orders(this.#line());
  cursor: Cursor = { t: undefined };
  readonly #transport: Transport;
  readonly #clock: Clock;
  readonly #topics: Topics;
  readonly #base: Base;
  readonly #client: Client;
  readonly #questions: Questions;
  readonly #seat: Seat;
  readonly #simulated: Simulated;
  readonly #voice: Voice;
  readonly #meter = new Meter();
  /** Tags of the page's own questions, whose answers are no more than chatter. */
  readonly #chatter = new Set<number | undefined>();
  /** This page had the driver's seat before its connection was lost, and waits for it: a Stop is sent when it is back. */
  #drove = false;
  #reclaims = false;
  /** Ends the wait for a seat in which an unanswered Stop could be sent. */
  #forgetting = () => {};
  #ticking = () => {};

  constructor(transport: Transport, options: LiveOptions = {}) {
    this.#transport = transport;
    this.#clock = options.clock ?? pageClock;
    this.#topics = new Topics(options.frame ?? nextFrame(this.#clock));
    this.#voice = new Voice(this.#clock, this.#topics);
    this.#seat = new Seat(transport);
    this.#simulated = new Simulated(this.#clock);
    this.#base = new Base({
      changed: (...topics) => this.#topics.publish(...topics),
      want: (line) => this.#questions.want(line),
      anew: () => this.#anew(),
      streaming: (on) => transport.expectTraffic(on),
      elapsed: () => this.#clock.elapsed(),
    });
    this.#client = new Client({
      clock: this.#clock,
      send: (line) => transport.send(line),
      sent: (line, isPoll) => this.#sent(line, isPoll),
      alarm: (text) => this.#voice.raise(text),
      firstTag: options.firstTag ?? Math.floor(Math.random() * 65_536),
    });
    this.#questions = new Questions({
      client: this.#client,
      base: this.#base,
      clock: this.#clock,
      // Whichever base it is, it may say what it is.
      mayAsk: () => this.#seat.role === "drive",
      isHidden: options.isHidden ?? (() => typeof document !== "undefined" && document.hidden),
      note: (text) => this.#voice.note(text),
    });
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
    this.#questions.end();
    this.#ticking();
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
    return this.#voice.spoken;
  }

  get alarm() {
    return this.#voice.alarm;
  }

  get statistics() {
    return this.#meter.reading(this.#base.damaged + this.#transport.traffic.damaged, this.#client.unanswered);
  }

  get streaming() {
    return this.#base.streaming;
  }

  get pose() {
    return this.#base.pose;
  }

  get heardAt() {
    const { telemetryAt, poseAt, statesAt, motorsAt } = this.#base;
    return { telemetry: telemetryAt, pose: poseAt, states: statesAt, motors: motorsAt };
  }

  get unresponsive() {
    return this.#seat.role === "drive" && this.#client.isUnresponsive;
  }

  get mayDrive() {
    return this.#blocked() === undefined;
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
    this.#seat.opened(role, another);
    this.#base.reconnected();
    this.#voice.note(
      role === "drive"
        ? `connected to ${this.#transport.to}${another ? ", which may be another base than before" : ""}`
        : `connected to ${this.#transport.to}: another page drives, this one watches`,
    );
    if (role === "drive") {
      this.#forgetting();
      this.#client.opened();
      this.#reclaims = false;
      this.#drove = true;
      void this.#questions.begin();
    } else {
      this.#reclaims = this.#drove;
      this.#drove = false;
      this.#forgetting();
      this.#forgetting = this.#clock.after(SEAT_MS, () => this.#forgetHalts());
    }
    this.#topics.publish("connection");
  }

  /** The seat was not to be had again: a Stop of before would now stop what another page does. */
  #forgetHalts(): void {
    this.#reclaims = false;
    if (this.#seat.role === "drive" || !this.#client.isHalting) return;
    this.#client.close("another page drives");
    this.#voice.warn("Stop was not answered, and now another page drives: it cannot be sent from here");
  }

  #lost(why: string, retryAt: number | undefined): void {
    if (this.#seat.connection.state !== "lost") this.#voice.note(`connection lost: ${why}`);
    this.#seat.lost(why, retryAt);
    this.#cut(why);
  }

  #cut(why: string): void {
    this.#questions.end();
    this.#client.lost(why);
    this.#simulated.lost();
    this.#base.reconnected();
    this.#topics.publish("connection", "history");
  }

  /** The base has started anew: it has forgotten the telemetry that it was asked for, and all that has no place in its flash. */
  #anew(): void {
    this.#questions.end();
    this.#client.restarted();
    this.#base.forget();
    this.#transport.expectTraffic(false);
    this.#voice.note("the base has started anew");
    if (this.#seat.role === "drive") void this.#questions.begin();
  }

  // What is heard.

  #sent(line: string, isPoll: boolean): void {
    this.#base.sent(line);
    this.#voice.speak("sent", line, isPoll);
    const { tag } = unwrap(line);
    if (isPoll) this.#chatter.add(tag);
    else this.#chatter.delete(tag);
  }

  #heard(line: string): void {
    const kind = this.#base.heard(line);
    if (kind === "damaged") {
      this.#voice.note(`damaged line left out: ${line}`, true);
      return;
    }
    if (kind === "row") this.#client.touch();
    if (kind === "reply") {
      const { tag } = unwrap(line);
      this.#questions.replied();
      this.#voice.speak("heard", line, this.#chatter.delete(tag));
      this.#client.heard(line);
    } else if (kind !== "telemetry" || !this.#base.streaming) {
      // The page's own telemetry is on the strips; somebody who asked for another wants to read it.
      this.#voice.speak("heard", line, kind !== "event");
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
    this.#voice.speak("sent", line, false);
    const stream = streamOf(unwrap(line).body);
    if (stream && !this.#base.recorder.stream) this.#base.joined(stream);
  }

  // What is asked.

  #tick(): void {
    this.#meter.tick(this.#clock.elapsed(), this.#transport.traffic);
    this.#questions.tick();
  }

  #line(): Line {
    const model = this;
    return {
      ask: (line, since = this.#client.halts) => model.#ask(line, since),
      get halts() {
        return model.#client.halts;
      },
      halt: (what) => model.#halt(what),
      note: (text) => model.#voice.note(text),
      takeSeat: () => model.#transport.takeSeat?.(),
      world: (request) => {
        const send = model.#transport.sendWorld?.bind(model.#transport);
        if (!send) return Promise.reject(new Error("this base is no simulated one"));
        return model.#simulated.ask(request, send);
      },
      watchGains: (on) => model.#questions.watchGains(on),
      truth: () => model.#simulated.truth(model.heardAt.telemetry),
      confirmBase: () => {
        model.#seat.confirmed();
        model.#topics.publish("connection");
      },
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
    const { role, connection } = this.#seat;
    if (connection.state === "open" && connection.another)
      return "not sent: this may be another base than before: say first that it is to be driven";
    if (role === "drive") return undefined;
    return role === "watch" ? "not sent: this page only watches" : "not sent: there is no connection to the base";
  }

  #halt(what: "Stop" | "EStop"): void {
    if (this.#seat.role === "watch" && !this.#reclaims) {
      this.#voice.warn(`${what} was not sent: this page only watches, another one drives`);
      return;
    }
    this.#topics.publish("events");
    this.#client.halt(what).catch((error: Error) => this.#voice.note(error.message));
  }
}
