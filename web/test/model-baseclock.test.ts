/** The base's clock as the page can tell it: messages come late, never early. */
import assert from "node:assert/strict";
import { test } from "node:test";
import { BaseClock } from "../src/model/baseclock.ts";

test("of messages that come late by chance, the quickest tells the time", () => {
  const clock = new BaseClock();
  assert.equal(clock.now(1, 1), undefined);
  // Seeded: 2 to 30 ms late, 25 messages a second.
  let seed = 7;
  const late = () => {
    seed = (seed * 48_271) % 2_147_483_647;
    return 0.002 + (0.028 * seed) / 2_147_483_647;
  };
  for (let n = 0; n < 100; n += 1) {
    const t = n * 0.04;
    const at = 100 + t + late();
    clock.heard(t, at);
    if (n < 13) continue;
    // Never ahead of the base, and behind it by at most what the quickest of a dozen was late: below 12 ms but in one of a hundred draws.
    const off = t + (at - 100 - t) - (clock.now(at, 1) ?? Number.NaN);
    assert.ok(off >= 0.002 - 1e-9 && off < 0.012, `${off}`);
  }
});

test("a base that has started anew, or is another one, has another clock; a quick one goes faster", () => {
  const clock = new BaseClock();
  clock.heard(50, 1);
  clock.heard(0.5, 2);
  assert.equal(clock.now(2.25, 1), 0.75);
  assert.equal(clock.now(2.25, 4), 1.5);
  clock.forget();
  assert.equal(clock.now(3, 1), undefined);
});
