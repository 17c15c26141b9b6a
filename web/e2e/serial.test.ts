/** The static page, opened as a file, with a base behind Web Serial: a stand-in for `navigator.serial` whose far end is the simulator's pseudo-terminal. */
import assert from "node:assert/strict";
import { join } from "node:path";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { pathToFileURL } from "node:url";
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
  type Page,
  part,
  rest,
  sent,
  shoot,
  type,
  until,
} from "./harness.ts";
import { pty, type Simulator, WEB } from "./simulator.ts";
import { type Cable, standIn } from "./standin.ts";

const FILE = pathToFileURL(join(WEB, "dist/index.html")).href;

let browser: Browser;
let context: BrowserContext;
let simulator: Simulator;
let cable: Cable | undefined;

before(async () => {
  browser = await launch();
});
beforeEach(async () => {
  simulator = await pty();
  context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
});
afterEach(async () => {
  cable?.end();
  cable = undefined;
  try {
    await context.close();
  } finally {
    await simulator.end();
  }
  assertNoComplaints();
});
after(() => browser.close());

/** The page with the stand-in, connected by the button. */
async function plugIn(): Promise<Page> {
  const page = await context.newPage();
  cable = await standIn(page, simulator.at);
  await open(context, FILE, page);
  await part(page, "tab-connection").click();
  await part(page, "connect-serial").click();
  await connected(page, "drive");
  return page;
}

test("a page that is opened as a file has Web Serial, and offers it", async () => {
  const page = await open(context, FILE);
  assert.equal(await page.evaluate(() => window.isSecureContext), true);
  assert.equal(await page.evaluate(() => "serial" in navigator && typeof navigator.serial.requestPort), "function");
  await part(page, "tab-connection").click();
  assert.ok(await part(page, "connect-serial").isVisible());
  assert.equal(await ask(page, (model) => model.connection.state), "none");
  await shoot(page, "static");
});

test("type a move and see it; click a goal; stop by the space bar", async () => {
  const page = await plugIn();
  await drives.typeAndSeeItMove(page, "serial");
  await drives.clickAndStopByTheSpaceBar(page, "serial");
  await drives.spaceRightAfterEnter(page);
  await drives.shiftClickAddsPostures(page);
  assert.equal(cable?.written.startsWith("\n@"), true, "an empty line comes first");
  assert.equal(await ask(page, (model) => model.statistics.damagedLines), 0);
});

test("unplugged in mid-motion and plugged in again: it comes back by itself and sends nothing that moves", async () => {
  const page = await plugIn();
  await type(page, "m 3 0.2");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  await cable?.unplug();
  await until(page, "lost", (model) => model.connection.state === "lost");
  const before = await now(page, "x");
  await shoot(page, "unplugged");
  await page.waitForTimeout(1500);
  await cable?.plug();
  await connected(page, "drive");
  assert.equal((await sent(page)).filter((line) => MOVES.test(line)).length, 1);
  await until(page, "it goes on to its target", (model, x) => model.history.at("x", model.history.length - 1) > x + 0.2, before);
  await page.keyboard.press(" ");
  await rest(page);
});

test("a Stop that is pressed while the cable is out is the first order when it is in again", async () => {
  const page = await plugIn();
  await type(page, "m 3 0.2");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  await cable?.unplug();
  await until(page, "lost", (model) => model.connection.state === "lost");
  await page.keyboard.press(" ");
  await part(page, "alarm").waitFor();
  const before = cable?.written.length ?? 0;
  await cable?.plug();
  await connected(page, "drive");
  await rest(page);
  const [empty, first] = (cable?.written.slice(before) ?? "").split("\n");
  assert.equal(empty, "");
  assert.match(first ?? "", /^@\d+ Stop\*/);
  assert.ok((await now(page, "x")) < 2);
  await until(page, "no alarm", (model) => model.alarm === undefined);
});

test("what comes back as another device is asked and can be stopped; it is driven when somebody says so", async () => {
  const page = await plugIn();
  await type(page, "m 3 0.2");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  await cable?.unplug();
  await until(page, "lost", (model) => model.connection.state === "lost");
  await cable?.plug(true);
  await connected(page, "drive");
  await part(page, "another-base").waitFor();
  await shoot(page, "another-base");
  await type(page, "m 0.1 0.2");
  await page.keyboard.press("Escape");
  await page.keyboard.press(" ");
  await rest(page);
  assert.equal((await sent(page)).filter((line) => MOVES.test(line)).length, 1, "only what was asked for before");
  await part(page, "drive-it").click();
  await part(page, "another-base").waitFor({ state: "hidden" });
  const before = await now(page, "x");
  await type(page, "m 0.1 0.2");
  await until(page, "it moves", (model, x) => model.history.at("x", model.history.length - 1) > x + 0.08, before);
  await rest(page);
});

test("a cable that flaps: it comes back, nothing that moves is sent again, and Stop works", async () => {
  const page = await plugIn();
  await type(page, "m 3 0.2");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  for (let flap = 0; flap < 10; flap += 1) {
    await cable?.unplug();
    if (flap % 3 === 0) await page.waitForTimeout(40 * flap);
    await cable?.plug();
    if (flap % 2 === 0) await page.waitForTimeout(30 * flap);
  }
  await connected(page, "drive");
  assert.equal((await sent(page)).filter((line) => MOVES.test(line)).length, 1);
  await page.keyboard.press(" ");
  await rest(page);
  assert.ok((await now(page, "x")) < 3);
});

test("a page that is left lets go of the port: the base's deadman stops what has no end", async () => {
  const page = await plugIn();
  await type(page, "m inf 0.2");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  await part(page, "tab-connection").click();
  await part(page, "disconnect").click();
  await until(page, "no connection", (model) => model.connection.state === "none");
  // A second of deadman, and the stop.
  await page.waitForTimeout(2000);
  await part(page, "connect-serial").click();
  await connected(page, "drive");
  await until(page, "it has stopped itself", (model) => model.status?.fault === "link");
  assert.ok(
    (await sent(page)).every((line) => !MOVES.test(line)),
    "another connection is another conversation",
  );
});
