/** What a line could go on with, from what is known of the base: its commands, parameters and places. */

export interface Knowledge {
  readonly topics: readonly string[];
  readonly commands: readonly string[];
  readonly parameters: readonly string[];
  readonly places: readonly string[];
  readonly landmarks: readonly string[];
}

type Source = keyof Knowledge | readonly string[];

const PLACES: readonly Source[] = ["places"];
/** What the parameters of a command are, one by one. Commands that are not here take numbers. */
const PARAMETERS = new Map<string, readonly (readonly Source[])[]>([
  ["help", [["topics", "commands"]]],
  ["getparam", [["parameters"]]],
  ["setparam", [["parameters"]]],
  ["calibrate", [[["on", "off", "reset", "straight"]]]],
  ["follow", [[["start", "clear"]]]],
  ["forgetmap", [[["here"]]]],
  ["mark", [PLACES]],
  ["amithere", [PLACES]],
  ["sight", [["landmarks"]]],
  ["label", [PLACES, ["landmarks"]]],
  ["freeway", [PLACES, PLACES]],
  ["route", [PLACES, PLACES]],
  ["crosses", [PLACES, PLACES, PLACES, PLACES]],
]);

export interface Completion {
  /** Words that fit, in order. */
  readonly candidates: readonly string[];
  /** The line with what all of them have in common; undefined if that adds nothing. */
  readonly completed: string | undefined;
}

export function complete(line: string, known: Knowledge): Completion {
  const words = line.split(/[\s,]+/);
  const word = words.at(-1) ?? "";
  const first = words[0] ?? "";
  const sources: readonly Source[] = words.length === 1 ? ["commands"] : (PARAMETERS.get(first.toLowerCase())?.[words.length - 2] ?? []);
  // Nothing typed yet is nothing to complete: the Tab key moves on.
  if (line.trim() === "") return { candidates: [], completed: undefined };

  const offered = sources.flatMap((source) => (typeof source === "string" ? known[source] : source));
  const candidates = [...new Set(offered)].filter((each) => each.toLowerCase().startsWith(word.toLowerCase()));
  const only = candidates.length === 1;
  const common = only ? `${candidates[0]} ` : commonPrefix(candidates);
  const completed = line.slice(0, line.length - word.length) + common;
  return { candidates, completed: common.length > word.length ? completed : undefined };
}

function commonPrefix(words: readonly string[]): string {
  const [first = "", ...rest] = words;
  let length = first.length;
  for (const word of rest) {
    let same = 0;
    while (same < length && word[same]?.toLowerCase() === first[same]?.toLowerCase()) same += 1;
    length = same;
  }
  return first.slice(0, length);
}
