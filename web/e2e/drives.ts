/**
 * What a user does to see a base drive, in a real browser: the same whether the page reaches the base through a WebSocket or through Web Serial. The base stands
 * still and has no fault when this begins.
 */
import assert from "node:assert/strict";
import { ask, now, type Page, painted, part, rest, sent, shoot, type, until } from "./harness.ts";

/** Of the top view at first. */
const PIXELS_PER_METRE = 140;

export async function typeAndSeeItMove(page: Page, pictures: string): Promise<void> {
  const start = await now(page, "x");
  const before = { way: await painted(page, "topview", "est"), move: await painted(page, "strip-states", "move") };
  await type(page, "m 1 0.3");
  await until(page, "ACCEL", (model) => model.status?.moveState === "ACCEL");
  await until(page, "MOVE", (model) => model.status?.moveState === "MOVE");
  assert.ok(Math.abs((await now(page, "v_s")) - 0.3) < 0.03, "0.3 m/s is what was asked for");
  await shoot(page, `${pictures}-moving`);
  await until(page, "move done", (model) => model.spoken.some((line) => line.text.startsWith("! move done")));
  await assertTruth(page);
  // 2 mm: twice the tolerance within which a move is done.
  assert.ok(Math.abs((await now(page, "x")) - start - 1) < 0.002, `it is ${(await now(page, "x")) - start} m further`);
  const after = { way: await painted(page, "topview", "est"), move: await painted(page, "strip-states", "move") };
  assert.ok(after.way.width - before.way.width > 0.4 * PIXELS_PER_METRE, `the way is drawn: ${JSON.stringify([before.way, after.way])}`);
  // Some three seconds of MOVE in a strip of thirty are 46 pixels by 22; the ground of its word alone is 360 of these.
  assert.ok(after.move.pixels > before.move.pixels + 700, `the band is drawn: ${JSON.stringify([before.move, after.move])}`);
  for (const state of ["accel", "deccel"])
    assert.ok((await painted(page, "strip-states", state)).pixels > 50, `the band ${state} is drawn`);
  assert.match((await part(page, "console-log").textContent()) ?? "", /m 1 0\.3[\s\S]*! move done/);
  await shoot(page, `${pictures}-moved`);
}

/** In the simulator the base is truly where it says; a pseudo-terminal tells nothing of the truth. */
async function assertTruth(page: Page): Promise<void> {
  const known = await ask(page, (model) => model.world !== undefined);
  if (!known) return;
  await until(page, "the true pose is at the estimate", ({ world, history }) => {
    const at = history.length - 1;
    // The robot has the wheels of its drawing. What is left is slip, and noise of its encoders.
    return world !== undefined && Math.hypot(world.pose.x - history.at("x", at), world.pose.y - history.at("y", at)) < 0.01;
  });
}

/** Clicks on the top view, off its middle by so many pixels. */
export async function clickGoal(page: Page, dx: number, dy: number, modifiers: "Shift"[] = []): Promise<void> {
  const canvas = part(page, "topview").locator("canvas").first();
  const box = await canvas.boundingBox();
  assert.ok(box);
  await canvas.click({ position: { x: box.width / 2 + dx, y: box.height / 2 + dy }, modifiers });
}

export async function clickAndStopByTheSpaceBar(page: Page, pictures: string): Promise<void> {
  await clickGoal(page, 60, -110);
  await until(page, "the path to where was clicked", (model) => model.path.mode === "path" && model.path.postures.length === 1);
  const goal = await ask(page, (model) => model.path.postures[0]);
  // It has driven along y = 0, which is still the middle; 5 mm are less than a pixel.
  assert.ok(Math.abs((goal?.y ?? Number.NaN) - 110 / PIXELS_PER_METRE) < 0.005, `what is above on the page is so on the floor: ${goal?.y}`);
  await until(page, "it drives there", (model) => model.status?.moveState === "MOVE" || model.status?.turnState === "MOVE");
  await shoot(page, `${pictures}-goal`);
  await until(page, "it is on its way", (model) => model.history.at("v_s", model.history.length - 1) > 0.1);
  await page.keyboard.press(" ");
  await until(page, "the Stop is answered", (model) => model.spoken.some((line) => line.text.startsWith("! stop command")));
  await rest(page);
  const [x, y] = [await now(page, "x"), await now(page, "y")];
  assert.ok(goal && Math.hypot(goal.x - x, goal.y - y) > 0.05, "it was stopped on its way");
  assert.equal(await ask(page, (model) => model.alarm), undefined);
  await shoot(page, `${pictures}-stopped`);
}

export async function spaceRightAfterEnter(page: Page): Promise<void> {
  await page.waitForTimeout(300);
  const before = await now(page, "x");
  const y = await now(page, "y");
  await type(page, "m 1 0.3");
  // The field has the focus still, and is empty: the space bar stops.
  await page.keyboard.press(" ");
  await until(page, "rest", (model) => model.spoken.filter((line) => line.text.startsWith("! stop command")).length >= 1);
  await rest(page);
  const orders = (await sent(page)).filter((line) => line === "m 1 0.3" || line === "Stop");
  assert.deepEqual(orders.slice(-2), ["m 1 0.3", "Stop"]);
  assert.ok(Math.hypot((await now(page, "x")) - before, (await now(page, "y")) - y) < 0.1, "it has hardly begun");
  // In a text that has begun it types a blank.
  await part(page, "command-input").fill("m");
  await page.keyboard.press(" ");
  assert.equal(await part(page, "command-input").inputValue(), "m ");
  await page.keyboard.press("Escape");
  assert.equal(await part(page, "command-input").inputValue(), "");
}

export async function shiftClickAddsPostures(page: Page): Promise<void> {
  // Postures that a Stop has left would be driven to first.
  await type(page, "Follow clear");
  await until(page, "nothing is left", (model) => model.path.postures.length === 0);
  await clickGoal(page, 50, 40, ["Shift"]);
  await until(page, "the first posture is driven to", (model) => model.path.mode === "path" && model.path.postures.length === 1);
  await clickGoal(page, -60, 50, ["Shift"]);
  await until(page, "two postures", (model) => model.path.postures.length === 2);
  const [first, second] = await ask(page, (model) => model.path.postures);
  assert.ok(first && second && first.x - second.x > 0.5, `the first is to the right of the second: ${JSON.stringify([first, second])}`);
  // A finger has no Shift, and who drives by keys alone has no pointer.
  await part(page, "add-postures").click();
  await clickGoal(page, -60, -50, []);
  await until(page, "three postures", (model) => model.path.postures.length === 3);
  await part(page, "add-postures").click();
  await page.locator("canvas.topview-canvas").focus();
  for (const key of ["g", "ArrowUp", "Enter", "Shift+Enter"]) await page.keyboard.press(key);
  await until(page, "four postures", (model) => model.path.postures.length === 4);
  await part(page, "stop").click();
  await until(page, "the path is ended", (model) => model.path.mode === "idle");
  await rest(page);
  await type(page, "Follow clear");
  await until(page, "no postures", (model) => model.path.postures.length === 0);
}
