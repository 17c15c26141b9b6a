import assert from "node:assert/strict";
import { test } from "node:test";
import type { Role } from "../src/transport/transport.ts";
import { type Socket, WebSocketTransport } from "../src/transport/websocket.ts";
import { FakeClock } from "./fakes/clock.ts";

/** A socket whose server is the test. */
class FakeSocket implements Socket {
  bufferedAmount = 0;
  binaryType: BinaryType = "blob";
  onopen: Socket["onopen"] = null;
  onmessage: Socket["onmessage"] = null;
  onclose: Socket["onclose"] = null;
  onerror: Socket["onerror"] = null;
  readonly sent: unknown[] = [];
  closed = false;
  readonly role: Role;

  constructor(role: Role) {
    this.role = role;
  }

  send(data: unknown): void {
    this.sent.push(data);
  }

  close(): void {
    this.closed = true;
  }

  says(data: string | object): void {
    const bytes = typeof data === "string" ? data : new TextEncoder().encode(JSON.stringify(data)).buffer;
    this.onmessage?.call(this as unknown as WebSocket, { data: bytes } as MessageEvent);
  }

  ends(code: number, reason = ""): void {
    this.onclose?.call(this as unknown as WebSocket, { code, reason } as CloseEvent);
  }
}

const HELLO = { hello: { robot: "default", seat: "taken" } };

function bench(role: Role = "drive") {
  const clock = new FakeClock();
  const sockets: FakeSocket[] = [];
  const told: string[] = [];
  const transport = new WebSocketTransport("ws://127.0.0.1:8080/base", {
    role,
    clock,
    make: (_, as) => {
      const socket = new FakeSocket(as);
      sockets.push(socket);
      return socket;
    },
  });
  transport.attach({
    connecting: () => told.push("connecting"),
    opened: (opened) => told.push(`opened ${opened.role}`),
    line: (text) => told.push(`line ${text}`),
    world: (message) => told.push(`world ${message}`),
    lost: (why, retryAt) => told.push(`lost ${why} ${retryAt === undefined ? "for good" : retryAt - clock.now()}`),
  });
  transport.open();
  const last = () => sockets.at(-1) as FakeSocket;
  return { clock, sockets, told, transport, last };
}

test("it is open when the server has said hello, in the role that was asked for", () => {
  const { told, last, transport } = bench();
  assert.throws(() => transport.send("m 1"), /no connection/);
  last().says(HELLO);
  assert.deepEqual(told.slice(0, 2), ["connecting", "opened drive"]);
  transport.send("m 1");
  transport.sendWorld('{"id":1}');
  assert.equal(last().sent[0], "m 1");
  assert.equal(new TextDecoder().decode(last().sent[1] as Uint8Array), '{"id":1}');
  last().says("~ 1.000");
  assert.equal(told.at(-1), "line ~ 1.000");
});

test("what is no line is refused, either way", () => {
  const { told, last, transport } = bench();
  last().says(HELLO);
  for (const line of ["", "m 1\n", "m 1°", "x".repeat(256)]) assert.throws(() => transport.send(line), /not sent/);
  assert.deepEqual(last().sent, []);
  const before = told.length;
  for (const line of ["", "a\nb", "é"]) last().says(line);
  assert.equal(told.length, before);
  assert.equal(transport.traffic.damaged, 3);
});

test("who watches sends nothing", () => {
  const { last, transport } = bench("watch");
  last().says(HELLO);
  assert.throws(() => transport.send("Stop"), /only watches/);
  assert.throws(() => transport.sendWorld("{}"), /only watches/);
});

test("a taken seat makes it a watcher at once, and the user's word takes the seat", () => {
  const { sockets, told, last, transport } = bench();
  last().ends(4409, "another page drives");
  assert.equal(last().role, "watch");
  last().says(HELLO);
  assert.equal(told.at(-2), "opened watch");
  last().says({ seat: "free" });
  assert.equal(sockets.length, 2, "a seat that was never its own is not taken unasked");
  transport.takeSeat();
  assert.equal(last().role, "drive");
  last().says(HELLO);
  assert.equal(told.at(-2), "opened drive");
});

test("it comes back as what it was, waiting longer each time", async () => {
  const { clock, sockets, told, last } = bench();
  last().says(HELLO);
  const waits: string[] = [];
  for (const wait of [500, 1000, 2000, 4000, 5000, 5000]) {
    last().ends(1006);
    waits.push(told.at(-1)?.split(" ").at(-1) ?? "");
    await clock.pass(wait - 1);
    const before = sockets.length;
    await clock.pass(2);
    assert.equal(sockets.length, before + 1);
  }
  assert.deepEqual(waits, ["500", "1000", "2000", "4000", "5000", "5000"]);
  assert.ok(sockets.every((socket) => socket.role === "drive"));
  last().says(HELLO);
  last().ends(1006);
  assert.match(told.at(-1) ?? "", / 500$/);
});

test("a watcher comes back as a watcher", async () => {
  const { clock, last } = bench("watch");
  last().says(HELLO);
  last().ends(1006);
  await clock.pass(600);
  assert.equal(last().role, "watch");
});

test("its own seat, not free yet after a loss, is taken again when it is", async () => {
  const { clock, told, last } = bench();
  last().says(HELLO);
  last().ends(1006);
  await clock.pass(600);
  last().ends(4409);
  last().says(HELLO);
  assert.equal(last().role, "watch");
  await clock.pass(4000);
  last().says({ seat: "free" });
  assert.equal(last().role, "drive");
  last().says(HELLO);
  assert.equal(told.at(-2), "opened drive");
});

test("later than that the seat is not taken unasked", async () => {
  const { clock, last } = bench();
  last().says(HELLO);
  last().ends(1006);
  await clock.pass(600);
  last().ends(4409);
  last().says(HELLO);
  await clock.pass(13_000);
  last().says({ seat: "free" });
  assert.equal(last().role, "watch");
});

test("three silent seconds are a loss, if telemetry is on", async () => {
  const { clock, sockets, told, last, transport } = bench();
  last().says(HELLO);
  await clock.pass(10_000);
  assert.equal(sockets.length, 1);
  transport.expectTraffic(true);
  await clock.pass(2900);
  last().says("~ 1.000");
  await clock.pass(2900);
  assert.equal(sockets.length, 1);
  const [silent] = sockets;
  await clock.pass(500);
  assert.match(told.find((each) => each.startsWith("lost")) ?? "", /3 s/);
  assert.ok(silent?.closed);
  silent?.says("~ 2.000");
  assert.ok(!told.includes("line ~ 2.000"), "what comes late of it is nobody's");
});

test("a server that takes nothing is lost", async () => {
  const { clock, told, last, transport } = bench();
  last().says(HELLO);
  last().bufferedAmount = 17_000;
  assert.throws(() => transport.send("Stop"), /lost/);
  assert.match(told.at(-1) ?? "", /takes nothing/);
  await clock.pass(600);
  last().says(HELLO);
  last().bufferedAmount = 17_000;
  await clock.pass(300);
  assert.match(told.at(-1) ?? "", /takes nothing/);
});

test("a server that does not say hello is lost", async () => {
  const { clock, told } = bench();
  await clock.pass(5400);
  assert.match(told.find((each) => each.startsWith("lost")) ?? "", /nobody answers/);
});

test("closed, it does not come back", async () => {
  const { clock, sockets, last, transport } = bench();
  last().says(HELLO);
  transport.close();
  await clock.pass(20_000);
  assert.equal(sockets.length, 1);
  assert.ok(last().closed);
});
