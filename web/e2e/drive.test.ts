/** The page that the simulator serves, in a real browser. */
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { after, afterEach, before, beforeEach, test } from "node:test";
import * as drives from "./drives.ts";
import {
  ask,
  assertNoComplaints,
  type Browser,
  type BrowserContext,
  connected,
  launch,
  MOVES,
  now,
  open,
  part,
  rest,
  sent,
  shoot,
  type,
  until,
} from "./harness.ts";
import { type Between, proxy } from "./proxy.ts";
import { type Simulator, serve, trace, WEB } from "./simulator.ts";

let browser: Browser;
let context: BrowserContext;
let simulator: Simulator;

before(async () => {
  browser = await launch();
});
beforeEach(async () => {
  simulator = await serve();
  context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
});
afterEach(async () => {
  try {
    await context.close();
  } finally {
    await simulator.end();
  }
  assertNoComplaints();
});
after(() => browser.close());

test("type a move and see it; click a goal; stop by the space bar", async () => {
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  await drives.typeAndSeeItMove(page, "drive");
  await drives.clickAndStopByTheSpaceBar(page, "drive");
  await drives.spaceRightAfterEnter(page);
  await drives.shiftClickAddsPostures(page);
});

test("the space bar stops from a button, too, and does not press it", async () => {
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  await type(page, "m inf 0.2");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  await part(page, "disable").focus();
  await page.keyboard.press(" ");
  await rest(page);
  assert.equal(await ask(page, (model) => model.status?.enabled), true);
  assert.ok(!(await sent(page)).includes("Disable"));
});

test("a page that is reloaded in mid-motion drives on from there: it sends nothing that moves, and Stop works", async () => {
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  await type(page, "m 3 0.2");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  const before = await now(page, "x");
  await page.reload();
  await connected(page, "drive");
  await until(page, "it still moves", (model) => model.status?.moveState === "MOVE");
  assert.ok((await now(page, "x")) > before, "its estimate goes on");
  assert.ok((await sent(page)).every((line) => !MOVES.test(line)));
  await shoot(page, "reloaded");
  await part(page, "stop").click();
  await rest(page);
  assert.ok((await now(page, "x")) < 2.5);
});

test("two pages: the second watches, and takes the seat when the first has left", async () => {
  const first = await open(context, simulator.at);
  await connected(first, "drive");
  const second = await open(context, simulator.at);
  await until(second, "it watches", (model) => model.connection.state === "open" && model.connection.role === "watch");
  await connected(second, "watch");
  await first.bringToFront();
  await type(first, "m 0.3 0.3");
  await until(second, "the watcher sees it move", (model) => model.status?.moveState === "MOVE");
  await second.bringToFront();
  assert.ok(await part(second, "take-seat").isDisabled());
  await type(second, "m 1");
  await second.keyboard.press(" ");
  await shoot(second, "watcher");
  assert.ok(!(await sent(second)).includes("Stop"), "what a watcher presses reaches nobody, and it is told so");
  assert.match((await part(second, "alarm").textContent()) ?? "", /only watches/);
  await until(first, "done", (model) => model.spoken.some((line) => line.text.startsWith("! move done")));
  await first.close();
  await part(second, "take-seat").click({ timeout: 5000 });
  await connected(second, "drive");
  await type(second, "m 0.1 0.2");
  await until(second, "it drives", (model) => model.spoken.some((line) => line.text.startsWith("! move done")));
});

test("the server is killed: the page says so, shows what it last knew as old, and comes back by itself when there is one again", async () => {
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  await type(page, "m 0.2 0.2");
  await until(page, "done", (model) => model.spoken.some((line) => line.text.startsWith("! move done")));
  const { port } = new URL(simulator.at);
  await simulator.end();
  await until(page, "lost", (model) => model.connection.state === "lost");
  await page.keyboard.press(" ");
  await part(page, "alarm").waitFor();
  await shoot(page, "lost");
  assert.equal(await ask(page, (model) => model.mayDrive), false);
  const before = (await sent(page)).length;
  simulator = await serve(Number(port));
  await connected(page, "drive");
  const since = (await sent(page)).slice(before);
  assert.equal(since[0], "Stop", "what was asked for last comes first");
  assert.ok(since.every((line) => !MOVES.test(line)));
  await until(page, "no alarm", (model) => model.alarm === undefined);
  assert.ok(Math.abs(await now(page, "x")) < 0.01, "a new base stands where it began, and nothing of the old one is shown");
});

async function through(run: (between: Between) => Promise<void>): Promise<void> {
  const between = await proxy(simulator.at);
  try {
    await run(between);
  } finally {
    await between.end();
  }
}

