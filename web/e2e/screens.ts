/** Makes the picture of the READMEs, ../docs/page.png: a tour of three places and back, and half of a curved path, on a base whose wheels are not what its drawing says. */
import assert from "node:assert/strict";
import { join } from "node:path";
import { ask, assertNoComplaints, connected, launch, open, type Page, part, rest, until } from "./harness.ts";
import { serve, WEB } from "./simulator.ts";

const PICTURE = join(WEB, "../docs/page.png");
/** Bounds that fit this base, as in map.script: circles that tell places apart. */
const BOUNDS = ["SetParam bound_turn 3", "SetParam bound_turn_per_m 0.4", "SetParam bound_dist_rel 0.02"];
/** The left half of an eight: from the door to the desk, to the window and back. */
const TOUR = [
  ["GoTo -0.9 0.45", "Mark desk 0.15"],
  ["GoTo -0.9 -0.45", "Mark window 0.15"],
  ["GoTo 0 0", "Mark door"],
] as const;
/** The right half. */
const CURVE = ["0.459 0.424", "0.849 0.600", "1.109 0.424", "1.200 0.000", "1.109 -0.424", "0.849 -0.600", "0.459 -0.424", "0 0 180"];
/** The picture is taken when this posture of it is behind the base: what is driven and what is left are both seen. */
const TAKEN_AT = 5;
const LEG_MS = 60_000;

async function say(page: Page, line: string): Promise<void> {
  const reply = await ask(page, (model, order) => model.commands?.send(order), line);
  assert.doesNotMatch(reply ?? "ERR", /^ERR/, line);
}

/** So many postures of the curve are behind the base. */
const passed = (page: Page, postures: number) =>
  until(
    page,
    `posture ${postures}`,
    (model, left) => model.path.mode === "path" && model.path.postures.length <= left,
    CURVE.length - postures,
    LEG_MS,
  );

const heard = (page: Page, event: string, times: number) =>
  until(
    page,
    event,
    (model, [wanted, count]) =>
      model.spoken.filter(({ direction, text }) => direction === "heard" && text.startsWith(wanted)).length >= count,
    [event, times] as const,
    LEG_MS,
  );

async function drive(page: Page): Promise<void> {
  for (const line of [...BOUNDS, "Mark door 0.15"]) await say(page, line);
  for (const [leg, [goal, mark]] of TOUR.entries()) {
    await say(page, goal);
    await heard(page, "! path done", leg + 1);
    await rest(page);
    await say(page, mark);
  }
  await until(page, "three places", (model, all) => model.map?.places.filter((place) => place.pose).length === all, TOUR.length);
  for (const posture of CURVE) await say(page, `Follow ${posture}`);
  await say(page, "Follow start");
}

const simulator = await serve(0, "--robot", "uncalibrated", "--seed", "1");
const browser = await launch();
try {
  const look = { viewport: { width: 1280, height: 800 }, colorScheme: "light", reducedMotion: "reduce", locale: "en-GB" } as const;
  const page = await open(await browser.newContext(look), simulator.at);
  await connected(page, "drive");
  await drive(page);
  await passed(page, TAKEN_AT - 1);
  await part(page, "topview").getByRole("button", { name: "Fit" }).click();
  // Nothing is under the pointer, and nothing has the focus.
  await page.mouse.move(0, 0);
  await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
  await passed(page, TAKEN_AT);
  await page.waitForFunction(() => new Promise((painted) => requestAnimationFrame(() => requestAnimationFrame(() => painted(true)))));
  await page.screenshot({ path: PICTURE });
  assert.equal(await ask(page, (model) => model.status?.fault), "none");
  assertNoComplaints();
} finally {
  await browser.close();
  await simulator.end();
}
