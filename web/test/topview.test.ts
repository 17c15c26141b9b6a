import assert from "node:assert/strict";
import { test } from "node:test";
import type { Channel, History } from "../src/model/model.ts";
import { GoalDrag, interrupts, keyed } from "../src/views/topview/goal.ts";
import { silhouette } from "../src/views/topview/silhouette.ts";
import { Sleeve, Trail } from "../src/views/topview/trail.ts";

type Row = readonly [t: number, x: number, y: number];

class Fake implements History {
  readonly rows: Row[] = [];
  readonly capacity: number;
  pushed = 0;

  constructor(capacity = 100_000) {
    this.capacity = capacity;
  }

  push(...row: [number, number, number]): void {
    this.rows.push(row);
    this.pushed += 1;
    if (this.rows.length > this.capacity) this.rows.shift();
  }

  get length(): number {
    return this.rows.length;
  }

  at(channel: Channel, index: number): number {
    const column = { t: 0, x: 1, y: 2 }[channel as "t" | "x" | "y"];
    return this.rows[index]?.[column] ?? Number.NaN;
  }

  indexAt(t: number): number {
    return this.rows.findLastIndex((row) => row[0] <= t);
  }
}

function distanceToLine(x: number[], y: number[], px: number, py: number): number {
  let least = Number.POSITIVE_INFINITY;
  for (let index = 0; index + 1 < x.length; index += 1) {
    const [ax, ay, bx, by] = [x[index], y[index], x[index + 1], y[index + 1]] as [number, number, number, number];
    const length = (bx - ax) ** 2 + (by - ay) ** 2;
    const along = length > 0 ? Math.min(1, Math.max(0, ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / length)) : 0;
    least = Math.min(least, Math.hypot(px - ax - along * (bx - ax), py - ay - along * (by - ay)));
  }
  return least;
}

/** There and back, in a curve, and on the spot. */
function wander(samples: number): Row[] {
  let [x, y, theta] = [0, 0, 0];
  return Array.from({ length: samples }, (_, index) => {
    const phase = index % 1500;
    const [v, w] = phase < 500 ? [0.4, 0.5 * Math.sin(index / 90)] : phase < 700 ? [-0.4, 0] : phase < 900 ? [0, 1] : [0.3, 0.2];
    theta += w * 0.02;
    x += v * 0.02 * Math.cos(theta);
    y += v * 0.02 * Math.sin(theta);
    return [index * 0.02, x, y] as const;
  });
}

test("no sample is farther from the line than the tolerance, and few points are left", () => {
  const [x, y]: [number[], number[]] = [[], []];
  const sleeve = new Sleeve(0.01, (px, py) => {
    x.push(px);
    y.push(py);
  });
  const rows = wander(6000);
  rows.forEach(([, px, py], index) => {
    sleeve.push(px, py, index);
  });
  sleeve.end();
  const worst = Math.max(...rows.map(([, px, py]) => distanceToLine(x, y, px, py)));
  // Twice: where it comes back, the turning point itself may be off by one along the line, and by one across.
  assert.ok(worst <= 0.02, `${worst}`);
  assert.ok(x.length < 300, `${x.length} points`);
});

test("a way that comes back on itself keeps its end", () => {
  const x: number[] = [];
  const sleeve = new Sleeve(0.01, (px) => x.push(px));
  [0, 1, 2, 3, 2, 1, 0].forEach((at, index) => {
    sleeve.push(at, 0, index);
  });
  sleeve.end();
  assert.deepEqual(x, [0, 3, 0]);
});

test("the trail of 60 000 samples is drawn by few points, the same whether they came at once or one by one", () => {
  const rows = wander(60_000);
  const [atOnce, oneByOne] = [new Trail("x", "y"), new Trail("x", "y")];
  const [whole, growing] = [new Fake(), new Fake()];
  for (const row of rows) whole.push(...row);
  rows.forEach((row, index) => {
    growing.push(...row);
    if (index % 7 === 0) oneByOne.update(growing, 100);
  });
  oneByOne.update(growing, 100);
  atOnce.update(whole, 100);
  assert.deepEqual(oneByOne.line, atOnce.line);
  assert.deepEqual(oneByOne.pieces, atOnce.pieces);
  assert.ok(atOnce.line.x.length < 6000, `${atOnce.line.x.length} points`);
  // 0.4 of a pixel of up to 1/64 m, twice as above, and a quarter of a millimetre.
  const sparse = rows.filter((_, index) => index % 211 === 0 && index < 59_000);
  const worst = Math.max(...sparse.map(([, x, y]) => distanceToLine(atOnce.line.x, atOnce.line.y, x, y)));
  assert.ok(worst <= 0.0075, `${worst}`);
});

