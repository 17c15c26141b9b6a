/** Text can be read, light and dark: a contrast of 4.5 (WCAG 2.2, 1.4.3) on whatever it stands on. */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const style = readFileSync(new URL("../src/style/colours.css", import.meta.url), "utf8");

function scheme(selector: string): Map<string, string> {
  const start = style.indexOf(`${selector} {`);
  assert.ok(start >= 0, selector);
  const block = style.slice(start, style.indexOf("}", start));
  return new Map([...block.matchAll(/(--[\w-]+): (#[0-9a-f]{6});/g)].map(([, name = "", colour = ""]) => [name, colour]));
}

/** Relative luminance as WCAG defines it. */
function luminance(colour: string): number {
  const [r = 0, g = 0, b = 0] = [1, 3, 5].map((at) => {
    const share = Number.parseInt(colour.slice(at, at + 2), 16) / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

function contrast(one: string, other: string): number {
  const [light = 0, dark = 0] = [luminance(one), luminance(other)].sort((a, b) => b - a);
  return (light + 0.05) / (dark + 0.05);
}

const PAIRS: readonly (readonly [text: string, on: readonly string[]])[] = [
  ["--ink", ["--paper", "--page", "--field", "--raised"]],
  ["--muted", ["--paper", "--page", "--field", "--raised"]],
  ["--accent", ["--paper", "--field"]],
  ["--good", ["--paper"]],
  ["--fault", ["--paper", "--field"]],
  ["--on-alert", ["--alert"]],
  ["--on-warn", ["--warn"]],
  ["--est", ["--paper"]],
  ["--true", ["--paper"]],
];

for (const selector of [":root", ':root[data-theme="dark"]']) {
  test(`contrast of ${selector}`, () => {
    const colours = scheme(selector);
    for (const [text, grounds] of PAIRS) {
      for (const ground of grounds) {
        const [one, other] = [colours.get(text), colours.get(ground)];
        assert.ok(one && other, `${text} on ${ground} is there`);
        assert.ok(contrast(one, other) >= 4.5, `${text} on ${ground}: ${contrast(one, other).toFixed(2)}`);
      }
    }
  });
}

test("the measure: black on white is 21, a colour on itself 1", () => {
  assert.ok(Math.abs(contrast("#000000", "#ffffff") - 21) < 1e-9);
  assert.equal(contrast("#526070", "#526070"), 1);
});
