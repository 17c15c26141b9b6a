/** The live model against a base that answers as the protocol's page says. */
import assert from "node:assert/strict";
import { test } from "node:test";
import { LiveModel } from "../src/model/live.ts";
import { uniform } from "../src/model/random.ts";
import { unwrap, wrap } from "../src/protocol/line.ts";
import { FakeBase } from "./fakes/base.ts";
import { FakeClock, settle } from "./fakes/clock.ts";
import { FakeTransport } from "./fakes/transport.ts";

function bench() {
  const clock = new FakeClock();
  const transport = new FakeTransport();
  const base = new FakeBase();
  transport.base = base.reply;
  let hidden = false;
  const model = new LiveModel(transport, { clock, frame: (run) => clock.after(16, run), isHidden: () => hidden, firstTag: 1 });
  model.open();
  const heard = (since: number, keyword: string) => base.heard.slice(since).filter((line) => line.startsWith(keyword));
  return {
    clock,
    transport,
    base,
    model,
    heard,
    hide: (now: boolean) => {
      hidden = now;
    },
    /** Connects, and lets the page ask its questions. */
    begin: async (role: "drive" | "watch" = "drive") => {
      transport.comes(role);
      await clock.pass(100);
    },
    telemetry: (values: Record<string, string>) => transport.hear(base.telemetry(values)),
  };
}

const MOVES = /^(m|move|t|turn|goto|follow|chase|enable|clearfault)\b/i;

test("after connecting it asks all there is to know, and nothing that moves", async () => {
  const { base, model, begin, transport } = bench();
  assert.equal(model.connection.state, "connecting");
  await begin();
  const order = ["Version", "ListParams", "GetStatus", "Stream 0.02 t x y theta v_s"];
  assert.deepEqual(
    order.map((line) => base.heard.findIndex((each) => each.startsWith(line))),
    [...order.keys()],
  );
  assert.ok(base.heard.every((line) => !MOVES.test(line)));
  assert.ok(transport.expects);
  assert.equal(model.version, "vehicle-controller 0.1.0 fake 1");
  assert.equal(model.parameters.get("gate")?.max, 1000);
  assert.equal(model.parameters.get("gate")?.unit, "");
  assert.deepEqual(model.geometry, { vehicle: "differential", wheelBase: 0.3, track: 0.3, wheelDiameter: 0.101 });
  assert.deepEqual(model.status, { moveState: "HOLD", turnState: "HOLD", enabled: true, fault: "none" });
  assert.ok(model.mayDrive && model.streaming);
});

test("questions that are not answered at first are asked again", async () => {
  const { base, model, begin, clock } = bench();
  base.answers.set("version", undefined);
  base.answers.set("listparams", undefined);
  await begin();
  await clock.pass(2000);
  assert.equal(model.version, undefined);
  base.answers.clear();
  await clock.pass(6000);
  assert.ok(model.version && model.parameters.size > 0 && model.streaming);
});

test("a base without tick_load is asked for the fault in its place", async () => {
  const { base, model, begin, telemetry } = bench();
  const own =
    "Stream 0.02 t x y theta v_s v_s_ref v_alpha v_alpha_ref move_state turn_state left_duty right_duty left_current right_current battery";
  base.answers.set(`${own} tick_load`, ["ERR syntax no such field"]);
  await begin();
  assert.ok(base.heard.includes(`${own} fault`));
  assert.ok(model.streaming);
  telemetry({ t: "2.000", fault: "stall" });
  assert.equal(model.status?.fault, "stall");
});

test("telemetry becomes samples; what is not measured is not a number", async () => {
  const { model, begin, telemetry } = bench();
  await begin();
  telemetry({ t: "1.000", x: "0.500000", theta: "90.00000", move_state: "ACCEL", left_current: "-", tick_load: "0.125" });
  const { history } = model;
  assert.deepEqual([history.length, history.at("x", 0), history.at("theta", 0), history.at("move_state", 0)], [1, 0.5, 90, 1]);
  assert.ok(Number.isNaN(history.at("left_current", 0)) && Number.isNaN(history.at("true_x", 0)));
  assert.equal(history.at("tick_load", 0), 0.125);
  assert.equal(model.status?.moveState, "ACCEL", "sooner than GetStatus tells it");
});

