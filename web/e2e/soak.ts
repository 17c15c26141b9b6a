/**
 * The page and its server for SOAK_MINUTES (60), telemetry at 50 Hz, the base driving all the time: is memory bounded, are frames in time, is every line of
 * telemetry there? Prints a row a minute and fails if one of these is not so. Frame times depend on the machine, and are told, not judged, unless SOAK_FRAME_MS is set.
 */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import type { Pose } from "../src/model/model.ts";
import { connected, launch, open, shoot } from "./harness.ts";
import { serve } from "./simulator.ts";

const MINUTES = Number(process.env.SOAK_MINUTES ?? 60);
const SEED = Number(process.env.SOAK_SEED ?? 1);
const LIMIT_MS = process.env.SOAK_FRAME_MS === undefined ? undefined : Number(process.env.SOAK_FRAME_MS);
/** The history holds 20 minutes; from then on nothing may grow. */
const FULL_AFTER_MIN = Math.min(22, MINUTES / 2);
/** What a sawtooth between collections and a change of what is drawn may add. */
const [MAY_GROW, MAY_ADD_MB] = [0.05, 2];
const ARENA_M = 1.5;
/** The time between two rows of telemetry, and what is a gap in them, s. */
const [STEP, GAP] = [0.02, 0.0215];

interface Row {
  readonly minute: number;
  readonly heapMb: number;
  readonly rendererMb: number;
  readonly serverMb: number;
}

/** Runs in the page before its own scripts: how long each frame's work takes, from its beginning to what comes after its painting, and how far frames are apart. */
const WATCH_FRAMES = `{
  const frames = { work: [], apart: [] };
  const { port1, port2 } = new MessageChannel();
  let began = 0;
  let last = 0;
  port2.onmessage = () => frames.work.push(performance.now() - began);
  const look = (due) => {
    requestAnimationFrame(look);
    if (last > 0) frames.apart.push(due - last);
    last = due;
    began = performance.now();
    port1.postMessage(0);
  };
  requestAnimationFrame(look);
  window.takeFrames = () => ({ work: frames.work.splice(0), apart: frames.apart.splice(0) });
}`;

/** Numbers in [0, 1), the same for the same seed (mulberry32). */
function random(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}

function quantile(values: readonly number[], share: number): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? Number.NaN;
}

const quantiles = (values: readonly number[]) => [0.5, 0.95, 0.99, 1].map((share) => quantile(values, share).toFixed(1)).join(" ");

function rssMb(pid: number): number {
  const found = /VmRSS:\s+(\d+) kB/.exec(readFileSync(`/proc/${pid}/status`, "utf8"))?.[1];
  return Number(found) / 1024;
}

