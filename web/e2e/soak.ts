/**
 * The page for an hour (`SOAK_MINUTES`) at 50 Hz, the base driving all the time: what memory and frames do. Prints a table, writes out/soak.csv, and fails when
 * memory grows or the base stands still.
 */
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import type { CDPSession } from "playwright-core";
import { uniform } from "../src/model/random.ts";
import { type Frames, inFrames, Quantiles } from "./frames.ts";
import { ask, assertNoComplaints, connected, launch, open, type Page, shoot } from "./harness.ts";
import { serve, WEB } from "./simulator.ts";

const MINUTES = Number(process.env.SOAK_MINUTES ?? 60);
const SEED = Number(process.env.SOAK_SEED ?? 1);
const SAMPLE_S = 10;
const ROOM_M = 2;
/** Telemetry comes each 20 ms of the base's clock; it is printed in milliseconds. */
const STEP_S = 0.0215;
/** What memory may grow by from the second third of the run to the last: caches and lists fill up at their own times. */
const GROWTH = { share: 0.05, bytes: 2e6 };
/** By then all rings are full. */
const FULL_MINUTES = 20;

interface Sample {
  readonly minutes: number;
  readonly heap: number;
  readonly page: number;
  readonly server: number;
  readonly rows: number;
  readonly gaps: number;
  readonly longestGap: number;
  readonly faults: number;
}

function rss(pid: number): number {
  const kilobytes = /VmRSS:\s+(\d+) kB/.exec(readFileSync(`/proc/${pid}/status`, "utf8"))?.[1];
  return Number(kilobytes) * 1024;
}

/** Keeps the base driving: to one random place after another, with a Stop now and then; a fault is cleared and counted. */
class Driver {
  readonly #page: Page;
  readonly #next = uniform(SEED);
  faults = 0;
  orders = 0;
  stops = 0;
  refused = 0;

  constructor(page: Page) {
    this.#page = page;
  }

  async turn(): Promise<void> {
    const place = () => ROOM_M * (2 * this.#next() - 1);
    const what = this.#next();
    const { fault, idle, drives } = await ask(this.#page, (model) => ({
      fault: model.status?.fault,
      idle: model.path.mode === "idle" && model.status?.moveState === "HOLD" && model.status.turnState === "HOLD",
      drives: model.mayDrive,
    }));
    if (!drives) return;
    if (fault !== undefined && fault !== "none") {
      this.faults += 1;
      await this.#order("clearFault", undefined);
    }
    // One Stop in some twenty seconds.
    if (what < 0.025) {
      this.stops += 1;
      await ask(this.#page, (model) => model.commands?.stop());
    } else if (idle || what > 0.9) await this.#order("goTo", { x: place(), y: place(), theta: what > 0.95 ? 90 * place() : undefined });
  }

  async #order(what: "clearFault" | "goTo", goal: { x: number; y: number; theta: number | undefined } | undefined): Promise<void> {
    this.orders += 1;
    const reply = await ask(
      this.#page,
      (model, [order, to]) =>
        (order === "goTo" && to
          ? model.commands?.goTo({ x: to.x, y: to.y, theta: to.theta ?? undefined })
          : model.commands?.clearFault()
        )?.catch((error: Error) => `ERR ${error.message}`),
      [what, goal] as const,
    );
    if (reply !== "OK") this.refused += 1;
  }
}

/** What of the samples since the last look is missing: steps that are too long. */
async function gapsSince(page: Page, pushed: number): Promise<{ pushed: number; rows: number; gaps: number; longestGap: number }> {
  return ask(
    page,
    (model, [before, step]) => {
      const { history } = model;
      const fresh = Math.min(history.pushed - before, history.length - 1);
      let gaps = 0;
      let longestGap = 0;
      for (let at = history.length - fresh; at < history.length; at += 1) {
        const passed = history.at("t", at) - history.at("t", at - 1);
        if (passed > step) gaps += 1;
        longestGap = Math.max(longestGap, passed);
      }
      return { pushed: history.pushed, rows: history.length, gaps, longestGap };
    },
    [pushed, STEP_S] as const,
  );
}

async function heapOf(session: CDPSession): Promise<number> {
  await session.send("HeapProfiler.collectGarbage");
  const { metrics } = await session.send("Performance.getMetrics");
  return metrics.find((metric) => metric.name === "JSHeapUsedSize")?.value ?? Number.NaN;
}

function median(values: readonly number[]): number {
  return [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)] ?? Number.NaN;
}

const megabytes = (bytes: number) => (bytes / 1e6).toFixed(1);

/** Whether a column of the samples grows from the second third to the last. */
function growth(samples: readonly Sample[], of: "heap" | "server" | "page"): { text: string; grows: boolean } {
  const third = Math.floor(samples.length / 3);
  const middle = median(samples.slice(third, 2 * third).map((sample) => sample[of]));
  const last = median(samples.slice(2 * third).map((sample) => sample[of]));
  const all = samples.map((sample) => sample[of]);
  const text = `min ${megabytes(Math.min(...all))}, max ${megabytes(Math.max(...all))}, second third ${megabytes(middle)}, last third ${megabytes(last)} MB`;
  return { text, grows: last > middle * (1 + GROWTH.share) + GROWTH.bytes };
}