test("each poll has its pace, none is asked twice at once, and none while nobody looks", async () => {
  const { clock, base, begin, heard, hide, model, telemetry, transport } = bench();
  await begin();
  telemetry({ t: "1.000" });
  let since = base.heard.length;
  await clock.pass(10_000);
  assert.ok(Math.abs(heard(since, "GetEstPos").length - 50) <= 1, `${heard(since, "GetEstPos").length}`);
  assert.ok(Math.abs(heard(since, "GetStatus").length - 40) <= 1);
  assert.equal(heard(since, "GetPath").length + heard(since, "GetMap").length + heard(since, "GetGains").length, 0);
  model.commands.watchGains(true);
  since = base.heard.length;
  await clock.pass(5000);
  assert.ok(Math.abs(heard(since, "GetGains").length - 5) <= 1);
  transport.base = () => [];
  const sent = transport.sent.length;
  await clock.pass(5000);
  const asked = transport.sent.slice(sent).filter((line) => line.includes("GetEstPos"));
  assert.ok(asked.length <= 6, "one a second: it waits for the answer that does not come");
  transport.base = base.reply;
  await clock.pass(1000);
  hide(true);
  since = base.heard.length;
  await clock.pass(10_000);
  assert.equal(base.heard.length, since);
  model.commands.stop();
  assert.equal(base.heard.at(-1), "Stop", "a Stop works always");
});

test("a path is asked for when it changes, and each second while it is driven", async () => {
  const { clock, base, begin, heard, model, transport } = bench();
  await begin();
  base.path = ["Path 2 path", "~ 1 1.000000 0.000000 - 0.3", "~ 2 2.000000 1.000000 90.00000 -"];
  let since = base.heard.length;
  await model.commands.goTo({ x: 1, y: 0, theta: undefined });
  await clock.pass(100);
  assert.deepEqual(heard(since, "GoTo"), ["GoTo 1 0"]);
  assert.deepEqual(model.path, {
    mode: "path",
    postures: [
      { number: 1, x: 1, y: 0, theta: undefined, speed: 0.3 },
      { number: 2, x: 2, y: 1, theta: 90, speed: undefined },
    ],
  });
  since = base.heard.length;
  await clock.pass(5000);
  assert.ok(Math.abs(heard(since, "GetPath").length - 5) <= 1);
  base.path = ["Path 0 idle"];
  transport.hear("! path done");
  await clock.pass(100);
  assert.equal(model.path.mode, "idle");
});

test("telemetry and events between the rows of a list do not split it", async () => {
  const { clock, base, begin, model, telemetry } = bench();
  await begin();
  const own = (t: string) => base.telemetry({ t });
  base.answers.set("getpath", [
    "Path 2 path",
    own("3.000"),
    "~ 1 1.000000 0.000000 - -",
    "! turn done 0.01000",
    own("3.020"),
    "~ 2 passed",
  ]);
  await model.commands.send("GetPath");
  telemetry({ t: "3.040" });
  await clock.pass(10);
  assert.deepEqual(
    model.path.postures.map((posture) => posture.number),
    [1],
  );
  assert.equal(model.history.length, 3);
  assert.equal(model.statistics.damagedLines, 0);
});

test("follow adds a posture, and starts only a base that is idle", async () => {
  const { base, begin, heard, model } = bench();
  await begin();
  let since = base.heard.length;
  await model.commands.follow({ x: 1, y: -0.5, theta: undefined });
  assert.deepEqual(heard(since, "Follow"), ["Follow 1 -0.5 -", "Follow start"]);
  base.path = ["Path 1 path", "~ 1 1.000000 0.000000 - -"];
  since = base.heard.length;
  await model.commands.follow({ x: 2, y: 0, theta: 45.5 });
  assert.deepEqual(heard(since, "Follow"), ["Follow 2 0 45.5"]);
  base.answers.set("follow", ["ERR full no room"]);
  assert.equal(await model.commands.follow({ x: 2, y: 0, theta: 0 }), "ERR full no room");
});

test("a Stop between adding a posture and starting overtakes the start", async () => {
  const { base, begin, heard, model, transport } = bench();
  await begin();
  const since = base.heard.length;
  transport.base = (line) => {
    const replies = base.reply(line);
    if (unwrap(line).body.startsWith("Follow 1")) model.commands.stop();
    return replies;
  };
  await assert.rejects(model.commands.follow({ x: 1, y: 0, theta: 0 }), /overtaken by Stop/);
  assert.deepEqual(heard(since, "Follow"), ["Follow 1 0 0"]);
});