test("zooming makes another line, and a little does not", () => {
  const history = new Fake();
  for (const row of wander(3000)) history.push(...row);
  const trail = new Trail("x", "y");
  trail.update(history, 100);
  const { generation } = trail;
  const points = trail.line.x.length;
  trail.update(history, 120);
  assert.equal(trail.generation, generation);
  trail.update(history, 900);
  assert.notEqual(trail.generation, generation);
  assert.ok(trail.line.x.length > points);
});

test("no line leads over what is not known, nor to where the estimate was set", () => {
  const history = new Fake();
  history.push(0, 0, 0);
  history.push(0.02, 0.01, 0);
  history.push(0.04, Number.NaN, Number.NaN);
  history.push(0.06, 0.02, 0);
  history.push(0.08, 0.03, 0);
  history.push(0.1, 7, 7);
  history.push(0.12, 7.01, 7);
  const trail = new Trail("x", "y");
  trail.update(history, 1000);
  const breaks = trail.line.x.filter(Number.isNaN).length;
  assert.equal(breaks, 2);
  assert.equal(trail.line.sample.length, trail.line.x.length);
});

test("what the history forgets, the trail forgets within as much again", () => {
  const history = new Fake(1000);
  const trail = new Trail("x", "y");
  for (const row of wander(9000)) {
    history.push(...row);
    trail.update(history, 1000);
  }
  const oldest = trail.line.sample[0] ?? 0;
  assert.ok(oldest >= 9000 - 2600, `${oldest}`);
  const other = new Fake();
  other.push(0, 5, 5);
  trail.update(other, 1000);
  assert.equal(trail.line.x.at(0), 5);
});

test("a press and a release go to a point; a drag sets the heading", () => {
  const drag = new GoalDrag();
  assert.ok(drag.press(1, 100, 100, [2, 3], false));
  drag.move(1, 104, 100, false);
  assert.deepEqual(drag.release(1), { goal: { x: 2, y: 3, theta: undefined }, append: false });
  drag.press(1, 100, 100, [2, 3], false);
  drag.move(1, 100, 60, true);
  assert.deepEqual(drag.release(1), { goal: { x: 2, y: 3, theta: 90 }, append: true });
  drag.press(1, 100, 100, [2, 3], false);
  drag.move(1, 60, 100, false);
  drag.move(1, 101, 99, false);
  assert.deepEqual(drag.release(1)?.goal.theta, undefined, "back at the point the heading is open again");
});

test("what was cancelled is never ordered, nor what another pointer does", () => {
  const drag = new GoalDrag();
  drag.press(1, 0, 0, [2, 3], false);
  assert.equal(drag.press(2, 9, 9, [0, 0], false), false);
  assert.equal(drag.release(2), undefined);
  assert.ok(drag.active);
  drag.cancel();
  drag.move(1, 50, 0, false);
  assert.equal(drag.release(1), undefined);
});

test("a Stop, a fault and a reset interrupt; an arrival does not", () => {
  const heard = (text: string) => [{ direction: "heard", text }];
  const sent = (text: string) => [{ direction: "sent", text }];
  for (const lines of [
    sent("Stop"),
    sent("@17 stop*ABCD"),
    sent("@5 EStop"),
    heard("! stop command"),
    heard("! fault stall left"),
    heard("! boot power-on"),
  ]) {
    assert.ok(interrupts(lines), lines[0]?.text);
  }
  for (const lines of [heard("! posture 2"), heard("! move done 0.0001"), sent("@3 GetStatus"), sent("Stopwatch"), heard("EstPos 1 2 3")]) {
    assert.ok(!interrupts(lines), lines[0]?.text);
  }
  assert.ok(interrupts(heard("! path end timeout")), "an order for a path that has ended would begin another one");
});

