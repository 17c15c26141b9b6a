/**
 * A transcript: lines of a base, each behind its time in seconds and a tab, as `hil-sim run` prints them. What was sent is not in it, so which fields its telemetry
 * has is told by how the lines are written; and the time is the transcript's, which a base that starts anew does not set back.
 */
import { STATES } from "../model/model.ts";
import { keywordOf, wordsOf } from "../protocol/command.ts";
import { unwrap } from "../protocol/line.ts";
import { estPos, status } from "../protocol/replies.ts";
import { looksLike, number, OLDER_STREAM, OWN_STREAM, type Stream, streamOf } from "../protocol/telemetry.ts";
import type { Builder } from "./builder.ts";
import { clip } from "./header.ts";

const LINE = /^\s*(\d+(?:\.\d+)?)\t(.*)$/;

export function isTranscript(line: string): boolean {
  return LINE.test(line);
}

const USUAL: readonly (Stream | undefined)[] = [streamOf("Stream 1"), OWN_STREAM, OLDER_STREAM];

/** Takes the lines of a transcript. Each throws what is wrong with it. */
export function transcript(to: Builder): (line: string) => void {
  let known: Stream | undefined;
  return (line) => {
    const [, time, text] = LINE.exec(line) ?? [];
    if (time === undefined || text === undefined) throw new Error(`column 1: \`${clip(line)}\` does not begin with seconds and a tab`);
    const t = Number(time);
    const { body, check } = unwrap(text);
    if (check === "bad") return to.note(`${time} s: damaged line left out: ${text}`);
    to.say({ at: t * 1000, direction: "heard", text });
    // What was typed may be in it, too.
    known = streamOf(body) ?? known;
    if (body.startsWith("~")) telemetry(body, t, known, to);
    else if (body.startsWith("! fault ")) fault(body, t, to);
    else reply(body, t, to);
  };
}

function telemetry(line: string, t: number, known: Stream | undefined, to: Builder): void {
  const stream = [known, ...USUAL].find((each) => each && looksLike(line, each));
  if (!stream) return;
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
}

function fault(line: string, t: number, to: Builder): void {
  const [, name = "none", place] = wordsOf(line);
  const wheels = place === "left" || place === "right" || place === "both" ? place : undefined;
  to.fault({ t, fault: name, ...(wheels && { place: wheels }) });
}

function reply(line: string, t: number, to: Builder): void {
  const words = wordsOf(line);
  if (keywordOf(line) === "estpos") {
    const told = estPos(words);
    if (!told) return;
    to.clear();
    Object.assign(to.sample, { t, x: told.x, y: told.y, theta: told.theta });
    to.row();
    to.estimate({ ...told, t });
  } else if (keywordOf(line) === "status") {
    const told = status(words);
    if (told) to.fault({ t, fault: told.fault });
  }
}
