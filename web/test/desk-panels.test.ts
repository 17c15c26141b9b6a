/** Parameters, calibration, the world and the words of the header: what is worked out before anything is drawn. */
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Connection, Parameter } from "../src/model/model.ts";
import { seedOf } from "../src/views/calibration.ts";
import { type Clock, Fixes, type Tally } from "../src/views/fixes.ts";
import { GAIN_NAMES, gainWords, trueGains } from "../src/views/gains.ts";
import { baseName, paceWords } from "../src/views/header.ts";
import { refusedValue } from "../src/views/parameters.ts";
import { aged, unreachable } from "../src/views/stopbar.ts";
import { order, refusal } from "../src/views/view.ts";
import { factorOf, weaker } from "../src/views/world.ts";

test("a parameter is checked as the protocol reads numbers, and against its range", () => {
  const gate = { min: 0, max: 5, unit: "m" };
  for (const good of ["0", "5", "1.5", "+1", ".5", "5.", "1e-3", "0.5E+1"]) assert.equal(refusedValue(good, gate), undefined, good);
  for (const bad of ["", "inf", "NaN", "0x1", "1,5", "1 2", "e5", "."]) assert.match(refusedValue(bad, gate) ?? "", /not a number/, bad);
  for (const out of ["-0.1", "5.01", "1e9"]) assert.match(refusedValue(out, gate) ?? "", /range, 0 to 5/, out);
});

const parameter = (name: string, value: number): [string, Parameter] => [name, { name, value, min: 0, max: 5, unit: "m", before: value }];

test("true gains are true over nominal geometry; where either is not known there are none", () => {
  const parameters = new Map([parameter("right_diameter", 0.1), parameter("left_diameter", 0.1), parameter("wheel_base", 0.2)]);
  const geometry = { vehicle: "differential", wheelBase: 0.2, track: 0.2, wheelDiameter: 0.1 } as const;
  const truth = { wheelBase: 0.202, leftDiameter: 0.099, rightDiameter: 0.101 };
  const world = { truth } as never;
  const gains = trueGains({ world, parameters, geometry }) ?? [];
  // Exact but for the rounding of three divisions.
  for (const [at, gain] of [1.01, 0.99, 1.01].entries()) assert.ok(Math.abs(gain - (gains[at] ?? 0)) < 1e-12);
  assert.equal(trueGains({ world: undefined, parameters, geometry }), undefined);
  assert.equal(trueGains({ world, parameters: new Map(), geometry }), undefined);
  assert.equal(trueGains({ world, parameters, geometry: { ...geometry, vehicle: "tricycle" } }), undefined);
  assert.deepEqual(
    Object.values(GAIN_NAMES).map((names) => names.length),
    [3, 3, 3, 4],
  );
  assert.equal(gainWords(1.01, 0.002, "°", undefined), "1.01000 ± 0.00200 °");
  assert.equal(gainWords(1.01, 0.002, "", 1), "1.01000 ± 0.00200, truly 1.00000");
  assert.equal(gainWords(undefined, undefined, "", 1), "not asked yet");
});

test("fixes are given at their pace, one at a time, and only while somebody looks", async () => {
  let tick = () => {};
  let ended = 0;
  const clock: Clock = {
    every: (ms, run) => {
      assert.equal(ms, 2000);
      tick = run;
      return () => {
        ended += 1;
      };
    },
  };
  let tally: Tally | undefined;
  const fixes = new Fixes((next) => {
    tally = next;
  }, clock);
  const given: number[] = [];
  let answer: (reply: string) => void = () => {};
  let may = true;
  const settle = () => new Promise((done) => setImmediate(done));
  fixes.start(
    2,
    (number) => {
      given.push(number);
      return new Promise((resolve) => {
        answer = resolve;
      });
    },
    () => may,
  );
  tick();
  assert.deepEqual(given, [0], "the first waits for its reply");
  answer("Observed 0.3");
  await settle();
  may = false;
  tick();
  assert.deepEqual(given, [0]);
  may = true;
  tick();
  answer("ERR gate 40");
  await settle();
  assert.deepEqual(given, [0, 1]);
  assert.deepEqual([tally?.taken, tally?.refused, tally?.last], [1, 1, "ERR gate 40"]);
  tick();
  fixes.stop("left");
  answer("Observed 9");
  await settle();
  assert.deepEqual([tally?.running, tally?.taken, tally?.last, ended], [false, 1, "left", 1]);
});

test("no two fixes share their noise", () => {
  assert.notEqual(seedOf(1, 0), seedOf(1, 1));
  assert.notEqual(seedOf(1, 1), seedOf(2, 0));
});

test("a weaker motor is told as the scripts have it, and read back", () => {
  assert.deepEqual(weaker("left", 0.5), { fault: "left motor weak 0.5" });
  assert.equal(factorOf("left", ["right motor weak 0.3", "left motor weak 0.5"]), 0.5);
  assert.equal(factorOf("left", ["both motor weak 0.4"]), 0.4);
  assert.equal(factorOf("left", ["left encoder stuck"]), 1);
});

test("an order that would not reach the base is not said to have been sent", () => {
  const open = { state: "open", to: "x", role: "drive", seatFree: false, another: false } as const;
  const why = (connection: Connection, unresponsive = false) => unreachable({ connection, unresponsive }) ?? "";
  assert.equal(why(open), "");
  assert.equal(why({ ...open, another: true }), "", "whichever base it is, it is stopped");
  assert.match(why(open, true), /does not answer/);
  assert.match(why({ ...open, role: "watch" }), /only watches: it reaches nobody/);
  assert.match(why({ state: "lost", to: "x", why: "y", retryAt: undefined }), /emergency stop/);
  assert.match(why({ state: "none" }), /no base/);
});

test("what was told long ago is shown with its age", () => {
  assert.deepEqual(aged("move HOLD", true, 0.9), { text: "move HOLD", old: false });
  assert.deepEqual(aged("move HOLD", true, 3.2), { text: "move HOLD (3 s old)", old: true });
  assert.deepEqual(aged("move HOLD", false, 0.1), { text: "move HOLD (0 s old)", old: true });
});

test("a refusal is told with its reason, an answer that did not come as that", async () => {
  const said: string[] = [];
  const say = (text: string) => void said.push(text);
  assert.equal(await order("Enable", Promise.resolve("OK"), say), true);
  assert.equal(await order("Clear fault", Promise.resolve("ERR fault estop"), say), false);
  assert.equal(await order("Enable", Promise.reject(new Error("not answered")), say), false);
  assert.equal(await order("Enable", undefined, say), false);
  assert.deepEqual(said, [
    "Enable: done",
    "Clear fault is refused: fault estop",
    "Enable: not answered",
    "Enable: this page does not drive a base now",
  ]);
  assert.equal(refusal("EstPos 1 2 3"), undefined);
});

test("the header's words", () => {
  assert.equal(paceWords(0.994, 1), "99 %");
  assert.equal(paceWords(1, 4), "100 % of 4×");
  assert.equal(paceWords(7, undefined), "as fast as it goes");
  const version = "Version vehicle-controller 0.1.0 nucleo-f429zi 1";
  const connection = { state: "none" } as const;
  assert.equal(
    baseName({ kind: "live", connection, version: "vehicle-controller 0.1.0 nucleo-f429zi 1", world: undefined }),
    "nucleo-f429zi 0.1.0",
  );
  assert.equal(baseName({ kind: "live", connection, version, world: undefined }), "nucleo-f429zi 0.1.0");
  assert.equal(baseName({ kind: "live", connection, version, world: { robot: "default" } as never }), 'simulated "default" 0.1.0');
});