test("a typed Stop is a Stop; typed tags and checks are the page's business", async () => {
  const { base, begin, heard, model } = bench();
  await begin();
  base.answers.set("m", undefined);
  const waiting = ["m 1", "m 2", "m 3", "m 4"].map((line) => model.commands.send(line).catch((error: Error) => error.message));
  assert.equal(await model.commands.send("stop"), "OK");
  assert.match((await waiting[3]) ?? "", /overtaken/);
  const since = base.heard.length;
  await model.commands.send(wrap(5, "GetTime"));
  assert.deepEqual(heard(since, "GetTime"), ["GetTime"]);
  await assert.rejects(model.commands.send("   "), /empty/);
});

test("a fault is told at once, with its wheels, until it is cleared", async () => {
  const { clock, base, begin, model, transport, telemetry } = bench();
  await begin();
  telemetry({ t: "1.000" });
  base.status = "HOLD HOLD enabled no-motion";
  transport.hear("! fault no-motion left");
  assert.deepEqual([model.status?.fault, model.status?.place], ["no-motion", "left"]);
  await clock.pass(1000);
  assert.deepEqual([model.status?.fault, model.status?.place], ["no-motion", "left"]);
  telemetry({ t: "2.000" });
  base.status = "HOLD HOLD enabled none";
  await model.commands.clearFault();
  await clock.pass(100);
  assert.deepEqual([model.status?.fault, model.status?.place], ["none", undefined]);
  assert.deepEqual([model.faultAt(0.5), model.faultAt(1.5), model.faultAt(2)], [undefined, "no-motion", "none"]);
});

test("another Stream is taken as it was asked for, and the page's own is asked for again by its button only", async () => {
  const { clock, begin, model, transport } = bench();
  await begin();
  await model.commands.send("Stream 0.1 t battery x");
  assert.equal(model.streaming, false);
  transport.hear("~ 5.000 12.400 0.250000");
  assert.deepEqual([model.history.at("battery", 0), model.history.at("x", 0)], [12.4, 0.25]);
  assert.ok(
    model.spoken.some((line) => line.text === "~ 5.000 12.400 0.250000"),
    "who asked for it reads it",
  );
  await clock.pass(300);
  assert.equal(model.streaming, false);
  assert.equal(await model.commands.ownStream(), "OK");
  assert.ok(model.streaming);
});

test("a Stream that the base refused changes nothing", async () => {
  const { base, begin, model } = bench();
  await begin();
  base.answers.set("Stream 0.1 nonsense", ["ERR syntax no such field"]);
  await model.commands.send("Stream 0.1 nonsense");
  assert.ok(model.streaming);
});

test("after `! boot` all is asked anew, and nothing of before is shown", async () => {
  const { clock, base, begin, model, telemetry, transport, heard } = bench();
  await begin();
  telemetry({ t: "100.000" });
  await clock.pass(500);
  assert.ok(model.estimates.length > 0);
  const since = base.heard.length;
  transport.hear("@3 Status HOLD HO! boot watchdog");
  assert.deepEqual([model.history.length, model.estimates.length, model.status, model.parameters.size], [0, 0, undefined, 0]);
  await clock.pass(100);
  assert.equal(heard(since, "Version").length + heard(since, "ListParams").length, 2);
  assert.ok(heard(since, "Stream").length === 1 && base.heard.slice(since).every((line) => !MOVES.test(line)));
  telemetry({ t: "0.500" });
  assert.equal(model.history.length, 1);
});

test("a base whose clock is back has started anew, although nobody heard it say so", async () => {
  const { begin, model, telemetry } = bench();
  await begin();
  telemetry({ t: "100.000" });
  telemetry({ t: "0.020" });
  assert.ok(model.spoken.some((line) => line.direction === "note" && /started anew/.test(line.text)));
  assert.equal(model.history.length, 0);
});

test("a base that answers but sends no telemetry is asked for it again", async () => {
  const { clock, begin, model, telemetry, base, heard } = bench();
  await begin();
  telemetry({ t: "1.000" });
  const since = base.heard.length;
  await clock.pass(2000);
  assert.equal(heard(since, "Stream").length, 1);
  assert.ok(model.streaming);
});

