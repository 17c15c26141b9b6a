import assert from "node:assert/strict";
import { test } from "node:test";
import type { Covariance } from "../src/model/model.ts";
import {
  Extent,
  fit,
  follow,
  lengthWords,
  pan,
  roundLength,
  sees,
  toScreen,
  toWorld,
  wrapDegrees,
  zoomAbout,
} from "../src/views/topview/geometry.ts";
import { banana, CHI2_95, carry, deviations, ellipse } from "../src/views/topview/uncertainty.ts";

const VIEW = { x: 1, y: -2, scale: 80, width: 640, height: 480 };
const DEGREE = Math.PI / 180;

/** mulberry32: the same numbers on every machine. */
function generator(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}

function normal(random: () => number): number {
  return Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
}

function inside(outline: readonly (readonly [number, number])[], x: number, y: number): boolean {
  let winding = 0;
  outline.forEach(([ax, ay], index) => {
    const [bx, by] = outline[(index + 1) % outline.length] as readonly [number, number];
    const left = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
    if (ay <= y && by > y && left > 0) winding += 1;
    if (ay > y && by <= y && left < 0) winding -= 1;
  });
  return winding !== 0;
}

function exp(u: number, v: number, theta: number): [number, number] {
  if (Math.abs(theta) < 1e-9) return [u, v];
  const [s, c] = [Math.sin(theta) / theta, (1 - Math.cos(theta)) / theta];
  return [s * u - c * v, c * u + s * v];
}

test("a pixel and its point belong together", () => {
  const [px, py] = toScreen(VIEW, 2, -1);
  assert.deepEqual([px, py], [400, 160]);
  const [x, y] = toWorld(VIEW, px, py);
  assert.ok(Math.hypot(x - 2, y + 1) < 1e-12);
});

test("what is under the pointer stays there when zoomed, and moves with it when panned", () => {
  const before = toWorld(VIEW, 100, 50);
  const zoomed = toWorld(zoomAbout(VIEW, 100, 50, 1.7), 100, 50);
  const panned = toWorld(pan(VIEW, 30, -20), 130, 30);
  for (const after of [zoomed, panned]) assert.ok(Math.hypot(after[0] - before[0], after[1] - before[1]) < 1e-12);
});

test("zooming ends, and does not wander when it has", () => {
  let view = VIEW;
  for (let step = 0; step < 200; step += 1) view = zoomAbout(view, 0, 0, 2);
  assert.equal(view.scale, 10_000);
  const again = zoomAbout(view, 10, 10, 2);
  assert.ok(Math.abs(again.x - view.x) < 1e-9);
});

test("all that is fitted is seen, and a single point does not zoom in without end", () => {
  const extent = new Extent();
  extent.add(3, 4, 1);
  extent.add(Number.NaN, 2);
  const bounds = extent.bounds;
  assert.ok(bounds);
  assert.deepEqual(bounds, { minX: 2, minY: 3, maxX: 4, maxY: 5 });
  const view = fit(VIEW, bounds, 20, 300);
  const [left, bottom] = toScreen(view, 2, 3);
  assert.ok(left >= 19.99 && bottom <= 480 - 19.99);
  assert.equal(fit(VIEW, { minX: 1, maxX: 1, minY: 1, maxY: 1 }, 20, 300).scale, 300);
  assert.ok(sees(view, bounds));
  assert.equal(new Extent().bounds, undefined);
});

test("following moves by what is missing, and not before", () => {
  assert.deepEqual(follow(VIEW, 1.5, -2, 0.6), VIEW);
  // 0.6 of the width: 2.4 m to either side of the middle.
  assert.ok(Math.abs(follow(VIEW, 5, -2, 0.6).x - 2.6) < 1e-12);
});

test("round lengths and their words", () => {
  assert.deepEqual(
    [0.03, 0.1, 1, 1.01, 4, 60].map((length) => Number(roundLength(length).toPrecision(3))),
    [0.05, 0.1, 1, 2, 5, 100],
  );
  assert.deepEqual([0.002, 0.05, 0.5, 2, 5000].map(lengthWords), ["2 mm", "5 cm", "50 cm", "2 m", "5 km"]);
  assert.deepEqual([190, -180, 180, 540, -541].map(wrapDegrees), [-170, 180, 180, 180, 179]);
});

test("the ellipse has the axes of the covariance", () => {
  const round = ellipse([0.04, 0, 0, 0.01, 0, 0]);
  assert.ok(Math.abs(round.a - 0.2 * Math.sqrt(CHI2_95)) < 1e-12);
  assert.ok(Math.abs(round.b - 0.1 * Math.sqrt(CHI2_95)) < 1e-12);
  assert.equal(round.angle, 0);
  const slanted = ellipse([0.025, 0.015, 0, 0.025, 0, 0]);
  assert.ok(Math.abs(slanted.angle - 45 * DEGREE) < 1e-12);
  assert.ok(Math.abs(slanted.a - round.a) < 1e-12);
  // A rounding below zero must not make it vanish.
  assert.equal(ellipse([1, 1.0000001, 0, 1, 0, 0]).b, 0);
});

