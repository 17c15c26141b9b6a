import assert from "node:assert/strict";
import { test } from "node:test";
import { arrange } from "../src/views/strips/picture.ts";
import { advance, clockWords, spanWords } from "../src/views/strips/timewords.ts";

test("playing goes on to the end, and does not leap after a pause of the page", () => {
  assert.deepEqual(advance(10, 0.1, 20), { t: 10.1, ended: false });
  assert.deepEqual(advance(19.95, 0.1, 20), { t: 20, ended: true });
  assert.deepEqual(advance(10, 30, 20), { t: 11, ended: false });
  assert.deepEqual(advance(10, -1, 20), { t: 10, ended: false });
});

test("the clock says how long ago the past was", () => {
  assert.equal(clockWords(12.375, undefined), "12.38 s");
  assert.equal(clockWords(10, 12.5), "10.00 s (−2.50 s)");
  assert.equal(clockWords(10, 70), "10.00 s (−60 s)");
  assert.equal(clockWords(10, 10), "10.00 s");
});

test("lengths of time in words", () => {
  assert.deepEqual([5, 60, 600, Number.POSITIVE_INFINITY].map(spanWords), ["5 s", "1 min", "10 min", "all"]);
});

test("the picture has the top view on the left and the strips on the right, none over another", () => {
  const tiles = [
    { caption: "Top view", width: 400, height: 300 },
    { caption: "Speed", width: 500, height: 90 },
    { caption: "States", width: 500, height: 56 },
    { caption: "", width: 500, height: 20 },
  ];
  const { width, height, placed } = arrange(tiles);
  assert.equal(placed.length, 4);
  placed.forEach(({ x, y }, index) => {
    const tile = tiles[index] as (typeof tiles)[number];
    assert.ok(x + tile.width <= width && y + tile.height <= height);
    const next = placed[index + 1];
    if (index > 0 && next) assert.ok(y + tile.height <= next.y);
  });
  assert.deepEqual(placed[2]?.x, placed[1]?.x);
  // The axis stands at its strip, without a caption between.
  assert.equal((placed[2]?.y ?? 0) + 56, placed[3]?.y);
  assert.deepEqual(arrange([]).placed, []);
});
