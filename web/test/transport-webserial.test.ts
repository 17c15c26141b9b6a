import assert from "node:assert/strict";
import { test } from "node:test";
import { uniform } from "../src/model/random.ts";
import { WebSerialTransport } from "../src/transport/webserial.ts";
import { FakeClock, settle } from "./fakes/clock.ts";
import { FakePort, FakeSerial } from "./fakes/serial.ts";

async function bench(port = new FakePort(0x0483, 0x374b)) {
  const clock = new FakeClock();
  const serial = new FakeSerial();
  serial.chosen = port;
  const transport = await WebSerialTransport.request(serial as unknown as Serial, clock);
  const told: string[] = [];
  transport.attach({
    connecting: () => told.push("connecting"),
    opened: ({ another }) => told.push(another ? "opened another" : "opened"),
    line: (text) => told.push(`line ${text}`),
    world: () => told.push("world"),
    lost: (why, retryAt) => told.push(`lost ${why}${retryAt === undefined ? "; waits" : ""}`),
  });
  transport.open();
  await settle();
  return { clock, serial, port, transport, told, lines: () => told.filter((each) => each.startsWith("line")) };
}

test("115 200 baud, 8 bits, no parity; the first thing sent is an empty line", async () => {
  const { port, told, transport } = await bench();
  assert.deepEqual(
    [port.options?.baudRate, port.options?.dataBits, port.options?.parity, port.options?.stopBits, port.options?.bufferSize],
    [115_200, 8, "none", 1, 16_384],
  );
  assert.equal(transport.to, "USB 0483:374b");
  assert.deepEqual(told, ["connecting", "opened"]);
  transport.send("@1 Version");
  await settle();
  assert.equal(port.written, "\n@1 Version\n");
  assert.equal(port.opened, 1, "the port that the user chose was opened once");
});

test("lines come as they end, and garbage is counted", async () => {
  const { port, lines, transport } = await bench();
  port.hear("@1 O");
  port.hear("K\r\n~ 1.0");
  await settle();
  assert.deepEqual(lines(), ["line @1 OK"]);
  port.hear(`00\r\n${"x".repeat(300)}\r\n`);
  port.hear(Uint8Array.of(65, 255, 66, 10));
  await settle();
  assert.deepEqual(lines(), ["line @1 OK", "line ~ 1.000"]);
  assert.equal(transport.traffic.damaged, 2);
});

for (const name of ["FramingError", "ParityError", "BufferOverrunError", "BreakError"]) {
  test(`${name}: it reads on, and the half line before does not join what follows`, async () => {
    const { port, lines, told } = await bench();
    port.hear("m 1");
    await settle();
    port.fails(name);
    await settle();
    port.hear("5 0.3\n@2 OK\n");
    await settle();
    assert.deepEqual(lines(), ["line @2 OK"]);
    assert.ok(!told.some((each) => each.startsWith("lost")));
  });
}

test("the same error fifty times within a second is a lost line; spread over minutes it is none", async () => {
  const { clock, port, told } = await bench();
  for (let error = 0; error < 200; error += 1) {
    port.fails("FramingError");
    await clock.pass(30);
  }
  assert.ok(!told.some((each) => each.startsWith("lost")));
  for (let error = 0; error < 50; error += 1) {
    port.fails("FramingError");
    await settle();
  }
  assert.ok(told.some((each) => each.startsWith("lost 50 errors within a second")));
  await clock.pass(600);
  assert.equal(told.at(-1), "opened", "it is opened anew");
});

test("a writer that takes nothing for a second is lost, and what waited in it is not sent later", async () => {
  const { clock, port, told, transport } = await bench();
  port.stalls = true;
  transport.send("m 1");
  transport.send("m 2");
  await clock.pass(900);
  assert.ok(!told.some((each) => each.startsWith("lost")));
  await clock.pass(200);
  assert.ok(told.some((each) => each.startsWith("lost the port takes nothing")));
  port.stalls = false;
  await clock.pass(2000);
  assert.equal(told.at(-1), "opened");
  assert.ok(!port.written.includes("m 2"));
  transport.send("Stop");
  await settle();
  assert.ok(port.written.endsWith("\nStop\n"));
});