test("nothing that waits outlives a lost connection, and nothing that moves is sent after it", async () => {
  const { clock, base, begin, model, transport } = bench();
  await begin();
  base.answers.set("m", undefined);
  const waiting = ["m 1", "m 2", "m 3", "m 4"].map((line) => model.commands.send(line).catch((error: Error) => error.message));
  transport.goes("the cable");
  assert.deepEqual(model.connection, { state: "lost", to: "fake", why: "the cable", retryAt: undefined });
  for (const why of await Promise.all(waiting)) assert.match(why, /the cable/);
  await assert.rejects(model.commands.send("m 5"), /no connection/);
  const since = base.heard.length;
  transport.comes();
  await clock.pass(3000);
  assert.ok(base.heard.slice(since).every((line) => !MOVES.test(line)));
});

test("a Stop pressed while the line is cut raises the alarm, and is the first thing sent when it is back", async () => {
  const { clock, base, begin, model, transport } = bench();
  await begin();
  transport.goes();
  model.commands.stop();
  assert.match(model.alarm?.text ?? "", /Stop is not answered: there is no connection/);
  await clock.pass(4000);
  const since = base.heard.length;
  transport.comes();
  assert.equal(base.heard[since], "Stop");
  await settle();
  assert.equal(model.alarm, undefined);
});

test("an unanswered Stop raises the alarm and is repeated", async () => {
  const { clock, base, begin, heard, model } = bench();
  await begin();
  base.answers.set("stop", undefined);
  model.commands.stop();
  await clock.pass(1200);
  assert.match(model.alarm?.text ?? "", /Stop is not answered/);
  base.answers.clear();
  await clock.pass(600);
  assert.equal(model.alarm, undefined);
  assert.ok(heard(0, "Stop").length >= 3);
});

test("another board at the same place: nothing of the old one is shown, and nothing is sent to it but the Stop that was not answered", async () => {
  const { clock, base, begin, model, transport, telemetry } = bench();
  await begin();
  telemetry({ t: "1.000", x: "3.000000" });
  await clock.pass(500);
  transport.goes("unplugged");
  model.commands.stop();
  const since = base.heard.length;
  base.answers.set("version", undefined);
  base.answers.set("listparams", undefined);
  transport.comes("drive", true);
  await settle();
  assert.deepEqual(
    [model.history.length, model.estimates.length, model.status, model.parameters.size, model.version],
    [0, 0, undefined, 0, undefined],
  );
  assert.equal(base.heard.slice(since)[0], "Stop");
});

test("who watches hears all and sends nothing", async () => {
  const { clock, base, begin, model, transport } = bench();
  transport.base = () => {
    throw new Error("a watcher sent something");
  };
  await begin("watch");
  transport.world({ hello: { robot: "default", vehicle: "differential", speed: 1, role: "watch", seat: "taken", faults: ["link cut"] } });
  transport.world({ sent: "@9 Stream 0.02 t x y" });
  transport.hear("~ 1.000 0.100000 0.200000");
  assert.equal(model.history.at("y", 0), 0.2);
  transport.world({ sent: wrap(10, "Stream 0.02 t battery") });
  transport.hear("~ 1.020 0.110000 0.200000");
  transport.hear(wrap(10, "OK"));
  transport.hear("~ 1.040 12.100");
  assert.deepEqual([model.history.at("x", 1), model.history.at("battery", 2)], [0.11, 12.1]);
  transport.hear("@11 Status MOVE HOLD enabled none");
  assert.equal(model.status?.moveState, "MOVE");
  assert.equal(model.mayDrive, false);
  await assert.rejects(model.commands.send("m 1"), /only watches/);
  model.commands.stop();
  assert.match(model.alarm?.text ?? "", /Stop was not sent: this page only watches/);
  await clock.pass(6000);
  assert.equal(model.alarm, undefined);
  transport.world({ seat: "free" });
  assert.equal(model.connection.state === "open" && model.connection.seatFree, true);
  model.commands.takeSeat();
  assert.equal(transport.seatsAsked, 1);
  assert.deepEqual(base.heard, []);
});

test("a Stop that was not answered is not sent by who only watches; he is told", async () => {
  const { clock, begin, model, transport } = bench();
  await begin();
  transport.goes();
  model.commands.stop();
  transport.base = () => {
    throw new Error("a watcher sent something");
  };
  transport.comes("watch");
  await clock.pass(14_000);
  assert.match(model.alarm?.text ?? "", /not answered/);
  await clock.pass(2000);
  assert.match(model.alarm?.text ?? "", /another page drives/);
});