async function soak(): Promise<boolean> {
  const simulator = await serve();
  const browser = await launch("--enable-precise-memory-info");
  try {
    const page = await open(await browser.newContext({ viewport: { width: 1280, height: 800 } }), simulator.at);
    await connected(page, "drive");
    const session = await page.context().newCDPSession(page);
    await session.send("Performance.enable");
    const { processInfo } = await (await browser.newBrowserCDPSession()).send("SystemInfo.getProcessInfo");
    const renderers = processInfo.filter((process) => process.type === "renderer").map((process) => process.id);
    await page.evaluate(`const __name = (named) => named; (${inFrames})()`);

    const driver = new Driver(page);
    const samples: Sample[] = [];
    const work = new Quantiles();
    const intervals = new Quantiles();
    let { pushed } = await gapsSince(page, 0);
    const begun = Date.now();
    const begunAt = await ask(page, (model) => model.history.at("t", model.history.length - 1));
    console.log("  min   heap MB   page RSS MB   server RSS MB     rows   gaps  longest s   faults   work p95 ms   interval p95 ms");
    for (let next = SAMPLE_S; next <= MINUTES * 60; next += SAMPLE_S) {
      while (Date.now() - begun < next * 1000) {
        await driver.turn();
        await page.waitForTimeout(500);
      }
      const frames = (await page.evaluate("window.frames_.take()")) as Frames;
      for (const value of frames.work) work.add(value);
      for (const value of frames.intervals) intervals.add(value);
      const found = await gapsSince(page, pushed);
      pushed = found.pushed;
      const sample: Sample = {
        minutes: next / 60,
        heap: await heapOf(session),
        page: Math.max(...renderers.map(rss)),
        server: rss(simulator.pid),
        rows: found.rows,
        gaps: found.gaps,
        longestGap: found.longestGap,
        faults: driver.faults,
      };
      samples.push(sample);
      // The collection was ours, and so is the frame that it cost.
      await page.evaluate("window.frames_.take()");
      if (next % 60 === 0) {
        const cells: readonly (readonly [string, number])[] = [
          [sample.minutes.toFixed(0), 5],
          [megabytes(sample.heap), 9],
          [megabytes(sample.page), 13],
          [megabytes(sample.server), 15],
          [String(sample.rows), 8],
          [String(samples.slice(-6).reduce((sum, each) => sum + each.gaps, 0)), 6],
          [Math.max(...samples.slice(-6).map((each) => each.longestGap)).toFixed(3), 10],
          [String(sample.faults), 8],
          [work.at(0.95).toFixed(1), 13],
          [intervals.at(0.95).toFixed(1), 17],
        ];
        console.log(cells.map(([text, width]) => text.padStart(width)).join(" "));
      }
    }
    await shoot(page, "soak");
    const seconds = (Date.now() - begun) / 1000;
    const simulated = (await ask(page, (model) => model.history.at("t", model.history.length - 1))) - begunAt;
    return conclude(samples, driver, work, intervals, { seconds, simulated, lines: pushed });
  } finally {
    await browser.close();
    await simulator.end();
  }
}

function conclude(
  samples: readonly Sample[],
  driver: Driver,
  work: Quantiles,
  intervals: Quantiles,
  ran: { seconds: number; simulated: number; lines: number },
): boolean {
  mkdirSync(join(WEB, "out"), { recursive: true });
  const names = Object.keys(samples[0] ?? {}) as (keyof Sample)[];
  const rows = samples.map((sample) => names.map((name) => sample[name]).join(","));
  writeFileSync(join(WEB, "out/soak.csv"), `${names.join(",")}\n${rows.join("\n")}\n`);
  const isFull = MINUTES >= 3 * FULL_MINUTES;
  const heap = growth(samples, "heap");
  const server = growth(samples, "server");
  const gaps = samples.reduce((sum, sample) => sum + sample.gaps, 0);
  const rate = ran.lines / ran.seconds;
  const pace = ran.simulated / ran.seconds;
  console.log(
    [
      `${MINUTES} min, seed ${SEED}: ${driver.orders} orders (${driver.refused} refused or unanswered), ${driver.stops} Stops, ${driver.faults} faults cleared`,
      `telemetry: ${ran.lines} lines, ${rate.toFixed(2)} a second; ${gaps} steps above ${STEP_S} s, the longest ${Math.max(...samples.map((sample) => sample.longestGap)).toFixed(3)} s; simulated time at ${pace.toFixed(4)} of the wall clock's`,
      `page, heap after collection: ${heap.text}`,
      `page, RSS: ${growth(samples, "page").text}`,
      `server, RSS: ${server.text}`,
      `frames, work: ${work.text("ms")}`,
      `frames, interval: ${intervals.text("ms")}`,
      `a frame's work at the 95th percentile is ${work.at(0.95) < 16 ? "under" : "NOT under"} 16 ms`,
      isFull ? "" : `shorter than ${3 * FULL_MINUTES} min: the rings fill up in it, and growth is not judged`,
    ]
      .filter((line) => line !== "")
      .join("\n"),
  );
  const failures = [
    isFull && heap.grows && "the page's heap grows",
    isFull && server.grows && "the server's memory grows",
    // A move to a random place in the room takes some ten seconds.
    driver.orders < ran.seconds / 30 && "the base has hardly been driven",
    rate < 49 && "telemetry is slower than 49 lines a second",
  ].filter((failure) => failure !== false);
  for (const failure of failures) console.log(`FAILED: ${failure}`);
  return failures.length === 0;
}

const passed = await soak();
assertNoComplaints();
process.exitCode = passed ? 0 : 1;
