/** Chromium, its pages, and how a test looks at them. */
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { type Browser, type BrowserContext, chromium, type Page } from "playwright-core";
import type { Channel, Model } from "../src/model/model.ts";
import { WEB } from "./simulator.ts";

/** A slow machine is given time; what must be quick is measured where it is. */
export const PATIENCE_MS = 15_000;

export function launch(...args: readonly string[]): Promise<Browser> {
  const sandbox = process.getuid?.() === 0 ? ["--no-sandbox"] : [];
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", headless: true, args: [...sandbox, ...args] });
}

/** A page that must not complain: errors in its console fail the test, but those of a connection that a test has cut. */
export async function open(context: BrowserContext, url: string, prepared?: Page): Promise<Page> {
  const page = prepared ?? (await context.newPage());
  page.setDefaultTimeout(PATIENCE_MS);
  page.on("pageerror", (error) => complaints.push(`${error.stack ?? error}`));
  page.on("console", (message) => {
    if (message.type() === "error" && !/WebSocket connection|ERR_CONNECTION|ERR_EMPTY_RESPONSE/.test(message.text()))
      complaints.push(message.text());
  });
  await page.goto(url);
  return page;
}

const complaints: string[] = [];

export function assertNoComplaints(): void {
  assert.deepEqual(complaints.splice(0), []);
}

export const part = (page: Page, name: string) => page.locator(`[data-testid="${name}"]`);

/** A picture of the page, to be looked at. */
export async function shoot(page: Page, name: string): Promise<void> {
  mkdirSync(join(WEB, "out"), { recursive: true });
  await page.screenshot({ path: join(WEB, "out", `${name}.png`) });
}

/** Asks the page's model. The function runs in the page: it knows nothing but its arguments. */
export function ask<Result, Argument = undefined>(
  page: Page,
  question: (model: Model, argument: Argument) => Result,
  argument?: Argument,
): Promise<Result> {
  return page.evaluate(`(${question})(window.page.live, ${JSON.stringify(argument)})`) as Promise<Result>;
}

/** Waits until the page's model is so. It is asked from here: the page's policy forbids to evaluate texts in it. */
export async function until<Argument = undefined>(
  page: Page,
  what: string,
  condition: (model: Model, argument: Argument) => boolean,
  argument?: Argument,
  timeout = PATIENCE_MS,
): Promise<void> {
  const end = Date.now() + timeout;
  while (!(await ask(page, condition, argument))) {
    if (Date.now() > end) throw new Error(`${what}: not within ${timeout} ms, ${await tellState(page)}`);
    await page.waitForTimeout(20);
  }
}

function tellState(page: Page): Promise<string> {
  return ask(page, (model) =>
    JSON.stringify({
      connection: model.connection,
      status: model.status,
      path: model.path.mode,
      alarm: model.alarm,
      last: model.spoken.slice(-12).map((line) => line.text),
    }),
  ).catch(() => "and the page does not answer");
}

/** The last value of a channel. */
export function now(page: Page, channel: Channel): Promise<number> {
  return ask(page, (model, of) => model.history.at(of, model.history.length - 1), channel);
}

/** All that the page has said to the base, without tags and checks. */
export function sent(page: Page): Promise<string[]> {
  return ask(page, (model) =>
    model.spoken.filter((line) => line.direction === "sent").map((line) => line.text.replace(/^@\d+ /, "").replace(/\*[0-9A-F]{4}$/, "")),
  );
}

export const MOVES = /^(m|move|t|turn|goto|follow|chase|enable|clearfault)\b/i;

export async function connected(page: Page, role: "drive" | "watch"): Promise<void> {
  await part(page, "connection-state")
    .and(page.locator(`[data-state="open"][data-role="${role}"]`))
    .waitFor();
  await until(page, "telemetry", (model) => performance.now() - (model.heardAt.telemetry ?? 0) < 200 && model.history.length > 5);
  if (role === "drive") await until(page, "parameters and status", (model) => model.parameters.size > 0 && model.status !== undefined);
}

export function rest(page: Page): Promise<void> {
  return until(page, "rest", (model) => {
    const { history, status } = model;
    const at = history.length - 1;
    return (
      status?.moveState === "HOLD" &&
      status.turnState === "HOLD" &&
      Math.abs(history.at("v_s", at)) < 0.005 &&
      Math.abs(history.at("v_alpha", at)) < 1
    );
  });
}

export async function type(page: Page, line: string): Promise<void> {
  await part(page, "tab-console").click();
  await part(page, "command-input").fill(line);
  await part(page, "command-input").press("Enter");
}

export interface Painted {
  readonly pixels: number;
  readonly width: number;
}

/** How much of a canvas has the palette's colour of that name (`--move` and so on): pixels, and how far apart the outermost are. */
export function painted(page: Page, within: string, colour: string): Promise<Painted> {
  return page.evaluate(
    ([testid, name]) => {
      const element = document.querySelector(`[data-testid="${testid}"]`) as HTMLElement;
      const probe = document.createElement("canvas").getContext("2d") as CanvasRenderingContext2D;
      const wanted = getComputedStyle(element).getPropertyValue(`--${name}`).trim();
      if (wanted === "") throw new Error(`the palette has no --${name}`);
      probe.fillStyle = wanted;
      probe.fillRect(0, 0, 1, 1);
      const [red = 0, green = 0, blue = 0] = probe.getImageData(0, 0, 1, 1).data;
      let pixels = 0;
      let [left, right] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
      for (const canvas of element.querySelectorAll("canvas")) {
        const { data, width } = (canvas.getContext("2d") as CanvasRenderingContext2D).getImageData(0, 0, canvas.width, canvas.height);
        for (let at = 0; at < data.length; at += 4) {
          const off = Math.abs((data[at] ?? 0) - red) + Math.abs((data[at + 1] ?? 0) - green) + Math.abs((data[at + 2] ?? 0) - blue);
          if (off > 12 || (data[at + 3] ?? 0) < 200) continue;
          pixels += 1;
          left = Math.min(left, (at / 4) % width);
          right = Math.max(right, (at / 4) % width);
        }
      }
      return { pixels, width: pixels === 0 ? 0 : right - left };
    },
    [within, colour] as const,
  );
}

export type { Browser, BrowserContext, Page };