test("a Stop while the page waits for its own seat is sent when it is back", async () => {
  const { clock, base, begin, model, transport } = bench();
  await begin();
  transport.goes();
  const reply = transport.base;
  transport.base = () => {
    throw new Error("a watcher sent something");
  };
  transport.comes("watch");
  await clock.pass(1000);
  model.commands.stop();
  assert.match(model.alarm?.text ?? "", /Stop is not answered/);
  transport.base = reply;
  const since = base.heard.length;
  transport.comes("drive");
  await clock.pass(100);
  assert.equal(base.heard[since], "Stop");
  assert.equal(model.alarm, undefined);
});

test("a typed check that is wrong is not made right", async () => {
  const { base, begin, model } = bench();
  await begin();
  await assert.rejects(model.commands.send("m 1 0.3*0000"), /check is wrong/);
  assert.ok(!base.heard.some((line) => line.startsWith("m 1")));
});

test("a posture after a Stop begins a path of its own", async () => {
  const { base, begin, model } = bench();
  await begin();
  base.answers.set("getpath", ["Path 2 idle", "~ 1 3.000000 0.000000 - -", "~ 2 3.000000 3.000000 - -"]);
  const since = base.heard.length;
  const follow = model.commands.follow({ x: 1, y: 1, theta: undefined });
  await settle();
  base.answers.clear();
  await follow.catch(() => {});
  const said = base.heard.slice(since).filter((line) => /^Follow/.test(line));
  assert.deepEqual(said.slice(0, 2), ["Follow clear", "Follow 1 1 -"]);
});

test("the simulated world: where the base truly is, what is asked of it, and what it refuses", async () => {
  const { clock, begin, model, transport, telemetry } = bench();
  await begin();
  transport.world({
    hello: {
      robot: "default",
      vehicle: "differential",
      speed: null,
      seat: "taken",
      faults: ["a"],
      truth: { wheel_base: 0.31, left_diameter: 0.1, right_diameter: 0.1 },
    },
  });
  const world = (t: number, x: number) => ({ world: { t, x, y: 0, theta: 179, pace: 0.99, broken: [], estop: false, pushed: false } });
  transport.world(world(1, 0.1));
  transport.world(world(1.04, 0.12));
  telemetry({ t: "1.060" });
  assert.ok(Math.abs(model.history.at("true_x", 0) - 0.13) < 1e-9, "between two moments and shortly behind them");
  telemetry({ t: "1.300" });
  assert.ok(Number.isNaN(model.history.at("true_x", 1)), "what is older is not the truth any more");
  assert.deepEqual([model.world?.robot, model.world?.speed, model.world?.truth?.wheelBase], ["default", undefined, 0.31]);
  const done = model.commands.world({ push: [5, 0, 0.1] });
  const refused = model.commands.world({ fault: "nonsense" });
  const silent = model.commands.world({ clear: true });
  assert.deepEqual(
    transport.requests.map((request) => JSON.parse(request)),
    [
      { id: 1, push: [5, 0, 0.1] },
      { id: 2, fault: "nonsense" },
      { id: 3, clear: true },
    ],
  );
  transport.world({ done: 1 });
  transport.world({ refused: 2, why: "no such fault" });
  await done;
  await assert.rejects(refused, /no such fault/);
  const told = assert.rejects(silent, /not answered/);
  await clock.pass(3100);
  await told;
});

test("a fix from the true pose has its noise by its seed, its variances and its age", async () => {
  const { clock, begin, model, transport, telemetry, heard } = bench();
  await begin();
  await assert.rejects(model.commands.observeTruth(0.01, 1, 1), /not known/);
  const fix = async (seed: number) => {
    transport.world({ world: { t: 1, x: 2, y: 3, theta: 45, pace: 1 } });
    await clock.pass(100);
    telemetry({ t: "1.090" });
    await model.commands.observeTruth(0.01, 2, seed);
    return (heard(0, "ObservePos").at(-1) ?? "").split(" ").map(Number);
  };
  const [, x = 0, y = 0, theta = 0, xx, xy, xt, yy, yt, tt, age] = await fix(5);
  assert.ok(Math.hypot(x - 2, y - 3) > 0 && Math.hypot(x - 2, y - 3) < 0.05 && Math.abs(theta - 45) < 10);
  assert.deepEqual([xx, xy, xt, yy, yt, tt], [0.0001, 0, 0, 0.0001, 0, 4]);
  // A tenth of a second since it was true, and what some eighty bytes take on the serial line.
  assert.ok(Math.abs((age ?? 0) - 0.107) < 0.002, `${age}`);
  assert.equal((await fix(5))[1], x);
  assert.notEqual((await fix(6))[1], x);
  await clock.pass(2000);
  await assert.rejects(model.commands.observeTruth(0.01, 2, 7), /too old/);
});

