/** What the console shows of the conversation, completes, and lets out. */
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Spoken } from "../src/model/model.ts";
import { complete } from "../src/views/console/completion.ts";
import { HelpBook } from "../src/views/console/helpbook.ts";
import { KEPT, Lines } from "../src/views/console/lines.ts";
import { Past } from "../src/views/console/past.ts";
import { LONGEST, plain, refused, tagOf } from "../src/views/console/typed.ts";

const sent = (text: string): Spoken => ({ at: 0, direction: "sent", text });
const heard = (text: string): Spoken => ({ at: 0, direction: "heard", text });
const kinds = (lines: Lines, ...spoken: Spoken[]) => spoken.map((each) => lines.add(each).kind);

test("questions of the page and their answers are noise, what somebody types is not", () => {
  const lines = new Lines();
  assert.deepEqual(kinds(lines, sent("@7 GetStatus*1A2B"), heard("@7 Status HOLD HOLD enabled none*0000")), ["poll", "poll"]);
  lines.expect("GetStatus");
  assert.deepEqual(kinds(lines, sent("@8 GetStatus"), sent("@9 GetStatus"), heard("@9 Status HOLD"), heard("@8 Status HOLD")), [
    "command",
    "poll",
    "poll",
    "command",
  ]);
  assert.deepEqual(kinds(lines, sent("@10 m 1"), heard("~ 1 2 3"), heard("@10 OK"), heard("! move done 0.0")), [
    "command",
    "telemetry",
    "command",
    "event",
  ]);
});

test("the rows of a list belong to its question, telemetry does not", () => {
  const lines = new Lines();
  lines.expect("ListParams");
  assert.deepEqual(
    kinds(lines, sent("@1 ListParams"), heard("@1 Params 2"), heard("~ gate 25 0 1 -"), heard("~ corner 0.1 0 10 m"), heard("~ 1 2")),
    ["command", "command", "command", "command", "telemetry"],
  );
  assert.deepEqual(
    kinds(lines, sent("@2 GetMap"), heard("@2 Map 1 1 0 -"), heard("~ place desk 0.5"), heard("~ landmark tv desk"), heard("~ 1 2")),
    ["poll", "poll", "poll", "poll", "telemetry"],
  );
});

test("a watcher, who hears answers alone, and a transcript without tags", () => {
  const lines = new Lines();
  assert.deepEqual(kinds(lines, heard("@7 EstPos 0 0 0"), heard("@8 OK"), heard("@9 ERR fault link")), ["poll", "command", "command"]);
  assert.deepEqual(kinds(lines, sent("GetEstPos"), sent("m 1"), heard("EstPos 1 2 3"), heard("OK")), [
    "poll",
    "command",
    "poll",
    "command",
  ]);
});

test("noise cannot push out what was said, and neither grows without bound", () => {
  const lines = new Lines();
  lines.add(sent("@1 m 1"));
  for (let t = 0; t < 5000; t += 1) lines.add(heard(`~ ${t}`));
  assert.deepEqual(
    lines.shown(false).map((line) => line.text),
    ["@1 m 1"],
  );
  assert.equal(lines.shown(true).length, KEPT);
  assert.equal(lines.shown(true).at(-1)?.text, "~ 4999");
  for (let t = 0; t < 5000; t += 1) lines.add(heard("! posture 1"));
  assert.equal(lines.shown(false).length, KEPT);
});

test("tags and checks are taken off, numbers are not", () => {
  assert.equal(plain("@17 m 1*29B1"), "m 1");
  assert.equal(plain("EstPos 1.000000 2.0"), "EstPos 1.000000 2.0");
  assert.equal(plain("@17 OK*0a1B"), "OK");
  assert.equal(tagOf("@17 OK"), "17");
  assert.equal(tagOf("OK @17"), undefined);
});