const simulator = await serve(0, "--robot", "uncalibrated");
const browser = await launch();
try {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
  await context.addInitScript({ content: WATCH_FRAMES });
  const page = await open(context, simulator.at);
  await connected(page, "drive");
  const session = await context.newCDPSession(page);
  await session.send("Performance.enable");
  const system = await browser.newBrowserCDPSession();
  const { processInfo } = await system.send("SystemInfo.getProcessInfo");
  const renderers = processInfo.filter((each) => each.type === "renderer").map((each) => each.id);

  const draw = random(SEED);
  const rows: Row[] = [];
  const work: number[] = [];
  const apart: number[] = [];
  let [orders, stops, faults, refused, gaps, samples, seen] = [0, 0, 0, 0, 0, 0, 0];
  let pose: Pose | undefined;
  let way = 0;
  const began = Date.now();
  const minutes = () => (Date.now() - began) / 60_000;
  console.log(`${MINUTES} min, seed ${SEED}`);
  console.log("minute  heap MB  renderer MB  server MB  work of a frame, ms: p50 p95 p99 max    apart: p50 p95 p99 max");
  let nextRow = 1;
  while (minutes() < MINUTES) {
    const goal = { x: (draw() * 2 - 1) * ARENA_M, y: (draw() * 2 - 1) * ARENA_M, theta: draw() < 0.5 ? draw() * 360 - 180 : undefined };
    const stop = draw() < 0.1;
    const mark = draw() < 0.05 ? Math.floor(draw() * 12) : undefined;
    const told = await page.evaluate(
      async ({ goal, stop, mark, since }) => {
        const model = window.page.live;
        const { commands, history, status } = model;
        let [faults, refused] = [0, 0];
        if (status && status.fault !== "none") {
          faults = 1;
          await commands?.clearFault().catch(() => {});
        }
        if (stop) commands?.stop();
        else await commands?.goTo(goal).catch(() => refused++);
        if (mark !== undefined) await commands?.send(`Mark place${mark}`).catch(() => {});
        // What came since the last look.
        const fresh = Math.min(history.pushed - since, history.length - 1);
        const times: number[] = [];
        for (let at = history.length - fresh; at < history.length; at++) times.push(history.at("t", at) - history.at("t", at - 1));
        const last = history.length - 1;
        const pose = { x: history.at("x", last), y: history.at("y", last), theta: history.at("theta", last) };
        return { faults, refused, times, pushed: history.pushed, pose, kept: history.length };
      },
      { goal, stop, mark, since: seen },
    );
    if (stop) stops++;
    else orders++;
    faults += told.faults;
    refused += told.refused;
    samples += told.times.length;
    gaps += told.times.filter((step) => step > GAP).length;
    seen = told.pushed;
    if (pose) way += Math.hypot(told.pose.x - pose.x, told.pose.y - pose.y);
    pose = told.pose;
    await page.waitForTimeout(1000 + draw() * 3000);
    if (minutes() < nextRow) continue;
    const frames = await page.evaluate("window.takeFrames()").then((each) => each as { work: number[]; apart: number[] });
    work.push(...frames.work);
    apart.push(...frames.apart);
    await session.send("HeapProfiler.collectGarbage");
    const { metrics } = await session.send("Performance.getMetrics");
    const heap = metrics.find((metric) => metric.name === "JSHeapUsedSize")?.value ?? Number.NaN;
    const row = {
      minute: minutes(),
      heapMb: heap / 2 ** 20,
      rendererMb: Math.max(...renderers.map(rssMb)),
      serverMb: rssMb(simulator.pid),
    };
    rows.push(row);
    const figures = [row.minute.toFixed(1).padStart(6), row.heapMb.toFixed(2), row.rendererMb.toFixed(0), row.serverMb.toFixed(2)];
    console.log(`${figures.join("  ")}  ${quantiles(frames.work)}   ${quantiles(frames.apart)}`);
    // The frame in which memory was collected is not the page's.
    await page.evaluate("window.takeFrames()");
    nextRow = Math.floor(minutes()) + 1;
  }
  await shoot(page, "soak");

  console.log(`work of a frame, ms (p50 p95 p99 max): ${quantiles(work)}; apart: ${quantiles(apart)}; ${work.length} frames`);
  console.log(
    `telemetry: ${samples} lines of ${STEP} s, ${gaps} gaps; ${orders} goals, ${stops} stops, ${refused} refused, ${faults} faults, at least ${way.toFixed(0)} m`,
  );
  const full = rows.filter((row) => row.minute >= FULL_AFTER_MIN);
  const [early, late] = [full.slice(0, Math.ceil(full.length / 2)), full.slice(Math.floor(full.length / 2))];
  for (const key of ["heapMb", "rendererMb", "serverMb"] as const) {
    const [before, after] = [early, late].map((part) => Math.max(...part.map((row) => row[key])));
    assert.ok(before !== undefined && after !== undefined);
    console.log(
      `${key}: at most ${before.toFixed(2)} in the first half of what came after minute ${FULL_AFTER_MIN}, ${after.toFixed(2)} in the second`,
    );
    assert.ok(after <= before * (1 + MAY_GROW) + MAY_ADD_MB, `${key} grows`);
  }
  assert.ok(samples > MINUTES * 60 * 49, "telemetry has stopped");
  assert.ok(way > MINUTES, "the base does not drive");
  if (LIMIT_MS !== undefined) assert.ok(quantile(work, 0.95) < LIMIT_MS, "frames take too long");
} finally {
  await browser.close();
  await simulator.end();
}