test("with a sure heading the banana is the ellipse", () => {
  const random = generator(5);
  for (let run = 0; run < 20; run += 1) {
    const [a, b, c] = [0.01 + random(), random() - 0.5, 0.01 + random()];
    // A root times its transpose: positive definite.
    const covariance: Covariance = [a * a, a * b, 1e-5, b * b + c * c, -1e-5, 1e-4];
    const pose = { x: 3, y: -1, theta: 360 * random() - 180 };
    const outline = banana(pose, covariance);
    assert.ok(outline);
    const [cxx, cxy, , cyy] = covariance;
    const det = cxx * cyy - cxy * cxy;
    for (const [x, y] of outline) {
      const [dx, dy] = [x - pose.x, y - pose.y];
      const distance = (cyy * dx * dx - 2 * cxy * dx * dy + cxx * dy * dy) / det;
      // A heading deviation of 0.01 degrees bends by less than a thousandth.
      assert.ok(Math.abs(distance / CHI2_95 - 1) < 2e-3, `${distance}`);
    }
  }
});

test("the banana bends back where the ellipse goes on", () => {
  // 10 m straight ahead with a heading that is unknown by 0.3 rad from the start: the truth lies on a circle about the start.
  const heading = 0.3;
  const covariance: Covariance = [1e-4, 0, 0, 100 * heading ** 2 + 1e-4, (10 * heading ** 2) / DEGREE, (heading / DEGREE) ** 2];
  const outline = banana({ x: 10, y: 0, theta: 0 }, covariance);
  assert.ok(outline);
  for (const [x, y] of outline) {
    const distance = Math.hypot(x, y);
    // 2.45 deviations of 1 cm on either side, and what the arc's width adds at its ends.
    assert.ok(Math.abs(distance - 10) < 0.03, `${x} ${y}: ${distance}`);
  }
  const reach = Math.max(...outline.map(([, y]) => y));
  assert.ok(Math.abs(reach - 10 * Math.sin(Math.sqrt(CHI2_95) * heading)) < 0.05, `${reach}`);
  assert.ok(ellipse(covariance).a > reach + 0.5);
});

test("the banana holds every twist of the ellipsoid, and 95 % of the positions", () => {
  const random = generator(7);
  for (const degrees of [2, 8, 15, 25]) {
    const heading = degrees * DEGREE;
    // Seen from a base that has driven 3 m: partly about where it began, partly its own noise.
    const [along, aside] = [0.1, 0.15];
    const gain = 2.2;
    const covariance: Covariance = [
      along ** 2,
      0.3 * along * aside,
      0,
      aside ** 2 + gain ** 2 * heading ** 2,
      (gain * heading ** 2) / DEGREE,
      degrees ** 2,
    ];
    const outline = banana({ x: 0, y: 0, theta: 0 }, covariance, 360);
    assert.ok(outline);
    const l21 = 0.3 * aside;
    const l22 = Math.sqrt(aside ** 2 - l21 ** 2);
    const place = ([a, b, c]: [number, number, number]) => exp(along * b, gain * heading * a + l21 * b + l22 * c, heading * a);
    let [held, all, surface] = [0, 4000, 0];
    for (let sample = 0; sample < all; sample += 1) {
      const w: [number, number, number] = [normal(random), normal(random), normal(random)];
      if (inside(outline, ...place(w))) held += 1;
      const length = Math.sqrt(CHI2_95 * 0.995) / Math.hypot(...w);
      if (inside(outline, ...place([w[0] * length, w[1] * length, w[2] * length]))) surface += 1;
    }
    assert.ok(surface >= 0.999 * all, `${degrees}: ${surface} of ${all} of the surface`);
    // Four deviations of a binomial, √(0.95 · 0.05/4000) = 0.0034, and 1 % for what is not linear.
    assert.ok(Math.abs(held / all - 0.95) < 0.024, `${degrees}: ${held / all}`);
  }
});

test("a covariance of zero is a point; a heading that may be any has no banana", () => {
  const outline = banana({ x: 1, y: 2, theta: 30 }, [0, 0, 0, 0, 0, 0]);
  assert.ok(outline);
  for (const [x, y] of outline) assert.ok(Math.hypot(x - 1, y - 2) < 1e-5);
  assert.equal(banana({ x: 0, y: 0, theta: 0 }, [1, 0, 0, 1, 0, 80 ** 2]), undefined);
  assert.equal(banana({ x: 0, y: 0, theta: 0 }, [Number.NaN, 0, 0, 1, 0, 1]), undefined);
});

test("carried ahead, an unsure heading becomes an unsure position", () => {
  const carried = carry([0, 0, 0, 0, 0, 4], { x: 0, y: 0, theta: 0 }, { x: 3, y: 0, theta: 0 });
  const { position, heading } = deviations(carried);
  assert.ok(Math.abs(position - 3 * 2 * DEGREE) < 1e-12);
  assert.equal(Math.round(heading * 1e9), 2e9);
  // There and back is where it was.
  const back = carry(carried, { x: 3, y: 0, theta: 0 }, { x: 0, y: 0, theta: 0 });
  back.forEach((value, index) => {
    assert.ok(Math.abs(value - (index === 5 ? 4 : 0)) < 1e-12);
  });
});