test("a goal by keys: moved, fixed, turned, sent", () => {
  let goal = keyed({ x: 0, y: 0, theta: undefined }, "ArrowRight", 0.1, false);
  assert.deepEqual(goal, { x: 0.1, y: 0, theta: undefined });
  goal = keyed({ x: 0, y: 0, theta: undefined }, "ArrowUp", 0.1, true);
  assert.deepEqual(goal, { x: 0, y: 0.01, theta: undefined });
  goal = keyed({ x: 0, y: 0, theta: undefined }, "Enter", 0.1, false);
  assert.deepEqual(goal, { x: 0, y: 0, theta: null });
  assert.equal(keyed({ x: 0, y: 0, theta: null }, "Enter", 0.1, false), "send");
  assert.deepEqual(keyed({ x: 0, y: 0, theta: null }, "ArrowLeft", 0.1, false), { x: 0, y: 0, theta: 15 });
  assert.deepEqual(keyed({ x: 0, y: 0, theta: -180 + 15 }, "ArrowRight", 0.1, false), { x: 0, y: 0, theta: 180 });
  assert.deepEqual(keyed({ x: 0, y: 0, theta: 30 }, "ArrowUp", 0.1, false), { x: 0, y: 0, theta: null });
  assert.equal(keyed({ x: 0, y: 0, theta: 30 }, "Escape", 0.1, false), "leave");
  assert.equal(keyed({ x: 0, y: 0, theta: 30 }, "x", 0.1, false), undefined);
});

test("wheels stand where the drawing has them", () => {
  const still = { speed: 0, turning: 0 };
  const small = silhouette({ vehicle: "differential", wheelBase: 0.2, track: Number.NaN, wheelDiameter: 0.084 }, still, false);
  assert.deepEqual(
    small.wheels.map(({ x, y }) => [x, y]),
    [
      [0, 0.1],
      [0, -0.1],
    ],
  );
  assert.equal(small.wheelDiameter, 0.084);
  assert.ok(small.radius > 0.1 && small.radius < 0.2);
  const unknown = silhouette({ vehicle: "synchro", wheelBase: Number.NaN, track: Number.NaN, wheelDiameter: Number.NaN }, still, false);
  assert.equal(unknown.wheels.length, 3);
  assert.ok(Number.isFinite(unknown.radius));
});

test("steered wheels point along their own way", () => {
  const curve = { speed: 0.3, turning: 60 };
  const omega = Math.PI / 3;
  const tricycle = silhouette({ vehicle: "tricycle", wheelBase: 0.15, track: 0.14, wheelDiameter: 0.065 }, curve, false);
  const front = tricycle.wheels.find(({ steered }) => steered);
  // φ = atan(v_α L / v_s).
  assert.ok(Math.abs((front?.angle ?? 0) - Math.atan((omega * 0.15) / 0.3)) < 1e-12);
  const backward = silhouette(
    { vehicle: "tricycle", wheelBase: 0.15, track: 0.14, wheelDiameter: 0.065 },
    { speed: -0.3, turning: 60 },
    false,
  );
  assert.ok(
    Math.abs((backward.wheels[2]?.angle ?? 0) + (front?.angle ?? 0)) < 1e-12,
    "in reverse the wheel points the other way, and is not turned round",
  );
  const car = { vehicle: "bisteerable", wheelBase: 1.2, track: 1.2, wheelDiameter: 0.4 } as const;
  const both = silhouette(car, curve, true).wheels;
  assert.ok(both.every(({ steered }) => steered));
  // The rear axle is steered against the front one: f(φ) = −φ.
  assert.ok(Math.abs((both[0]?.angle ?? 1) + (both[2]?.angle ?? 2)) < 1e-12);
  assert.deepEqual(
    silhouette(car, curve, false).wheels.map(({ steered }) => steered),
    [false, false, true, true],
  );
  assert.ok(silhouette(car, { speed: Number.NaN, turning: Number.NaN }, true).wheels.every(({ angle }) => angle === 0));
});