test("parameters: what was changed, saved, loaded, and learned", async () => {
  const { clock, base, begin, model } = bench();
  await begin();
  const gate = () => model.parameters.get("gate");
  await model.commands.setParameter("gate", "9");
  await clock.pass(100);
  assert.deepEqual([gate()?.value, gate()?.before, model.unsaved], [9, 25, true]);
  await model.commands.saveParameters();
  assert.deepEqual([gate()?.before, model.unsaved], [9, false]);
  base.parameters.set("gate", "16 0 1000 -");
  await model.commands.send("LoadParams");
  await clock.pass(100);
  assert.deepEqual([gate()?.value, gate()?.before, model.unsaved], [16, 16, false]);
  base.parameters.set("gate", "25 0 1000 -");
  await model.commands.send("ResetParams");
  await clock.pass(100);
  assert.deepEqual([gate()?.value, gate()?.before, model.unsaved], [25, 16, true]);
});

test("lines with a wrong check, or without one where one is required, are left out and counted", async () => {
  const { base, begin, model, transport, clock } = bench();
  await begin();
  const damaged = () => model.statistics.damagedLines;
  transport.hear("! fault stall*0000");
  assert.deepEqual([damaged(), model.status?.fault], [1, "none"]);
  base.parameters.set("require_crc", "1 0 1 -");
  await model.commands.send("ListParams");
  await clock.pass(10);
  transport.hear("! fault stall");
  assert.deepEqual([damaged(), model.status?.fault], [2, "none"]);
  transport.hear(wrap(1, "x").replace(/^.*$/, "! boot power-on"));
  assert.equal(model.parameters.get("require_crc"), undefined, "a base that has forgotten it is heard all the same");
});

test("lists are bounded, and what people said outlives the chatter", async () => {
  const { clock, begin, model, transport, telemetry } = bench();
  await begin();
  telemetry({ t: "1.000" });
  await model.commands.send("GetTime");
  const said = model.spoken.length;
  await clock.pass(300_000);
  assert.ok(model.spoken.length < 2100 && said > 0);
  assert.ok(model.spoken.some((line) => line.direction === "sent" && line.text.includes("GetTime")));
  assert.ok(model.estimates.length <= 4000);
  for (let event = 0; event < 5000; event += 1) transport.hear(`! turn done 0.0${event}`);
  assert.ok(model.spoken.length <= 2000);
});

test("garbage of any kind breaks nothing", async () => {
  const { clock, begin, model, transport, telemetry } = bench();
  await begin();
  const next = uniform(4242);
  const words = [
    "~",
    "!",
    "@1",
    "OK",
    "ERR",
    "Status",
    "EstPos",
    "Params",
    "Path",
    "Map",
    "3",
    "-1",
    "1e99",
    "NaN",
    "-",
    "idle",
    "path",
    "boot",
    "fault",
    "arc",
    "place",
    "*ABCD",
  ];
  for (let line = 0; line < 5000; line += 1) {
    const text = Array.from({ length: 1 + next() * 8 }, () => words[Math.floor(next() * words.length)]).join(next() < 0.9 ? " " : "");
    transport.hear(text);
    if (next() < 0.2) transport.world(next() < 0.5 ? { world: { t: "x" } } : [text]);
  }
  await clock.pass(10_000);
  telemetry({ t: "1.000", x: "0.125000" });
  assert.equal(model.history.at("x", model.history.length - 1), 0.125);
  assert.equal(await model.commands.send("GetTime"), "OK");
});

test("each listener is called at most once a frame, and one that fails does not keep others from it", async (context) => {
  const { clock, begin, model, telemetry } = bench();
  await begin();
  let calls = 0;
  context.mock.method(globalThis, "setTimeout", () => 0);
  model.subscribe(["history"], () => {
    throw new Error("a view");
  });
  const end = model.subscribe(["history", "status"], () => {
    calls += 1;
  });
  for (let at = 0; at < 10; at += 1) telemetry({ t: `${1 + at / 100}` });
  await clock.pass(50);
  assert.equal(calls, 1);
  end();
  telemetry({ t: "2.000" });
  await clock.pass(50);
  assert.equal(calls, 1);
});

