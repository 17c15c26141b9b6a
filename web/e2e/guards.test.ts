/** Who must not drive: pages of other origins, requests under other names, and a second controller. */
import assert from "node:assert/strict";
import { createServer, request } from "node:http";
import type { AddressInfo } from "node:net";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { type Browser, type BrowserContext, connected, launch, MOVES, now, open, type Page, sent, type } from "./harness.ts";
import { type Simulator, serve } from "./simulator.ts";

let browser: Browser;
let context: BrowserContext;
let simulator: Simulator;

before(async () => {
  browser = await launch();
});
beforeEach(async () => {
  simulator = await serve();
  context = await browser.newContext();
});
afterEach(async () => {
  try {
    await context.close();
  } finally {
    await simulator.end();
  }
});
after(() => browser.close());

interface Answer {
  readonly status: number;
  readonly headers: Readonly<Record<string, string | string[] | undefined>>;
  readonly body: string;
}

/** A request as another program would make it, with any headers. */
function get(path: string, headers: Readonly<Record<string, string>> = {}): Promise<Answer> {
  return new Promise((resolve, reject) => {
    const asked = request(new URL(path, simulator.at), { headers: { ...headers } }, (answer) => {
      let body = "";
      answer.on("data", (data) => {
        body += data;
      });
      answer.on("end", () => resolve({ status: answer.statusCode ?? 0, headers: answer.headers, body }));
    });
    asked.on("upgrade", (answer, socket) => {
      socket.destroy();
      resolve({ status: answer.statusCode ?? 0, headers: answer.headers, body: "" });
    });
    asked.on("error", reject);
    asked.end();
  });
}

const UPGRADE = {
  Connection: "Upgrade",
  Upgrade: "websocket",
  "Sec-WebSocket-Version": "13",
  "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
  "Sec-WebSocket-Protocol": "drive",
};

/** What becomes of a WebSocket that a page opens: how it was closed, and what it heard. */
interface Outcome {
  readonly opened: boolean;
  readonly code: number;
  readonly heard: number;
}

/** A page that watches, and so hears all that reaches the base, whoever sent it. */
async function witness(): Promise<Page> {
  const page = await open(context, simulator.at);
  await connected(page, "watch");
  return page;
}

/** Nothing that moves has reached the base, and it has not moved, after the time in which it would have. */
async function assertStill(watcher: Page, driver: Page): Promise<void> {
  await driver.bringToFront();
  await watcher.waitForTimeout(1000);
  const orders = (await sent(watcher)).filter((line) => MOVES.test(line));
  assert.deepEqual(orders, [], "what reached the base");
  assert.ok((await sent(watcher)).length > 5, "a watcher does hear what reaches it");
  assert.ok(Math.abs(await now(driver, "x")) < 1e-6);
  await connected(driver, "drive");
}

