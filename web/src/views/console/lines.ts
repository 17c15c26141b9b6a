/**
 * What of the conversation the console shows. The page asks the base ten questions a second and hears fifty lines of telemetry: among those, what somebody
 * said must be found. What is noise is decided line by line, and kept apart, so that noise cannot push the rest out.
 */
import type { Spoken } from "../../model/model.ts";
import { plain, tagOf } from "./typed.ts";

/** What a line is: said by somebody, an event, the page's own question (or its answer), telemetry, or a note of the page. */
export type Kind = "command" | "event" | "poll" | "telemetry" | "note";

export interface Line extends Spoken {
  readonly kind: Kind;
  /** Orders lines of different rings. */
  readonly number: number;
}

/** What the page says by itself: its questions, its telemetry, the fixes that it is told to feed. */
const POLLS = new Set(
  "getestpos getstatus getpath getmap getgains getbattery gettime getstate getparam listparams version help stream observepos".split(" "),
);
/** Lists: what follows the keyword of the reply tells how many rows come. */
const LISTS = new Map([
  ["Params", 1],
  ["Path", 1],
  ["Route", 1],
  ["AmIThere", 1],
  ["Map", 3],
]);
/** Tags wait for their replies at most so long; the client has four unanswered at most. */
const REMEMBERED = 32;

/** Kept of what is said, and of noise. */
export const KEPT = 500;

export class Lines {
  #number = 0;
  #said: Line[] = [];
  #noise: Line[] = [];
  /** The kinds of lines that wait for a reply: by tag, and in order without one. */
  #asked = new Map<string, Kind>();
  #untagged: Kind[] = [];
  #rows = { left: 0, kind: "poll" as Kind };
  #typed: string[] = [];

  /** The next line with this text is not a question of the page's own: somebody has typed it. */
  expect(text: string): void {
    this.#typed.push(text.trim());
    if (this.#typed.length > REMEMBERED) this.#typed.shift();
  }

  add(spoken: Spoken): Line {
    this.#number += 1;
    const line = { ...spoken, kind: this.#kind(spoken), number: this.#number };
    const ring = isNoise(line) ? this.#noise : this.#said;
    ring.push(line);
    if (ring.length > KEPT) ring.shift();
    return line;
  }

  /** What is to be shown, oldest first. */
  shown(noise: boolean): readonly Line[] {
    if (!noise) return this.#said;
    return [...this.#said, ...this.#noise].sort((a, b) => a.number - b.number).slice(-KEPT);
  }

  #kind(spoken: Spoken): Kind {
    if (spoken.direction === "note") return "note";
    const text = plain(spoken.text);
    const tag = tagOf(spoken.text);
    return spoken.direction === "sent" ? this.#sent(text, tag) : this.#heard(text, tag);
  }

  #sent(text: string, tag: string | undefined): Kind {
    const typed = this.#typed.indexOf(text.trim());
    if (typed >= 0) this.#typed.splice(0, typed + 1);
    const keyword = text.trim().split(/[\s,]/, 1)[0]?.toLowerCase() ?? "";
    const kind = typed < 0 && POLLS.has(keyword) ? "poll" : "command";
    if (tag === undefined) {
      this.#untagged.push(kind);
      if (this.#untagged.length > REMEMBERED) this.#untagged.shift();
    } else {
      this.#asked.delete(tag);
      this.#asked.set(tag, kind);
      if (this.#asked.size > REMEMBERED) this.#asked.delete(this.#asked.keys().next().value ?? tag);
    }
    return kind;
  }

  #heard(text: string, tag: string | undefined): Kind {
    if (text.startsWith("! ")) return "event";
    if (text.startsWith("~")) {
      if (this.#rows.left === 0) return "telemetry";
      this.#rows.left -= 1;
      return this.#rows.kind;
    }
    const kind = tag === undefined ? this.#untagged.shift() : this.#asked.get(tag);
    if (tag !== undefined) this.#asked.delete(tag);
    // A watcher does not see the questions: an answer to one of the page's kind is taken for that.
    const answers = kind ?? (POLLS.has(`get${text.split(" ", 1)[0]?.toLowerCase()}`) ? "poll" : "command");
    this.#list(text, answers);
    return answers;
  }

  #list(text: string, kind: Kind): void {
    const [keyword, ...counts] = text.split(" ");
    const summands = LISTS.get(keyword ?? "");
    if (summands === undefined) return;
    const left = counts.slice(0, summands).reduce((sum, count) => sum + Number(count), 0);
    this.#rows = { left: Number.isInteger(left) ? left : 0, kind };
  }
}

export function isNoise(line: Line): boolean {
  return line.kind === "poll" || line.kind === "telemetry";
}
