/** A base that answers as docs/protocol.md says, for the model's tests: it stands where it is told and does nothing. */
import { keywordOf, wordsOf } from "../../src/protocol/command.ts";
import { unwrap, wrap } from "../../src/protocol/line.ts";
import { streamOf } from "../../src/protocol/telemetry.ts";

export class FakeBase {
  /** Commands heard, without tag and check. */
  readonly heard: string[] = [];
  /** Answers that replace the usual ones; undefined: no answer at all. */
  readonly answers = new Map<string, readonly string[] | undefined>();
  status = "HOLD HOLD enabled none";
  path = ["Path 0 idle"];
  map = ["Map 0 0 0 -"];
  parameters = new Map([
    ["wheel_base", "0.3 0.02 5 m"],
    ["left_diameter", "0.1 0.005 2 m"],
    ["right_diameter", "0.102 0.005 2 m"],
    ["counts_per_turn", "2048 4 10000000 -"],
    ["gate", "25 0 1000 -"],
    ["require_crc", "0 0 1 -"],
  ]);
  fields: readonly string[] = [];

  reply = (line: string): readonly string[] => {
    const { tag, body } = unwrap(line);
    this.heard.push(body);
    const said = this.answers.has(body)
      ? this.answers.get(body)
      : this.answers.has(keywordOf(body))
        ? this.answers.get(keywordOf(body))
        : this.#usual(body);
    const [first, ...rows] = said ?? [];
    if (first === undefined) return [];
    return [tag === undefined ? first : wrap(tag, first), ...rows];
  };

  /** A line of the telemetry that was asked for. */
  telemetry(values: Readonly<Record<string, string>>): string {
    return `~ ${this.fields.map((field) => values[field] ?? usual(field)).join(" ")}`;
  }

  #usual(body: string): readonly string[] {
    const [name = "", value = ""] = wordsOf(body);
    switch (keywordOf(body)) {
      case "version":
        return ["Version vehicle-controller 0.1.0 fake 1"];
      case "listparams":
        return [`Params ${this.parameters.size}`, ...[...this.parameters].map(([each, rest]) => `~ ${each} ${rest}`)];
      case "getparam": {
        const [now, , , unit] = (this.parameters.get(name) ?? "").split(" ");
        return now ? [`Param ${name} ${now} ${unit}`] : ["ERR unknown no such parameter"];
      }
      case "setparam": {
        const [, ...rest] = (this.parameters.get(name) ?? "").split(" ");
        this.parameters.set(name, [value, ...rest].join(" "));
        return ["OK"];
      }
      case "getstatus":
        return [`Status ${this.status}`];
      case "getestpos":
        return ["EstPos 0.100000 0.200000 30.00000 1.00000e-4 0.00000e0 0.00000e0 1.00000e-4 0.00000e0 1.00000e0"];
      case "getpath":
        return this.path;
      case "getmap":
        return this.map;
      case "getgains":
        return ["Gains 1.000000 0.990000 1.010000 0.010000 0.010000 0.005000"];
      case "stream":
        this.fields = streamOf(body)?.fields ?? [];
        return ["OK"];
      case "mark":
        return [`Marked ${name}`];
      default:
        return ["OK"];
    }
  }
}

function usual(field: string): string {
  return field === "move_state" || field === "turn_state" ? "HOLD" : field === "fault" ? "none" : field === "t" ? "1.000" : "0.000000";
}
