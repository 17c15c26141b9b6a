/** What the page itself has to say: beside the lines of the base in the console, and as the alarm above everything. */
import type { Clock } from "../transport/clock.ts";
import { Conversation } from "./conversation.ts";
import type { Alarm, Spoken } from "./model.ts";
import type { Topics } from "./topics.ts";

/** How long an alarm stands that nothing else ends. */
const WARNING_MS = 5000;

export class Voice {
  alarm: Alarm | undefined;
  readonly #clock: Clock;
  readonly #topics: Topics;
  readonly #conversation = new Conversation();
  #warning = () => {};

  constructor(clock: Clock, topics: Topics) {
    this.#clock = clock;
    this.#topics = topics;
  }

  get spoken(): readonly Spoken[] {
    return this.#conversation.lines;
  }

  speak(direction: Spoken["direction"], text: string, isChatter: boolean): void {
    this.#conversation.add({ at: this.#clock.now(), direction, text }, isChatter);
    this.#topics.publish("spoken");
  }

  note(text: string, isChatter = false): void {
    this.speak("note", text, isChatter);
  }

  raise(text: string | undefined): void {
    this.#warning();
    this.alarm = text === undefined ? undefined : { text };
    this.#topics.publish("alarm");
  }

  /** An alarm about something that nothing will change. */
  warn(text: string): void {
    this.raise(text);
    this.note(text);
    this.#warning = this.#clock.after(WARNING_MS, () => this.raise(undefined));
  }
}