test("what the base could not take is not sent", () => {
  assert.equal(refused("m 1 0.3"), undefined);
  assert.equal(refused("m\t1"), undefined);
  assert.match(refused("m 1\n5 0.3") ?? "", /one line/);
  assert.match(refused("m \u0007") ?? "", /control character/);
  assert.match(refused("t 90°") ?? "", /“°” is not ASCII/);
  assert.match(refused("m \u22121") ?? "", /not ASCII/, "a typographic minus is none");
  assert.match(refused("m \u007f") ?? "", /127/);
  assert.equal(refused("x".repeat(LONGEST)), undefined);
  assert.match(refused("x".repeat(LONGEST + 1)) ?? "", /longer/);
});

const KNOWN = {
  topics: ["motion", "map"],
  commands: ["move", "turn", "Stop", "GetPath", "GetParam", "GetMap", "SetParam", "Mark", "Route"],
  parameters: ["move_speed", "move_accel", "gate"],
  places: ["door", "desk"],
  landmarks: ["tv"],
};

test("Tab completes commands in any case, parameters, places and fixed words", () => {
  assert.equal(complete("st", KNOWN).completed, "Stop ");
  assert.deepEqual(complete("getp", KNOWN), { candidates: ["GetPath", "GetParam"], completed: "GetPa" });
  assert.equal(complete("GetParam mo", KNOWN).completed, "GetParam move_");
  assert.equal(complete("setparam ga", KNOWN).completed, "setparam gate ");
  assert.equal(complete("Route door de", KNOWN).completed, "Route door desk ");
  assert.equal(complete("help mot", KNOWN).completed, "help motion ");
  assert.equal(complete("Follow st", KNOWN).completed, "Follow start ");
});

test("Tab moves on where there is nothing to complete", () => {
  for (const line of ["", "  ", "m 1", "xyz", "GetPa", "Route door desk 1"]) assert.equal(complete(line, KNOWN).completed, undefined, line);
});

test("the help is the base's own, asked once, and of this base", async () => {
  const answers: Record<string, string> = {
    Help: "Help motion state; try Help motion, Help move",
    "Help motion": "Help move turn Stop",
    "Help state": "Help GetStatus",
    "Help move": "Help m or move [d [v [a]]]: translate",
  };
  const asked: string[] = [];
  let changes = 0;
  const book = new HelpBook(() => {
    changes += 1;
  });
  const ask = (line: string) => {
    asked.push(line);
    return Promise.resolve(answers[line] ?? "ERR syntax no such topic or command");
  };
  book.reset(ask);
  assert.equal(book.of("move"), undefined, "nothing is known beforehand");
  await Promise.all([book.open(), book.open()]);
  assert.deepEqual(asked, ["Help", "Help motion", "Help state"]);
  assert.deepEqual(
    [book.topics, book.commands],
    [
      ["motion", "state"],
      ["move", "turn", "Stop", "GetStatus"],
    ],
  );
  book.of("move");
  await Promise.resolve();
  await new Promise((done) => setImmediate(done));
  assert.equal(book.of("move"), "m or move [d [v [a]]]: translate");
  assert.equal(asked.filter((line) => line === "Help move").length, 1);
  assert.equal(book.of("nonsense"), undefined);
  assert.ok(changes >= 2);
  book.reset(undefined);
  await book.open();
  assert.deepEqual(book.commands, []);
});

test("the past goes back and forth, and keeps what was being typed", () => {
  const past = new Past("m 1\nt 90\n");
  assert.equal(past.step(-1, "St"), "t 90");
  assert.equal(past.step(-1, "t 90"), "m 1");
  assert.equal(past.step(-1, "m 1"), undefined);
  assert.equal(past.step(1, "m 1"), "t 90");
  assert.equal(past.step(1, "t 90"), "St");
  assert.equal(past.step(1, "St"), undefined);
  past.add("Stop");
  past.add("Stop");
  assert.equal(past.toString(), "m 1\nt 90\nStop");
  for (let n = 0; n < 1000; n += 1) past.add(`m ${n}`);
  assert.equal(past.toString().split("\n").length, 200);
});
