import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import type { Channel, History } from "../src/model/model.ts";
import { type Band, Runs } from "../src/views/strips/bands.ts";
import { Pyramid } from "../src/views/strips/pyramid.ts";
import { closeRange, niceRange, timeStep, timeTicks, timeWords } from "../src/views/strips/scales.ts";
import { neighbour, stretch } from "../src/views/strips/span.ts";
import { inkOn, channels as rgb } from "../src/views/theme.ts";

class Fake implements History {
  private rows: Partial<Record<Channel, number>>[] = [];
  readonly capacity: number;
  pushed = 0;

  constructor(capacity = 1_000_000) {
    this.capacity = capacity;
  }

  push(row: Partial<Record<Channel, number>>): void {
    this.rows.push(row);
    this.pushed += 1;
    if (this.rows.length > 2 * this.capacity) this.rows = this.rows.slice(-this.capacity);
  }

  clear(): void {
    this.rows = [];
    this.pushed += 1;
  }

  get length(): number {
    return Math.min(this.rows.length, this.capacity);
  }

  at(channel: Channel, index: number): number {
    return this.rows[this.rows.length - this.length + index]?.[channel] ?? Number.NaN;
  }

  indexAt(t: number): number {
    let [low, high] = [0, this.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.at("t", middle) <= t) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }
}

function filled(samples: number, value: (index: number) => number, capacity?: number): Fake {
  const history = new Fake(capacity);
  for (let index = 0; index < samples; index += 1) history.push({ t: index * 0.02, v_s: value(index) });
  return history;
}

test("few samples are drawn as they are", () => {
  const pyramid = new Pyramid(["v_s"]);
  pyramid.update(filled(100, (index) => index));
  const { t, values } = pyramid.columns(["v_s"], 0.5, 1, 500);
  assert.equal(values[0]?.[0], 25);
  assert.deepEqual(t.length, values[0]?.length);
  // One beyond the edge, so that the line leaves the picture.
  assert.ok((t.at(-1) ?? 0) > 1);
});

test("of 60 000 samples few points are left, and no spike is lost", () => {
  const history = filled(60_000, (index) => (index === 31_415 ? 9 : index === 27_182 ? -9 : Math.sin(index / 500)));
  const pyramid = new Pyramid(["v_s"]);
  pyramid.update(history);
  for (const pixels of [300, 600, 1200]) {
    const { t, values } = pyramid.columns(["v_s"], 0, 1200, pixels);
    const numbers = values[0]?.filter((value) => value !== null) ?? [];
    assert.ok(t.length <= 4 * pixels + 8, `${t.length} points on ${pixels} pixels`);
    assert.ok(t.length >= pixels / 2, `${t.length} points on ${pixels} pixels`);
    assert.equal(Math.max(...numbers), 9);
    assert.equal(Math.min(...numbers), -9);
    assert.ok(t.every((time, index) => index === 0 || time >= (t[index - 1] ?? 0)));
  }
});

test("the newest sample is drawn at every zoom, the moment it is there", () => {
  const history = new Fake();
  const pyramid = new Pyramid(["v_s"]);
  for (let index = 0; index < 3000; index += 1) {
    history.push({ t: index * 0.02, v_s: index });
    if (index < 2900) continue;
    pyramid.update(history);
    for (const pixels of [4, 40, 400]) {
      const { t, values } = pyramid.columns(["v_s"], 0, 60, pixels);
      assert.deepEqual([t.at(-1), values[0]?.at(-1)], [index * 0.02, index]);
      assert.ok(
        t.every((time, at) => at === 0 || time > (t[at - 1] ?? 0)),
        "nothing is drawn twice",
      );
    }
  }
});

test("a slope is drawn as one, not as a saw", () => {
  const pyramid = new Pyramid(["v_s"]);
  pyramid.update(filled(8000, (index) => -index));
  const { values } = pyramid.columns(["v_s"], 0, 160, 200);
  const numbers = values[0] as number[];
  assert.ok(numbers.every((value, index) => index === 0 || value <= (numbers[index - 1] as number)));
});

test("samples one by one make the same as all at once", () => {
  const value = (index: number) => Math.sin(index / 17) * (index % 13);
  const [growing, oneByOne, atOnce] = [new Fake(), new Pyramid(["v_s"]), new Pyramid(["v_s"])];
  for (let index = 0; index < 5000; index += 1) {
    growing.push({ t: index * 0.02, v_s: value(index) });
    if (index % 3 === 0) oneByOne.update(growing);
  }
  oneByOne.update(growing);
  atOnce.update(growing);
  assert.deepEqual(oneByOne.columns(["v_s"], 0, 100, 100), atOnce.columns(["v_s"], 0, 100, 100));
});

