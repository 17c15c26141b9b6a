/** Makes samples of telemetry lines, and of the true pose where there is one. */
import { number, type Stream, valuesOf } from "../protocol/telemetry.ts";
import { blank, LIVE_CAPACITY, Ring } from "./history.ts";
import { wrap } from "./layout.ts";
import { CHANNELS, type Channel, type Sample, STATES } from "./model.ts";
import type { Moment } from "./worldline.ts";

/** A true pose is of a sample that is at most so much older or younger, s. */
const FRESH_S = 0.2;
/** A base whose clock is back by more than this has started anew, s. */
const ANEW_S = 0.5;

/** What a telemetry line amounted to. */
export type Outcome = "sample" | "anew" | "nothing" | "damaged";

export class Recorder {
  readonly history = new Ring(LIVE_CAPACITY);
  /** What the last line said of the fault, if it has that field. */
  fault: string | undefined;
  #stream: Stream | undefined;
  #sample: Sample = blank();
  #moments: [before: Moment | undefined, last: Moment | undefined] = [undefined, undefined];

  get stream(): Stream | undefined {
    return this.#stream;
  }

  set stream(stream: Stream | undefined) {
    this.#stream = stream;
    this.fault = undefined;
  }

  /** The last sample's value of a channel. */
  last(channel: Channel): number {
    return this.history.at(channel, this.history.length - 1);
  }

  /** The base, or its clock, has begun anew. */
  restart(): void {
    this.history.clear();
    this.#moments = [undefined, undefined];
  }

  /** Where the base truly is. */
  moment(moment: Moment): void {
    const [, last] = this.#moments;
    this.#moments = last && last.t < moment.t ? [last, moment] : [undefined, moment];
  }

  line(line: string): Outcome {
    const words = this.#stream && valuesOf(line, this.#stream);
    if (!this.#stream || !words) return "damaged";
    const sample = this.#sample;
    for (const channel of CHANNELS) sample[channel] = Number.NaN;
    for (let at = 0; at < words.length; at += 1) {
      const field = this.#stream.fields[at] ?? "";
      const word = words[at];
      if (field === "fault") this.fault = word;
      else if (field === "move_state" || field === "turn_state") sample[field] = stateOf(word);
      else if (isChannel(field)) sample[field] = number(word);
    }
    if (Number.isNaN(sample.t)) return this.#stream.fields.includes("t") ? "damaged" : "nothing";
    const anew = sample.t < this.history.last - ANEW_S;
    if (anew) this.restart();
    this.#addTruth(sample);
    if (!this.history.push(sample)) return "nothing";
    return anew ? "anew" : "sample";
  }

  /**
   * The true pose is told half as often as telemetry: between and shortly behind two moments, along the line through both. A base that speeds up by 1 m/s² makes
   * that wrong by less than a millimetre; staying with the last pose would be wrong by centimetres.
   */
  #addTruth(sample: Sample): void {
    const [before, last] = this.#moments;
    if (!last || Math.abs(sample.t - last.t) > FRESH_S) return;
    const span = before ? last.t - before.t : 0;
    const share = before && span <= FRESH_S ? (sample.t - last.t) / span : 0;
    sample.true_x = last.x + share * (last.x - (before?.x ?? last.x));
    sample.true_y = last.y + share * (last.y - (before?.y ?? last.y));
    sample.true_theta = wrap(last.theta + share * wrap(last.theta - (before?.theta ?? last.theta)));
  }
}

function stateOf(word: string | undefined): number {
  const at = (STATES as readonly (string | undefined)[]).indexOf(word);
  return at < 0 ? Number.NaN : at;
}

const NAMES: ReadonlySet<string> = new Set(CHANNELS);

function isChannel(name: string): name is Channel {
  return NAMES.has(name);
}