test("a network that falls silent: the base stops itself, and the page says that it is not heard", () =>
  through(async (between) => {
    const page = await open(context, between.url);
    await connected(page, "drive");
    await type(page, "m inf 0.2");
    await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
    const mutedAt = Date.now();
    between.mute(true);
    await page.keyboard.press(" ");
    await until(page, "the alarm", (model) => model.alarm !== undefined, undefined, 3000);
    await shoot(page, "silent-alarm");
    await until(page, "lost", (model) => model.connection.state === "lost" || model.connection.state === "connecting", undefined, 6000);
    const noticed = Date.now() - mutedAt;
    assert.ok(noticed < 5000, `silence is noticed after 3 s, and it was ${noticed} ms`);
    await shoot(page, "silent-lost");
    // The server gives a silent driver up within 7 s, and the base's deadman takes a second.
    await page.waitForTimeout(8000);
    between.mute(false);
    between.cut();
    await connected(page, "drive");
    await until(page, "it has stopped itself", (model) => model.status?.fault === "link" && model.status.moveState === "HOLD");
    assert.ok((await sent(page)).filter((line) => MOVES.test(line)).length === 1);
    await shoot(page, "silent-after");
    await part(page, "clear-fault").click();
    await until(page, "no fault", (model) => model.status?.fault === "none");
  }));

test("a connection that is cut comes back as the driver's within seconds, and a motion with an end goes on", () =>
  through(async (between) => {
    const page = await open(context, between.url);
    await connected(page, "drive");
    await type(page, "m 2 0.3");
    await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
    between.cut();
    await until(page, "lost", (model) => model.connection.state === "lost");
    await connected(page, "drive");
    await until(page, "it has gone on", (model) => model.history.at("x", model.history.length - 1) > 1.9);
    assert.equal((await sent(page)).filter((line) => MOVES.test(line)).length, 1);
  }));

test("a fault is told with its cause, and cleared; what is broken in the world is mended there", async () => {
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  await part(page, "tab-world").click();
  await ask(page, (model) => model.commands?.world({ fault: "left encoder stuck" }));
  await type(page, "m 1 0.3");
  await part(page, "banner").waitFor();
  await until(page, "the fault", (model) => model.status?.fault !== "none");
  assert.match((await part(page, "fault-name").textContent()) ?? "", /no-motion|encoder-stuck/);
  await shoot(page, "fault");
  await ask(page, (model) => model.commands?.world({ clear: true }));
  await part(page, "clear-fault").click();
  await until(page, "no fault", (model) => model.status?.fault === "none");
  await part(page, "banner").waitFor({ state: "hidden" });
  await type(page, "m 0.2 0.3");
  await until(page, "it drives again", (model) => model.spoken.some((line) => line.text.startsWith("! move done")));
});

test("the power is switched off and on: all is asked anew, and nothing moves by itself", async () => {
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  await type(page, "m 3 0.3");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  const before = (await sent(page)).length;
  await ask(page, (model) => model.commands?.world({ power: "cycle" }));
  await until(page, "a new start", (model) => model.history.length > 10 && model.history.at("t", 0) < 2);
  await connected(page, "drive");
  await rest(page);
  assert.ok((await sent(page)).slice(before).every((line) => !MOVES.test(line)));
});

test("a trace is loaded and scrubbed through, while Stop goes on to reach the base that is live", async () => {
  const file = join(WEB, "out/square.csv");
  mkdirSync(join(WEB, "out"), { recursive: true });
  trace("square.script", file);
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  await type(page, "m inf 0.2");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  await part(page, "tab-connection").click();
  await part(page, "load-log").setInputFiles(file);
  await page.waitForFunction(() => window.page.model.kind === "log");
  assert.equal(await page.evaluate(() => window.page.model.history.length), 2102);
  await part(page, "scrubber").focus();
  await page.keyboard.press("Home");
  await page.waitForFunction(() => (window.page.model.cursor.t ?? 99) < 0.1);
  await shoot(page, "log-begin");
  for (let press = 0; press < 10; press += 1) await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() => (window.page.model.cursor.t ?? 0) > 0);
  await page.keyboard.press("End");
  await shoot(page, "log");
  // On the slider, which the space bar does not move.
  await page.keyboard.press(" ");
  await rest(page);
  await part(page, "tab-connection").click();
  await part(page, "close-log").click();
  await page.waitForFunction(() => window.page.model.kind === "live");
});

test("a file that is no log is refused with what is wrong, and the live base stays in view", async () => {
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  await part(page, "tab-connection").click();
  const lines = "t,left,right\n0,0,0\n0.1,many,100\n";
  await part(page, "load-log").setInputFiles({ name: "bad.csv", mimeType: "text/csv", buffer: Buffer.from(lines) });
  await part(page, "log-state").filter({ hasText: "line 3: column `left`: `many` is not a number" }).waitFor();
  assert.equal(await page.evaluate(() => window.page.model.kind), "live");
});
