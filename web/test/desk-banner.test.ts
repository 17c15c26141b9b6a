/** The banner's table is the one of docs/safety.md, and says what the page promises. */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { faultWords, lostWords } from "../src/views/banner.ts";
import { FAULTS } from "../src/views/faults.ts";

function rowsOfSafety(): string[][] {
  const text = readFileSync(new URL("../../docs/safety.md", import.meta.url), "utf8");
  const lines = text.split("\n");
  const start = lines.indexOf("| fault | cause | reaction | clearing |");
  assert.ok(start > 0, "docs/safety.md has its table of faults");
  const rows = [];
  for (const line of lines.slice(start + 2)) {
    if (!line.startsWith("|")) break;
    rows.push(
      line
        .split("|")
        .slice(1, -1)
        .map((cell) => cell.trim().replaceAll("`", "")),
    );
  }
  return rows;
}

test("each fault of docs/safety.md has its cause, reaction and clearing, word for word, in that order", () => {
  const here = [...FAULTS].map(([name, { cause, reaction, clearing }]) => [name, cause, reaction, clearing]);
  assert.deepEqual(here, rowsOfSafety());
  assert.equal(here.length, 21);
});

test("a fault is told with its wheels, cause and clearing; one that is not known is told, too", () => {
  const stuck = faultWords({ fault: "no-motion", place: "left" });
  assert.equal(stuck.title, "no-motion (left wheel)");
  assert.match(stuck.cause, /blocked, no power, or a dead encoder/);
  assert.match(stuck.cause, /motors are off/);
  assert.match(stuck.clearing, /comes back with the next motion/);
  assert.equal(faultWords({ fault: "overcurrent", place: "both" }).title, "overcurrent (both wheels)");
  assert.match(faultWords({ fault: "gremlins" }).cause, /does not know/);
});

test("a lost connection says what the base does, and when the page tries again", () => {
  const connection = { state: "lost", to: "ws://x/base", why: "closed.", retryAt: 5_000 } as const;
  const words = lostWords(connection, 1, 3_200);
  assert.match(
    words.text,
    /does not hear this page: closed\. Its deadman stops motions without an end 1 s after the last line; others go on/,
  );
  assert.equal(words.again, "Trying again in 2 s.");
  assert.match(lostWords(connection, 0, 3_200).text, /deadman is off: a motion without an end goes on/);
  assert.match(lostWords(connection, undefined, 3_200).text, /without an end, unless it is off/);
  assert.equal(lostWords(connection, 1, undefined).again, "Trying again now.");
  assert.equal(lostWords(connection, 1, 9_000).again, "Trying again now.");
  assert.equal(lostWords({ ...connection, retryAt: undefined }, 1, 0).again, "");
});