test("what is not a number is a gap, and so is a time without telemetry, at any zoom", () => {
  const history = new Fake();
  for (let index = 0; index < 4000; index += 1) history.push({ t: index * 0.02, v_s: index >= 1000 && index < 2000 ? Number.NaN : 1 });
  for (let index = 0; index < 4000; index += 1) history.push({ t: 100 + index * 0.02, v_s: 2 });
  const pyramid = new Pyramid(["v_s"]);
  pyramid.update(history);
  for (const pixels of [40, 400, 100_000]) {
    const { t, values } = pyramid.columns(["v_s"], 0, 180, pixels);
    const gapAt = (from: number, to: number) => t.some((time, index) => time > from && time < to && values[0]?.[index] === null);
    assert.ok(gapAt(20, 40), `NaN on ${pixels} pixels`);
    assert.ok(gapAt(79.98, 100), `silence on ${pixels} pixels`);
    assert.ok(t.every((time, index) => !(time >= 100 && values[0]?.[index] === 1)));
  }
});

test("what the ring has forgotten is forgotten, and a cleared history starts anew", () => {
  const history = new Fake(2000);
  const pyramid = new Pyramid(["v_s"]);
  for (let index = 0; index < 50_000; index += 1) {
    history.push({ t: index * 0.02, v_s: index });
    if (index % 50 === 0) pyramid.update(history);
  }
  pyramid.update(history);
  const { values } = pyramid.columns(["v_s"], 0, 1000, 50);
  const least = Math.min(...(values[0]?.filter((value) => value !== null) ?? []));
  // At most as much again as the ring holds.
  assert.ok(least >= 45_000, `${least}`);
  history.clear();
  history.push({ t: 0, v_s: -5 });
  pyramid.update(history);
  assert.deepEqual(pyramid.columns(["v_s"], 0, 1, 50).values[0], [-5]);
});

test("states last until the next sample, and words fit what is seen", () => {
  const history = new Fake();
  const states = [0, 0, 1, 1, 2, 2, 2, 3, 0];
  states.forEach((state, index) => {
    history.push({ t: index / 10, move_state: state });
  });
  const runs = new Runs("move_state");
  runs.update(history);
  const shown = runs.bands(0, 0.8, 80).map(({ from, to, state }) => [Math.round(from), Math.round(to), state]);
  assert.deepEqual(shown, [
    [0, 20, 0],
    [20, 40, 1],
    [40, 70, 2],
    [70, 80, 3],
  ]);
  assert.deepEqual(runs.bands(0.45, 0.55, 100), [{ from: 0, to: 100, state: 2 }]);
});

test("an unknown state and a silence are no band", () => {
  const history = new Fake();
  for (const [t, move_state] of [
    [0, 0],
    [0.1, 0],
    [0.2, Number.NaN],
    [0.3, Number.NaN],
    [0.4, 0],
    [0.5, 0],
    [2, 1],
    [2.1, 1],
  ] as const)
    history.push({ t, move_state });
  const runs = new Runs("move_state");
  runs.update(history);
  const shown = runs.bands(0, 2.1, 210).map(({ from, to, state }) => [Math.round(from), Math.round(to), state]);
  assert.deepEqual(shown, [
    [0, 20, 0],
    [40, 50, 0],
    [200, 210, 1],
  ]);
});

test("there are no more bands than pixels, and what lasted longest is seen", () => {
  const history = new Fake();
  for (let index = 0; index < 60_000; index += 1) history.push({ t: index * 0.02, move_state: index % 10 === 0 ? 1 : 2 });
  const runs = new Runs("move_state");
  runs.update(history);
  const shown: Band[] = runs.bands(0, 1200, 300);
  assert.ok(shown.length <= 300);
  assert.ok(shown.every(({ state }) => state === 2));
});

test("the stretch ends now; paused, it stands still; scrubbed, it goes along", () => {
  assert.deepEqual(stretch(30, 0, 100, undefined, undefined), { from: 70, to: 100 });
  assert.deepEqual(stretch(30, 5, 20, undefined, undefined), { from: 5, to: 35 });
  const paused = stretch(30, 0, 101, 100, { from: 70, to: 100 });
  const later = stretch(30, 0, 130, 100, stretch(30, 0, 120, 100, paused));
  // The cursor is at the edge: so much of what came after it is shown, and no more.
  assert.ok(later.to <= 103 + 1e-9 && later.to >= 100, `${later.to}`);
  assert.deepEqual(stretch(30, 0, 131, 100, later), later);
  assert.deepEqual(stretch(30, 0, 130, 95, later), later);
  const back = stretch(30, 0, 130, 40, later);
  assert.ok(back.from < 40 && back.to > 40 && back.to < 70 + 1e-9);
  assert.deepEqual(stretch(Number.POSITIVE_INFINITY, 5, 100, 40, back), { from: 5, to: 100 });
  assert.deepEqual(stretch(30, Number.NaN, Number.NaN, undefined, undefined), { from: 0, to: 30 });
});

