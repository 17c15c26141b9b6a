/** Reads a log from a file: a trace, a saved history, a replay, a robot's log or a transcript, told by what stands in it. */
import type { Recording } from "../model/log.ts";
import { LogModel } from "../model/log.ts";
import type { Model } from "../model/model.ts";
import { Builder } from "./builder.ts";
import { Columns, clip } from "./header.ts";
import { wheelsOf } from "./odometry.ts";
import { table } from "./tables.ts";
import { isTranscript, transcript } from "./transcript.ts";

/** A larger file is none that a page can hold. */
export const MAX_BYTES = 200_000_000;
/** A line that is longer is of no such file. */
const MAX_LINE = 100_000;

/** What is used of a file. */
export interface Source {
  readonly name: string;
  readonly size: number;
  stream(): ReadableStream<Uint8Array>;
}

/** What is taken of the base that is connected, for logs that do not tell it themselves. */
export type Known = Pick<Model, "geometry" | "parameters">;

/** The log as a model. Throws what is wrong with the file, with its line. */
export async function readLog(file: Source, known: Known): Promise<Model> {
  return new LogModel(await readRecording(file, known));
}

export async function readRecording(file: Source, known: Known): Promise<Recording> {
  if (file.size > MAX_BYTES) throw new Error(`it has ${Math.ceil(file.size / 1e6)} MB, and ${MAX_BYTES / 1e6} MB are the most`);
  const builder = new Builder(known.geometry, wheelsOf(known.parameters));
  const take = lineTaker(builder);
  let number = 0;
  for await (const lines of linesOf(file)) {
    for (const line of lines) {
      number += 1;
      try {
        take(line);
      } catch (error) {
        throw new Error(`line ${number}: ${error instanceof Error ? error.message : String(error)}`);
      }
    }
  }
  // Counts are integrated with wheels of their own; of the other files none tells the vehicle.
  if (builder.geometry === known.geometry) builder.note(shapeNote(known));
  return builder.finish(file.name);
}

function shapeNote({ geometry, parameters }: Known): string {
  const whose = parameters.size > 0 ? "the connected base's" : "what a new base has, since no base has told its own";
  return `the log does not tell the vehicle; it is drawn as ${geometry.vehicle}, ${geometry.wheelBase} m between its wheels or axles: ${whose}`;
}

/** Lines of the file that are no more than comments, or empty, say nothing. */
function lineTaker(builder: Builder): (line: string) => void {
  let take: ((line: string) => void) | undefined;
  return (raw) => {
    const line = raw.replace(/^\uFEFF/, "").trimEnd();
    if (line === "" || line.startsWith("#")) return;
    if (take) return take(line);
    if (line.includes("\0")) throw new Error("it is no text file");
    if (isTranscript(line)) {
      take = transcript(builder);
      return take(line);
    }
    if (!line.includes(",")) throw new Error(`\`${clip(line)}\` is neither a row of column names nor the first line of a transcript`);
    const columns = new Columns(line);
    const row = table(columns, builder);
    take = (text) => row(columns.split(text));
  };
}

/** As many at a time as the file gives: between them the page goes on. */
async function* linesOf(file: Source): AsyncGenerator<readonly string[]> {
  const decoder = new TextDecoder();
  const reader = file.stream().getReader();
  let rest = "";
  for (;;) {
    const { value, done } = await reader.read();
    rest += done ? decoder.decode() : decoder.decode(value, { stream: true });
    const lines = rest.split(/\r\n|\n|\r(?!$)/);
    rest = lines.pop() ?? "";
    yield lines;
    if (rest.length > MAX_LINE) throw new Error(`a line of more than ${MAX_LINE} characters is of no log`);
    if (done) break;
  }
  if (rest !== "") yield [rest];
}