test("a foreign stream without times tells no states and no pose, and does not keep them fresh", async () => {
  const { begin, model, transport, telemetry, clock, base } = bench();
  await begin();
  telemetry({ t: "1.000", x: "0.500000", y: "0.000000", theta: "0.00000", move_state: "HOLD", turn_state: "HOLD" });
  assert.equal(await model.commands.send("Stream 0.1 battery move_state"), "OK");
  base.answers.set("getstatus", ["Status MOVE HOLD enabled none"]);
  base.answers.set("getestpos", ["EstPos 0.750000 0.000000 0.00000 0 0 0 0 0 0"]);
  await clock.pass(300);
  const sampled = model.heardAt.telemetry ?? 0;
  for (let line = 0; line < 20; line += 1) {
    transport.hear("~ 12.000 HOLD");
    await clock.pass(100);
  }
  assert.equal(model.status?.moveState, "MOVE", "the last sample's state is not the base's");
  assert.equal(model.heardAt.telemetry, sampled);
  const age = (at: number | undefined) => clock.elapsed() - (at ?? 0);
  assert.ok(age(model.heardAt.states) <= 250 && age(model.heardAt.motors) <= 250 && age(model.heardAt.pose) <= 200);
  assert.equal(model.pose?.x, 0.75, "the base still answers where it is");
  assert.equal(base.heard.filter((line) => line.startsWith("Stream 0.02")).length, 1, "the telemetry that was asked for has not stopped");
  base.answers.set("getstatus", undefined);
  base.answers.set("getestpos", undefined);
  await clock.pass(2000);
  assert.ok(age(model.heardAt.states) >= 2000 && age(model.heardAt.pose) >= 2000);
});

test("a base that answers nothing is told from one that does, whatever telemetry says", async () => {
  const { begin, model, transport, telemetry, clock, base } = bench();
  await begin();
  assert.ok(!model.unresponsive);
  transport.base = () => [];
  for (let tick = 0; tick < 200; tick += 1) {
    telemetry({ t: `${1 + tick / 50}` });
    await clock.pass(20);
  }
  assert.ok(model.unresponsive && model.connection.state === "open");
  transport.base = base.reply;
  await clock.pass(1500);
  assert.ok(!model.unresponsive);
});

test("a base that no longer sends checks is heard again: told so, or learned from its telemetry", async () => {
  for (const told of [true, false]) {
    const { begin, model, telemetry, transport, clock, base } = bench();
    await begin();
    base.parameters.set("require_crc", "1 0 1 -");
    await model.commands.send("GetParam require_crc");
    telemetry({ t: "1.000" });
    assert.equal(model.history.length, 0, "without a check it is damaged");
    base.parameters.set("require_crc", "0 0 1 -");
    if (told) await model.commands.send("ResetParams");
    // One has come already.
    const lines = told ? 1 : 19;
    for (let line = 0; line < lines; line += 1) telemetry({ t: `${2 + line / 50}` });
    assert.equal(model.history.length, 1, `${told}`);
    transport.hear("! fault stall");
    assert.equal(model.status?.fault, "stall");
    await clock.pass(200);
    if (told) assert.equal(model.parameters.get("require_crc")?.value, 0);
  }
});

test("what may be another base is asked and stopped, and not driven until somebody says so", async () => {
  const { begin, model, transport, clock, base } = bench();
  await begin();
  transport.goes();
  transport.comes("drive", true);
  await clock.pass(200);
  assert.ok(model.connection.state === "open" && model.connection.another && !model.mayDrive);
  assert.ok(model.status !== undefined, "it may say what it is");
  let since = base.heard.length;
  await assert.rejects(model.commands.send("m 1"), /another base/);
  await assert.rejects(model.commands.goTo({ x: 1, y: 0, theta: undefined }), /another base/);
  assert.ok(base.heard.slice(since).every((line) => !MOVES.test(line)));
  model.commands.stop();
  assert.equal(base.heard.at(-1), "Stop");
  transport.goes();
  transport.comes("drive");
  await clock.pass(200);
  assert.ok(!model.mayDrive, "another cut makes it no better known");
  model.commands.confirmBase();
  since = base.heard.length;
  assert.equal(await model.commands.send("m 1"), "OK");
  assert.ok(model.mayDrive && base.heard.slice(since).includes("m 1"));
});