test("a page of another origin gets no connection, whatever role it asks for, and its orders reach nobody", async () => {
  const own = await open(context, simulator.at);
  await connected(own, "drive");
  const watcher = await witness();
  const foreign = createServer((_, answer) => answer.setHeader("Content-Type", "text/html").end("<title>foreign</title>"));
  await new Promise<void>((resolve) => foreign.listen(0, "127.0.0.1", resolve));
  try {
    const page = await context.newPage();
    for (const host of ["127.0.0.1", "localhost"]) {
      await page.goto(`http://${host}:${(foreign.address() as AddressInfo).port}/`);
      for (const role of ["drive", "watch"]) {
        const outcome = await page.evaluate(
          ([url, as]) =>
            new Promise<Outcome>((resolve) => {
              const socket = new WebSocket(url, as);
              let opened = false;
              let heard = 0;
              socket.onopen = () => {
                opened = true;
                socket.send("m 1 0.3");
              };
              socket.onmessage = () => {
                heard += 1;
              };
              socket.onclose = ({ code }) => resolve({ opened, code, heard });
            }),
          [`${simulator.at.replace("http", "ws")}base`, role] as const,
        );
        assert.deepEqual(outcome, { opened: false, code: 1006, heard: 0 }, `${host} ${role}`);
      }
      // Nor may it read the page, or show it in a frame of its own.
      const read = await page.evaluate(
        (url) =>
          fetch(url).then(
            () => "read",
            () => "refused",
          ),
        simulator.at,
      );
      assert.equal(read, "refused");
      await page.evaluate(
        (url) =>
          new Promise<void>((resolve) => {
            const frame = document.createElement("iframe");
            frame.onload = () => setTimeout(resolve, 300);
            frame.src = url;
            document.body.append(frame);
          }),
        simulator.at,
      );
      const [, frame] = page.frames();
      assert.ok(frame);
      // The driver of the browser may look into a frame of any origin.
      const inFrame = await frame.evaluate(() => [document.title, document.getElementById("stopbar") === null]);
      assert.deepEqual(
        [inFrame[0] !== (await own.title()), inFrame[1]],
        [true, true],
        `the frame shows an error and not the page: ${inFrame[0]}`,
      );
    }
  } finally {
    foreign.close();
  }
  await assertStill(watcher, own);
});

test("a request under another name is refused: a name that somebody points here does not open the door", async () => {
  const { port } = new URL(simulator.at);
  for (const host of [`evil.example:${port}`, "evil.example", "127.0.0.1:1", "127.0.0.1", `127.0.0.1.evil.example:${port}`]) {
    assert.equal((await get("/", { Host: host })).status, 421, host);
    const origin = `http://${host}`;
    assert.equal((await get("/base", { ...UPGRADE, Host: host, Origin: origin })).status, 421, host);
  }
  for (const host of [`127.0.0.1:${port}`, `localhost:${port}`]) assert.equal((await get("/", { Host: host })).status, 200, host);
});

test("a WebSocket without an origin, or of another, is refused; the page's own is not", async () => {
  const own = new URL(simulator.at).origin;
  for (const origin of ["http://evil.example", "null", `${own}.evil.example`, own.replace("http", "https"), "http://127.0.0.1"]) {
    assert.equal((await get("/base", { ...UPGRADE, Origin: origin })).status, 403, origin);
  }
  assert.equal((await get("/base", UPGRADE)).status, 403);
  assert.equal((await get("/base", { ...UPGRADE, Origin: own })).status, 101);
});

test("the page may load nothing from elsewhere, and no other page may frame it", async () => {
  const { headers, body } = await get("/");
  const policy = String(headers["content-security-policy"]);
  assert.match(policy, /default-src 'none'|default-src 'self'/);
  assert.match(policy, /frame-ancestors 'none'/);
  assert.ok(!/https?:\/\/(?!www\.w3\.org)[^\s"'`]*\.(js|css|woff2?|png)\b/.test(body), "nothing is fetched from elsewhere");
  assert.match(body, /<meta name="base" content="served">/);
});

test("a second controller is refused the seat at once, and what it sends reaches nobody", async () => {
  const first = await open(context, simulator.at);
  await connected(first, "drive");
  const second = await context.newPage();
  // The server's own page, without its script's WebSocket: what matters is the origin.
  await second.goto(`${simulator.at}`);
  await connected(second, "watch");
  const outcome = await second.evaluate(
    (url) =>
      new Promise<Outcome>((resolve) => {
        const socket = new WebSocket(url, "drive");
        let opened = false;
        let heard = 0;
        socket.onopen = () => {
          opened = true;
          socket.send("m 1 0.3");
        };
        socket.onmessage = () => {
          heard += 1;
        };
        socket.onclose = ({ code }) => resolve({ opened, code, heard });
      }),
    `${simulator.at.replace("http", "ws")}base`,
  );
  assert.deepEqual([outcome.opened, outcome.code], [true, 4409]);
  await first.bringToFront();
  await type(first, "GetTime");
  await assertStill(second, first);
});
