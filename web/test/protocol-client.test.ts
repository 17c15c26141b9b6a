/** The client against a base that answers when the test says so. */
import assert from "node:assert/strict";
import { test } from "node:test";
import { uniform } from "../src/model/random.ts";
import { Client } from "../src/protocol/client.ts";
import { unwrap } from "../src/protocol/line.ts";
import { FakeClock, settle } from "./fakes/clock.ts";

function bench() {
  const clock = new FakeClock();
  const lines: string[] = [];
  const alarms: (string | undefined)[] = [];
  let broken = false;
  const haltsAt: number[] = [];
  const client: Client = new Client({
    clock,
    send: (line) => {
      if (broken) throw new Error("broken");
      lines.push(line);
      haltsAt.push(client.halts);
    },
    sent: () => {},
    alarm: (text) => alarms.push(text),
    firstTag: 65_534,
  });
  client.opened();
  const tagOf = (at: number) => unwrap(lines[at] ?? "").tag ?? -1;
  return {
    clock,
    client,
    lines,
    /** Stops asked for when each line was sent. */
    haltsAt,
    alarms,
    bodies: () => lines.map((line) => unwrap(line).body),
    /** Answers the line that was sent as the at-th. */
    answer: (at: number, reply = "OK") => client.heard(`@${tagOf(at)} ${reply}`),
    break: () => {
      broken = true;
    },
  };
}

/** What becomes of a promise. */
function fate(promise: Promise<string>): { now: string } {
  const known = { now: "waits" };
  promise.then(
    (reply) => {
      known.now = reply;
    },
    (error: Error) => {
      known.now = `${error.name}: ${error.message}`;
    },
  );
  return known;
}

test("a command goes with tag and check, and its reply is its own", async () => {
  const { client, lines, answer } = bench();
  const one = fate(client.ask("m 1"));
  const two = fate(client.ask("GetStatus"));
  const three = fate(client.ask("t 90"));
  assert.match(lines[0] ?? "", /^@65534 m 1\*[0-9A-F]{4}$/);
  assert.equal(unwrap(lines[2] ?? "").tag, 0, "tags begin again");
  assert.ok(lines.every((line) => unwrap(line).check === "good"));
  answer(0);
  answer(1, "Status HOLD HOLD enabled none");
  answer(2, "ERR fault estop");
  await settle();
  assert.deepEqual([one.now, two.now, three.now], ["OK", "Status HOLD HOLD enabled none", "ERR fault estop"]);
});

test("three wait for their replies, the fourth place is a Stop's", () => {
  const { client, bodies, answer } = bench();
  for (const line of ["m 1", "m 2", "m 3", "m 4"]) client.ask(line).catch(() => {});
  assert.deepEqual(bodies(), ["m 1", "m 2", "m 3"]);
  answer(0);
  assert.deepEqual(bodies(), ["m 1", "m 2", "m 3", "m 4"]);
  void client.halt("Stop");
  assert.deepEqual(bodies().slice(4), ["Stop"]);
});

test("a Stop overtakes what waits, and nothing of that is ever sent", async () => {
  const { client, bodies, answer, clock } = bench();
  const fates = ["m 1", "m 2", "m 3", "m 4", "GoTo 1 1", "GetStatus"].map((line) => fate(client.ask(line)));
  const stop = fate(client.ask(" sToP "));
  assert.deepEqual(bodies(), ["m 1", "m 2", "m 3", "Stop"]);
  await settle();
  for (const overtaken of fates.slice(3)) assert.match(overtaken.now, /^Overtaken: .* was not sent: overtaken by Stop/);
  for (const at of [0, 1, 2, 3]) answer(at);
  await clock.pass(5000);
  assert.equal(stop.now, "OK");
  assert.deepEqual(bodies(), ["m 1", "m 2", "m 3", "Stop"]);
});

test("what was decided before a Stop is not begun after it", async () => {
  const { client, bodies } = bench();
  const since = client.halts;
  void client.halt("EStop");
  const late = fate(client.ask("Follow start", { since }));
  await settle();
  assert.match(late.now, /overtaken/);
  assert.deepEqual(bodies(), ["EStop"]);
});

