/** What the top view takes for the present: the sample, or what the base answers while there is none. */
import assert from "node:assert/strict";
import { test } from "node:test";
import { blank, Ring } from "../src/model/history.ts";
import type { Model } from "../src/model/model.ts";
import { noBase } from "../src/model/none.ts";
import { snapshot } from "../src/views/topview/snapshot.ts";
import { statusWords } from "../src/views/topview/words.ts";

const NOW = 100_000;

/** A base whose last sample and whose last answer were heard so many ms ago. */
function base(sample: { age: number; x: number }, answer: { age: number; x: number }): Model {
  const history = new Ring(10);
  // Truth and estimate are of the same instant in a sample: 4 mm apart.
  history.push({ ...blank(), t: 1, x: sample.x, y: 0, theta: 0, v_s: 0.3, true_x: sample.x + 0.004, true_y: 0, true_theta: 0 });
  const heard = NOW - Math.min(sample.age, answer.age);
  return {
    ...noBase(),
    connection: { state: "open", to: "a base", role: "drive", seatFree: false, another: false },
    history,
    cursor: { t: undefined },
    pose: { x: answer.age < sample.age ? answer.x : sample.x, y: 0, theta: 0 },
    heardAt: { telemetry: NOW - sample.age, pose: heard, states: heard, motors: heard },
  };
}

test("while telemetry comes, the pose is its sample's, and is held against the truth of the same instant", () => {
  // An answer is newer than the sample before it by some milliseconds, and by a centimetre at 0.5 m/s.
  const model = base({ age: 15, x: 1 }, { age: 5, x: 1.01 });
  const shown = snapshot(model, NOW);
  assert.deepEqual([shown.pose?.x, shown.age, shown.sampled, shown.motion.speed], [1, 0.015, true, 0.3]);
  assert.match(statusWords(model, shown), /truly 4 mm/);
});

test("where telemetry has stopped, the pose is what the base answers, and how fast it moves is not known", () => {
  const model = base({ age: 2000, x: 1 }, { age: 100, x: 1.5 });
  const shown = snapshot(model, NOW);
  assert.deepEqual([shown.pose?.x, shown.age, shown.sampled], [1.5, 0.1, false]);
  assert.ok(Number.isNaN(shown.motion.speed));
  assert.doesNotMatch(statusWords(model, shown), /truly|STALE/, "the truth of another instant says nothing of it");
});

test("where nothing is heard any more, what is shown is as old as it is", () => {
  const model = base({ age: 3000, x: 1 }, { age: 4000, x: 0.5 });
  const shown = snapshot(model, NOW);
  assert.deepEqual([shown.pose?.x, shown.age], [1, 3]);
  assert.match(statusWords(model, shown), /^STALE/);
});