test("unplugged: it waits, and comes back by itself when the same port is back", async () => {
  const { clock, serial, port, told, transport } = await bench();
  port.dies();
  serial.tell("disconnect", port);
  await clock.pass(20_000);
  assert.ok(
    told.some((each) => each.startsWith("lost") && each.endsWith("; waits")),
    told.join(),
  );
  assert.throws(() => transport.send("m 1"), /no connection/);
  assert.equal(port.opened, 1);
  const before = port.written;
  serial.tell("connect", port);
  await clock.pass(50);
  assert.equal(told.at(-1), "opened");
  assert.equal(port.written, `${before}\n`, "nothing but an empty line is sent by itself");
});

test("a port that only looks alike may be another board's; a different one is nobody's", async () => {
  const { clock, serial, port, told } = await bench();
  port.dies();
  serial.tell("disconnect", port);
  await clock.pass(1000);
  serial.tell("connect", new FakePort(0x1a86, 0x7523));
  await clock.pass(6000);
  assert.notEqual(told.at(-1), "opened");
  const alike = new FakePort(0x0483, 0x374b);
  serial.tell("connect", alike);
  await clock.pass(50);
  assert.equal(told.at(-1), "opened another");
  assert.equal(alike.opened, 1);
});

test("a cable that flaps leaves one open port, the one that is plugged in, and all others closed", async () => {
  const next = uniform(7);
  const { clock, serial, port, told, transport } = await bench();
  const ports = [port];
  let current = port;
  for (let flap = 0; flap < 200; flap += 1) {
    current.dies();
    serial.tell("disconnect", current);
    // The next thing happens before, while or after what the last one began is at its end.
    if (next() < 0.5) await clock.pass(Math.floor(next() * 1200));
    else for (let turn = next() * 6; turn > 1; turn -= 1) await Promise.resolve();
    if (next() < 0.3) {
      current = new FakePort(0x0483, 0x374b);
      ports.push(current);
    }
    serial.tell("connect", current);
    for (let turn = next() * 6; turn > 1; turn -= 1) await Promise.resolve();
  }
  await clock.pass(10_000);
  assert.match(told.at(-1) ?? "", /^opened/);
  assert.deepEqual(
    ports.filter((each) => each.readable !== null),
    [current],
  );
  const opened = told.filter((each) => each.startsWith("opened")).length;
  assert.ok(opened > 10 && opened <= 201, `${opened} of 200 were long enough to be opened`);
  transport.send("@1 Version");
  await settle();
  assert.ok(current.written.endsWith("\n@1 Version\n"));
  assert.ok(ports.every((each) => each === current || !each.written.includes("Version")));
});

test("two ports that say nothing of themselves do not look alike", async () => {
  const { clock, serial, port, told } = await bench(new FakePort());
  serial.tell("disconnect", port);
  await clock.pass(1000);
  serial.tell("connect", new FakePort());
  await clock.pass(1000);
  assert.match(told.at(-1) ?? "", /^lost/);
});

test("a port that does not open is tried again", async () => {
  const { clock, port, told } = await bench();
  port.refuses = "Failed to open serial port.";
  port.dies();
  await clock.pass(3000);
  assert.match(told.at(-1) ?? "", /does not open/);
  port.refuses = undefined;
  await clock.pass(5000);
  assert.equal(told.at(-1), "opened");
});

test("silence is a loss only while telemetry is on", async () => {
  const { clock, told, transport } = await bench();
  await clock.pass(10_000);
  assert.equal(told.at(-1), "opened");
  transport.expectTraffic(true);
  await clock.pass(3600);
  assert.ok(told.some((each) => each.startsWith("lost nothing has been heard")));
});

test("closed, it lets go of the port and of the browser's events", async () => {
  const { clock, serial, port, told, transport } = await bench();
  transport.close();
  await transport.closed;
  assert.equal(port.readable, null);
  serial.tell("connect", port);
  await clock.pass(10_000);
  assert.equal(port.opened, 1);
  assert.equal(told.at(-1), "opened");
});

test("who chooses no port, or one that is in use, is told", async () => {
  const serial = new FakeSerial();
  const ask = () => WebSerialTransport.request(serial as unknown as Serial, new FakeClock());
  await assert.rejects(ask, /No port selected/);
  const { port } = await bench();
  serial.chosen = port;
  await assert.rejects(ask, /open already/);
});
