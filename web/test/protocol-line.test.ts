import assert from "node:assert/strict";
import { test } from "node:test";
import { uniform } from "../src/model/random.ts";
import { format, haltOf, patience } from "../src/protocol/command.ts";
import { check, crc16, unwrap, wrap } from "../src/protocol/line.ts";
import { LineSplitter, notALine } from "../src/transport/lines.ts";

test("the catalogue's check value, and others of docs/protocol.md", () => {
  assert.equal(crc16("123456789"), 0x29b1);
  assert.equal(crc16(""), 0xffff);
  assert.equal(check("SetParam require_crc 0"), "E50B");
});

test("what is wrapped is unwrapped", () => {
  const line = wrap(17, "m 1");
  assert.match(line, /^@17 m 1\*[0-9A-F]{4}$/);
  assert.deepEqual(unwrap(line), { tag: 17, body: "m 1", check: "good" });
  assert.equal(unwrap(line.replace("m 1", "m 2")).check, "bad");
  assert.deepEqual(unwrap("OK"), { tag: undefined, body: "OK", check: "none" });
  assert.deepEqual(unwrap("@99999 OK"), { tag: undefined, body: "@99999 OK", check: "none" });
  assert.equal(unwrap("~ motor_friction 1 0 2 V*s/m").check, "none", "a unit is no check");
});

test("every flipped bit of a line is noticed", () => {
  const line = wrap(4711, "Status HOLD HOLD enabled none");
  for (let at = 0; at < line.length; at += 1) {
    for (let bit = 0; bit < 7; bit += 1) {
      const damaged = line.slice(0, at) + String.fromCharCode(line.charCodeAt(at) ^ (1 << bit)) + line.slice(at + 1);
      // A letter of the check in lower case reads the same; without the star there is none any more.
      const same = damaged.toUpperCase() === line.toUpperCase() && at > line.lastIndexOf("*");
      assert.ok(same || unwrap(damaged).check !== "good", damaged);
    }
  }
});

test("numbers are as the base reads them", () => {
  const written: [number, string][] = [
    [0, "0"],
    [-0, "0"],
    [1, "1"],
    [100, "100"],
    [-0.25, "-0.25"],
    [1 / 3, "0.333333"],
    [1e-8, "1.00000e-8"],
    [179.9999999, "180"],
  ];
  for (const [value, text] of written) assert.equal(format(value), text);
  for (const value of [Number.NaN, Number.POSITIVE_INFINITY, 1e39]) assert.throws(() => format(value));
});

test("a Stop is one however it is written, and nothing else is", () => {
  assert.equal(haltOf(" stop\t"), "Stop");
  assert.equal(haltOf("ESTOP"), "EStop");
  for (const line of ["Stop 1", "Stopp", "m 0", "", "Follow clear"]) assert.equal(haltOf(line), undefined);
});

test("flash and the map may take longer", () => {
  assert.equal(patience("SaveParams"), 3000);
  assert.equal(patience("Sight lamp 10 5"), 3000);
  assert.equal(patience("m 1"), 1000);
});

test("what is no line is not sent", () => {
  assert.equal(notALine("m 1\t0.3"), undefined);
  assert.equal(notALine("x".repeat(255)), undefined);
  assert.match(notALine("x".repeat(256)) ?? "", /256 characters/);
  assert.match(notALine("") ?? "", /empty/);
  assert.match(notALine("m 1\nm 2") ?? "", /control character/);
  assert.match(notALine("m 1°") ?? "", /ASCII/);
  assert.ok(notALine("m \x7f"));
});

test("lines end with LF, CR or both, wherever the bytes are cut", () => {
  const bytes = new TextEncoder().encode("one\r\ntwo\rthree\n\n\r\nfour\n");
  for (let size = 1; size <= bytes.length; size += 1) {
    const splitter = new LineSplitter();
    const lines: string[] = [];
    for (let at = 0; at < bytes.length; at += size) splitter.push(bytes.slice(at, at + size), (line) => lines.push(line));
    assert.deepEqual(lines, ["one", "two", "three", "four"]);
    assert.equal(splitter.dropped, 0);
  }
});

test("garbage is left out and counted, and the next line is heard", () => {
  const splitter = new LineSplitter();
  const lines: string[] = [];
  const push = (text: string) =>
    splitter.push(
      Uint8Array.from(text, (c) => c.charCodeAt(0)),
      (line) => lines.push(line),
    );
  push(`${"x".repeat(255)}\n${"y".repeat(256)}\n`);
  push("a\xffb\nOK\n");
  push("half a li");
  splitter.lost();
  push("ne\n@1 OK\n");
  assert.deepEqual(lines, ["x".repeat(255), "OK", "@1 OK"]);
  assert.equal(splitter.dropped, 3);
});

test("a million random bytes leave no line that is none, and no memory behind", () => {
  const next = uniform(9);
  const splitter = new LineSplitter();
  let longest = 0;
  for (let chunk = 0; chunk < 1000; chunk += 1) {
    const bytes = Uint8Array.from({ length: 1000 }, () => (next() < 0.7 ? 32 + next() * 95 : next() * 256));
    splitter.push(bytes, (line) => {
      assert.equal(notALine(line), undefined);
      longest = Math.max(longest, line.length);
    });
  }
  assert.ok(longest <= 255 && splitter.dropped > 1000);
});
