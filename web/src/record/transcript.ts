/**
 * A transcript: lines of a base, each behind its time in seconds and a tab, as `hil-sim run` prints them. What was sent is not in it, so which fields its telemetry
 * has is told by how the lines are written; and the time is the transcript's, which a base that starts anew does not set back.
 */
import { type Sample, STATES } from "../model/model.ts";
import { keywordOf, wordsOf } from "../protocol/command.ts";
import { unwrap } from "../protocol/line.ts";
import { estPos, status } from "../protocol/replies.ts";
import { looksLike, number, OLDER_STREAM, OWN_STREAM, type Stream, streamOf } from "../protocol/telemetry.ts";
import type { Builder } from "./builder.ts";
import { clip } from "./header.ts";

/** Telemetry that is older than this is stale, s: see the rows of replies below. */
const STALE_S = 0.5;
const LINE = /^\s*(\d+(?:\.\d+)?)\t(.*)$/;

export function isTranscript(line: string): boolean {
  return LINE.test(line);
}

const USUAL: readonly (Stream | undefined)[] = [streamOf("Stream 1"), OWN_STREAM, OLDER_STREAM];

/** Takes the lines of a transcript. Each throws what is wrong with it. */
export function transcript(to: Builder): (line: string) => void {
  let known: Stream | undefined;
  let streamed = Number.NEGATIVE_INFINITY;
  return (line) => {
    const [, time, text] = LINE.exec(line) ?? [];
    if (time === undefined || text === undefined) throw new Error(`column 1: \`${clip(line)}\` does not begin with seconds and a tab`);
    const t = Number(time);
    const { body, check } = unwrap(text);
    if (check === "bad") return to.note(`${time} s: damaged line left out: ${text}`);
    to.say({ at: t * 1000, direction: "heard", text });
    // What was typed may be in it, too.
    known = streamOf(body) ?? known;
    if (body.startsWith("~")) {
      if (telemetry(body, t, known, to)) streamed = t;
      return;
    }
    const told = body.startsWith("! fault ") ? fault(body, t, to) : reply(body, t, to);
    // Among telemetry, a row in which most is missing would only tear the lines; without telemetry it is all that there is to see.
    if (told && t - streamed > STALE_S) row({ ...told, t }, to);
  };
}

function row(told: Partial<Sample>, to: Builder): void {
  to.clear();
  Object.assign(to.sample, told);
  to.row();
}

function telemetry(line: string, t: number, known: Stream | undefined, to: Builder): boolean {
  const stream = [known, ...USUAL].find((each) => each && looksLike(line, each));
  if (!stream) return false;
  const words = line.slice(1).trim().split(" ");
  const fields = new Map(stream.fields.map((field, at) => [field, words[at]]));
  const { sample } = to;
  to.clear();
  for (const channel of Object.keys(sample) as (keyof typeof sample)[]) {
    const word = fields.get(channel);
    if (word === undefined) continue;
    const state = (STATES as readonly string[]).indexOf(word);
    sample[channel] = channel === "move_state" || channel === "turn_state" ? (state < 0 ? Number.NaN : state) : number(word);
  }
  sample.t = t;
  to.row();
  const name = fields.get("fault");
  if (name) to.fault({ t, fault: name });
  return true;
}

function fault(line: string, t: number, to: Builder): Partial<Sample> {
  const [, name = "none", place] = wordsOf(line);
  const wheels = place === "left" || place === "right" || place === "both" ? place : undefined;
  to.fault({ t, fault: name, ...(wheels && { place: wheels }) });
  return {};
}

/** What a reply tells of a row; undefined if it is of another kind. */
function reply(line: string, t: number, to: Builder): Partial<Sample> | undefined {
  const words = wordsOf(line);
  if (keywordOf(line) === "estpos") {
    const told = estPos(words);
    if (!told) return undefined;
    to.estimate({ ...told, t });
    return { x: told.x, y: told.y, theta: told.theta };
  }
  const told = keywordOf(line) === "status" ? status(words) : undefined;
  if (!told) return undefined;
  to.fault({ t, fault: told.fault });
  return { move_state: STATES.indexOf(told.moveState), turn_state: STATES.indexOf(told.turnState) };
}