test("an order after a Stop goes behind it", () => {
  const { client, bodies } = bench();
  void client.halt("Stop");
  client.ask("m 1").catch(() => {});
  assert.deepEqual(bodies(), ["Stop", "m 1"]);
});

test("a Stop that is not answered is sent again each half second, and raises the alarm until it is", async () => {
  const { client, bodies, alarms, answer, clock } = bench();
  const stop = fate(client.halt("Stop"));
  await clock.pass(999);
  assert.deepEqual([bodies().length, alarms.length], [1, 0]);
  await clock.pass(2);
  assert.equal(bodies().length, 2);
  assert.match(alarms.at(-1) ?? "", /Stop is not answered/);
  await clock.pass(60_000);
  assert.equal(bodies().length, 122);
  // Whichever of them is answered.
  answer(118);
  await settle();
  assert.equal(stop.now, "OK");
  assert.equal(alarms.at(-1), undefined);
  await clock.pass(5000);
  assert.equal(bodies().length, 122);
});

test("a Stop that is refused, its line damaged, is not answered", async () => {
  const { client, bodies, answer, clock } = bench();
  const stop = fate(client.halt("Stop"));
  answer(0, "ERR checksum");
  await clock.pass(100);
  assert.equal(stop.now, "waits");
  answer(1);
  await settle();
  assert.deepEqual([stop.now, bodies().length], ["OK", 2]);
});

test("each press of Stop sends one", () => {
  const { client, bodies } = bench();
  void client.halt("Stop");
  void client.halt("Stop");
  void client.halt("EStop");
  assert.deepEqual(bodies(), ["Stop", "Stop", "EStop"]);
});

test("a second of silence, and a command is unanswered; its late reply is nobody's", async () => {
  const { client, answer, clock } = bench();
  const one = fate(client.ask("m 1"));
  const save = fate(client.ask("SaveParams"));
  await clock.pass(990);
  assert.equal(one.now, "waits");
  await clock.pass(20);
  assert.match(one.now, /^Unanswered/);
  assert.equal(answer(0), false);
  await clock.pass(2900);
  assert.equal(save.now, "waits", "flash takes longer, and its turn began when the one before was given up");
  await clock.pass(200);
  assert.match(save.now, /^Unanswered/);
  assert.equal(client.unanswered, 2);
});

test("rows of a list are no silence", async () => {
  const { client, clock } = bench();
  const one = fate(client.ask("GetStatus"));
  for (let row = 0; row < 10; row += 1) {
    await clock.pass(900);
    client.touch();
  }
  assert.equal(one.now, "waits");
});

test("a reply for a later command says that the earlier one's was lost", async () => {
  const { client, answer } = bench();
  const one = fate(client.ask("m 1"));
  const two = fate(client.ask("m 2"));
  answer(1);
  await settle();
  assert.match(one.now, /^Unanswered/);
  assert.equal(two.now, "OK");
});

test("nothing but a Stop outlives a lost connection", async () => {
  const { client, bodies, answer, clock, alarms } = bench();
  const fates = ["m 1", "m 2", "m 3", "m 4"].map((line) => fate(client.ask(line)));
  const stop = fate(client.halt("Stop"));
  client.lost("cut");
  await settle();
  for (const lost of fates) assert.match(lost.now, /cut|overtaken/);
  assert.match(fate(client.ask("m 5")).now, /waits/);
  await clock.pass(2000);
  assert.match(alarms.at(-1) ?? "", /no connection/);
  assert.equal(bodies().length, 4);
  client.opened();
  assert.deepEqual(bodies().slice(4), ["Stop"]);
  assert.equal(answer(3), false, "of the connection before");
  answer(4);
  await settle();
  assert.equal(stop.now, "OK");
});