test("lengths of time, up and down", () => {
  assert.equal(neighbour(30, true), 60);
  assert.equal(neighbour(30, false), 10);
  assert.equal(neighbour(5, false), 5);
  assert.equal(neighbour(1200, true), Number.POSITIVE_INFINITY);
  assert.equal(neighbour(Number.POSITIVE_INFINITY, true), Number.POSITIVE_INFINITY);
});

test("ranges are round, hold what there is, and stay for small changes", () => {
  assert.deepEqual(niceRange(-0.01, 0.31, { least: [-0.1, 0.1] }), [-0.2, 0.4]);
  assert.deepEqual(niceRange(-0.012, 0.315, { least: [-0.1, 0.1] }), [-0.2, 0.4]);
  assert.deepEqual(niceRange(null, null, { least: [-1, 1], fixed: true }), [-1, 1]);
  assert.deepEqual(niceRange(0, 1.3, { least: [-1, 1], fixed: true }), [-1, 2]);
  const [low, high] = closeRange(12.31, 12.38, 0.5);
  assert.ok(low <= 12.31 && high >= 12.38 && high - low <= 1, `${low} ${high}`);
  assert.deepEqual(closeRange(null, null, 0.5), [0, 0.5]);
});

test("ticks at round times, and their words", () => {
  assert.equal(timeStep(30, 600, 60), 5);
  assert.equal(timeStep(1200, 600, 60), 120);
  assert.deepEqual(timeTicks(9.9, 20.1, 5), [10, 15, 20]);
  assert.deepEqual(
    [timeWords(12, 5), timeWords(12.5, 0.5), timeWords(754, 60), timeWords(754.26, 0.1), timeWords(-3, 1)],
    ["12", "12.5", "12:34", "12:34.3", "−3"],
  );
});

/** Machado, Oliveira and Fernandes, A Physiologically-based Model for Simulation of Color Vision Deficiency (2009), severity 1.0; of linear RGB. */
const SIGHTS = {
  usual: [1, 0, 0, 0, 1, 0, 0, 0, 1],
  protanopia: [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998],
  deuteranopia: [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.01182, 0.04294, 0.968881],
  tritanopia: [1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.3039],
} as const;

/** CIELAB, of D65, of a colour as somebody sees it. */
function lab(colour: string, sight: readonly number[]): [number, number, number] {
  const linear = rgb(colour).map((channel) =>
    channel / 255 <= 0.04045 ? channel / 255 / 12.92 : ((channel / 255 + 0.055) / 1.055) ** 2.4,
  );
  const times = (matrix: readonly number[], vector: readonly number[]) =>
    [0, 1, 2].map((row) => [0, 1, 2].reduce((sum, column) => sum + (matrix[3 * row + column] ?? 0) * (vector[column] ?? 0), 0));
  const seen = times(sight, linear).map((part) => Math.min(1, Math.max(0, part)));
  const xyz = times([0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505], seen);
  const f = (part: number) => (part > 0.008856 ? Math.cbrt(part) : 7.787 * part + 16 / 116);
  const [x, y, z] = [f((xyz[0] ?? 0) / 0.9505), f(xyz[1] ?? 0), f((xyz[2] ?? 0) / 1.089)];
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

function difference(a: string, b: string, sight: readonly number[]): number {
  const [one, other] = [lab(a, sight), lab(b, sight)];
  return Math.hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]);
}

function schemes(): Record<string, string>[] {
  const style = readFileSync(new URL("../src/style/colours.css", import.meta.url), "utf8");
  const blocks = [...style.matchAll(/\{([^}]*)\}/g)].map(([, body]) =>
    Object.fromEntries([...(body ?? "").matchAll(/--([\w-]+):\s*(#[0-9a-f]+)/gi)].map(([, name, colour]) => [name, colour])),
  );
  return blocks.filter((block) => "hold" in block) as Record<string, string>[];
}

test("colour-blind people tell the states apart, in light and in dark", () => {
  const all = schemes();
  assert.equal(all.length, 2);
  const states = ["hold", "accel", "move", "deccel"];
  for (const scheme of all) {
    for (const [name, sight] of Object.entries(SIGHTS)) {
      for (const [index, a] of states.entries()) {
        for (const b of states.slice(index + 1)) {
          const apart = difference(scheme[a] ?? "", scheme[b] ?? "", sight);
          // A difference of 2.3 is just noticed when side by side; areas that are named in a legend should be six times that.
          assert.ok(apart >= 15, `${a} and ${b} by ${name}: ${apart.toFixed(1)}`);
        }
      }
      const ways = difference(scheme.est ?? "", scheme.true ?? "", sight);
      assert.ok(ways >= 23, `estimated and true way by ${name}: ${ways.toFixed(1)}`);
    }
  }
});

test("words on a colour are black or white, whichever is read better", () => {
  assert.equal(inkOn("#ffffff"), "#000000");
  assert.equal(inkOn("#16202b"), "#ffffff");
  assert.equal(inkOn("#e69f00"), "#000000");
  assert.equal(inkOn("#b3261e"), "#ffffff");
});