test("a Stop that is refused is sent again at once, not after a second; the second refusal is an alarm", async () => {
  const { client, clock, bodies, alarms, answer } = bench();
  const refuse = (at: number) => answer(at, "ERR checksum wrong");
  const stop = fate(client.halt("Stop"));
  refuse(0);
  await clock.pass(60);
  assert.deepEqual(bodies(), ["Stop", "Stop"]);
  assert.equal(alarms.at(-1), undefined);
  refuse(1);
  assert.match(alarms.at(-1) ?? "", /not answered/);
  await clock.pass(60);
  assert.equal(bodies().length, 3);
  assert.equal(stop.now, "waits");
});

test("a Stop without a connection raises the alarm at once", () => {
  const { client, alarms } = bench();
  client.lost("cut");
  client.halt("Stop").catch(() => {});
  assert.match(alarms.at(-1) ?? "", /no connection/);
});

test("a line that cannot be put on its way rejects its command", async () => {
  const one = bench();
  one.break();
  const sent = fate(one.client.ask("m 1"));
  await settle();
  assert.match(sent.now, /broken/);
});

test("a base that starts anew answers nothing of before, and what waited is not sent to it", async () => {
  const { client, bodies } = bench();
  const fates = ["m 1", "m 2", "m 3", "m 4"].map((line) => fate(client.ask(line)));
  client.restarted();
  await settle();
  for (const lost of fates) assert.match(lost.now, /started anew/);
  assert.equal(bodies().length, 3);
});

test("questions of the page itself wait for what the user asks", () => {
  const { client, bodies, answer } = bench();
  for (const line of ["a", "b", "c"]) client.ask(line).catch(() => {});
  client.ask("GetStatus", { poll: true }).catch(() => {});
  client.ask("m 1").catch(() => {});
  answer(0);
  assert.equal(bodies().at(-1), "m 1");
});

test("what is too long with its tag and check is not sent", async () => {
  const { client, lines } = bench();
  const long = fate(client.ask("x".repeat(250)));
  await settle();
  assert.match(long.now, /too long/);
  assert.equal(lines.length, 0);
});

test("random garbage answers nothing and breaks nothing", async () => {
  const { client, answer } = bench();
  const next = uniform(77);
  const one = fate(client.ask("m 1"));
  const alphabet = "@0123456789 OKER*!~abc.-\t";
  for (let line = 0; line < 20_000; line += 1) {
    const text = Array.from({ length: next() * 30 }, () => alphabet[Math.floor(next() * alphabet.length)]).join("");
    if (unwrap(text).tag !== 65_534) assert.equal(client.heard(text), false);
  }
  answer(0);
  await settle();
  assert.equal(one.now, "OK");
});

test("after any order of replies, losses and Stops, no order is sent behind a later Stop", async () => {
  for (let seed = 0; seed < 60; seed += 1) {
    const { client, bodies, answer, lines, haltsAt, clock } = bench();
    const next = uniform(seed);
    const asked: string[] = [];
    for (let step = 0; step < 60; step += 1) {
      const what = next();
      if (what < 0.45) {
        const line = `m ${asked.length}`;
        asked.push(line);
        client.ask(line).catch(() => {});
      } else if (what < 0.6) {
        asked.push("Stop");
        client.halt("Stop").catch(() => {});
      } else if (what < 0.9) answer(Math.floor(next() * lines.length));
      else if (what < 0.95) await clock.pass(next() * 1500);
      else {
        client.lost("cut");
        client.opened();
      }
    }
    // When an order went out, as many Stops had been asked for as when it was asked for itself.
    const before = new Map(asked.map((line, at) => [line, asked.slice(0, at).filter((each) => each === "Stop").length]));
    for (const [at, body] of bodies().entries()) {
      if (body !== "Stop") assert.equal(haltsAt[at], before.get(body), `seed ${seed}: ${body}`);
    }
    const moves = bodies().filter((body) => body !== "Stop");
    assert.deepEqual(
      moves,
      [...moves].sort((a, b) => Number(a.slice(2)) - Number(b.slice(2))),
    );
  }
});
