import assert from "node:assert/strict";
import { test } from "node:test";
import { Conversation, KEPT } from "../src/model/conversation.ts";
import { blank, Ring } from "../src/model/history.ts";
import { compose, invert, layout, wrap } from "../src/model/layout.ts";
import type { Pose, Spoken } from "../src/model/model.ts";
import { gaussian, uniform } from "../src/model/random.ts";
import { geometryOf, vehicleOf } from "../src/model/shape.ts";
import { read } from "../src/model/worldline.ts";
import { estPos, gains, ListReader, type MapRow, mapRow, param, paramRow, pathRow, status } from "../src/protocol/replies.ts";
import { isLikePath, looksLike, OWN_STREAM, streamLine, streamOf, valuesOf } from "../src/protocol/telemetry.ts";

const words = (line: string) => line.split(" ");

test("a ring keeps the last samples, in order of their times", () => {
  const ring = new Ring(10);
  for (let at = 0; at < 25; at += 1) assert.ok(ring.push({ ...blank(), t: at / 2, x: at }));
  assert.deepEqual([ring.length, ring.pushed, ring.capacity], [10, 25, 10]);
  assert.deepEqual([ring.at("x", 0), ring.at("x", 9)], [15, 24]);
  assert.ok(Number.isNaN(ring.at("x", 10)) && Number.isNaN(ring.at("x", -1)) && Number.isNaN(ring.at("y", 0)));
  assert.deepEqual(
    [7, 7.5, 7.7, 12, 99].map((t) => ring.indexAt(t)),
    [-1, 0, 0, 9, 9],
  );
  assert.equal(ring.push({ ...blank(), t: 11 }), false, "older than the last");
  assert.equal(ring.push(blank()), false, "no time");
  assert.equal(ring.pushed, 25);
  ring.clear();
  assert.deepEqual([ring.length, ring.indexAt(5), ring.pushed], [0, -1, 26]);
  assert.ok(ring.push({ ...blank(), t: 0 }));
});

test("a ring finds any time as a list would", () => {
  const next = uniform(3);
  const ring = new Ring(64);
  const times: number[] = [];
  for (let at = 0; at < 500; at += 1) {
    const t = (times.at(-1) ?? 0) + (next() < 0.3 ? 0 : next());
    times.push(t);
    ring.push({ ...blank(), t });
    const kept = times.slice(-64);
    const wanted = next() * t * 1.1;
    assert.equal(
      ring.indexAt(wanted),
      kept.findLastIndex((each) => each <= wanted),
    );
  }
});

test("replies are read as docs/protocol.md has them, and nothing else is", () => {
  assert.deepEqual(estPos(words("1 2 90 1.00000e-2 0 0 1 0 2.5e0")), { x: 1, y: 2, theta: 90, covariance: [0.01, 0, 0, 1, 0, 2.5] });
  for (const line of ["1 2 90", "1 2 90 1 0 0 1 0", "1 2 90 1 0 0 1 0 1 1", "1 2 NaN 1 0 0 1 0 1", "x 2 90 1 0 0 1 0 1"])
    assert.equal(estPos(words(line)), undefined);
  assert.deepEqual(status(words("ACCEL DECCEL disabled stall")), {
    moveState: "ACCEL",
    turnState: "DECCEL",
    enabled: false,
    fault: "stall",
  });
  for (const line of ["HOLD HOLD enabled", "HOLD MOVING enabled none", "HOLD HOLD on none", "HOLD HOLD enabled none x"])
    assert.equal(status(words(line)), undefined);
  assert.deepEqual(gains(words("1 2 3 0.1 0.2 0.3")), { values: [1, 2, 3], deviations: [0.1, 0.2, 0.3] });
  assert.equal(gains(words("1 2 3")), undefined);
  assert.deepEqual(param(words("gate 25 -")), { name: "gate", value: 25, unit: "" });
  assert.deepEqual(paramRow(words("motor_friction 0.5 0 12 V*s/m")), {
    name: "motor_friction",
    value: 0.5,
    min: 0,
    max: 12,
    unit: "V*s/m",
  });
  for (const line of ["1.000 0.1 0 12 m", "gate 25 0 1000", "gate x 0 1000 -"]) assert.equal(paramRow(words(line)), undefined);
  assert.deepEqual(pathRow(words("3 1.5 -2 - 0.3")), { number: 3, x: 1.5, y: -2, theta: undefined, speed: 0.3 });
  assert.equal(pathRow(words("3 passed")), "passed");
  for (const line of ["3.000 1.5 -2 - 0.3", "3 1.5 -2 -", "3 1.5 -2 - x", "3"]) assert.equal(pathRow(words(line)), undefined);
  assert.deepEqual(mapRow(words("landmark lamp door 3.0755 169.660 0.0839")), {
    kind: "landmark",
    name: "lamp",
    place: "door",
    spot: { distance: 3.0755, bearing: 169.66, radius: 0.0839 },
  });
});

test("lists are put together, whatever their rows are; one that is cut ends with the next reply", () => {
  const lists = new ListReader();
  assert.equal(lists.begin("Map", words("2 1 1 door")), undefined);
  assert.equal(lists.left, 4);
  assert.equal(lists.take(words("place door 0.300")), true);
  assert.equal(lists.take(words("1.000 2 3")), false);
  assert.equal(lists.take(words("landmark lamp door")), true);
  assert.equal(lists.take(words("place desk 0.500")), true);
  const arc =
    "arc door desk 4.0122 0.000 0.3491 0.000 4.600 - 3.9999 0.0000 0.00000 8.19968e-4 5.79639e-9 2.01699e-8 8.44737e-4 2.37351e-2 6.79974e-1";
  const map = lists.take(words(arc));
  assert.ok(typeof map === "object" && map.kind === "Map" && map.rows.length === 4 && map.anchor === "door");
  assert.deepEqual(lists.begin("Path", words("0 idle")), { kind: "Path", rows: [], mode: "idle" });
  lists.begin("Params", ["3"]);
  assert.equal(lists.begin("Status", words("HOLD HOLD enabled none")), undefined);
  assert.equal(lists.left, 0);
  for (const line of ["Path x path", "Path 1", "Params -1", "Params 1e9", "Map 1 1 1"]) {
    const [keyword = "", ...rest] = words(line);
    lists.begin(keyword, rest);
    assert.equal(lists.left, 0, line);
  }
});

test("streams: what is asked for, and which lines are theirs", () => {
  assert.deepEqual(streamOf("stream 0.1 T,X"), { period: 0.1, fields: ["t", "x"] });
  assert.deepEqual(streamOf("Stream 0.5")?.fields.length, 6);
  assert.equal(streamOf("Stream"), undefined);
  assert.equal(streamOf("m 1"), undefined);
  assert.equal(OWN_STREAM.fields.length, 16);
  assert.ok(streamLine(OWN_STREAM).length < 255 - 12);
  const stream = { period: 0.1, fields: ["t", "move_state", "left_current"] };
  assert.ok(looksLike("~ 1.000 HOLD -", stream) && looksLike("~ 1.000 HOLD 0.125", stream));
  for (const line of ["~ 1 HOLD -", "~ 1.000 HOLD 0.1", "~ 1.000 0.5 0.125", "~ place door 0.300"])
    assert.ok(!looksLike(line, stream), line);
  assert.equal(valuesOf("~ 1.000 HOLD", stream), undefined);
  assert.equal(valuesOf("~ 1.000 HOLD -", { ...stream, period: 0 }), undefined);
  const wide = { period: 1, fields: Array.from({ length: 16 }, () => "x") };
  assert.ok(valuesOf(`~${" 1234567.000000".repeat(15)}`, wide), "the last fields found no room");
  assert.ok(isLikePath({ period: 1, fields: ["left_count", "x", "y", "theta", "v_s"] }) && !isLikePath(OWN_STREAM));
});

test("rows of parameters and paths do not look like the page's telemetry", () => {
  for (const row of ["~ wheel_base 0.2 0.02 5 m", "~ 1 1.000000 0.000000 - -", "~ 1 passed", "~ there door yes-maybe 0.728"])
    assert.ok(!looksLike(row, OWN_STREAM));
});

const arc = (from: string, to: string, likely: Pose, radius: number, half = 1): MapRow => ({
  kind: "arc",
  from,
  to,
  bound: {
    distance: Math.hypot(likely.x, likely.y),
    bearing: (Math.atan2(likely.y, likely.x) * 180) / Math.PI,
    radius,
    heading: likely.theta,
    half,
  },
  freeway: undefined,
  likely,
});
const place = (name: string): MapRow => ({ kind: "place", name, radius: 0.5 });

test("poses compose, and back again", () => {
  const next = uniform(8);
  for (let trial = 0; trial < 100; trial += 1) {
    const pose = () => ({ x: 10 * next() - 5, y: 10 * next() - 5, theta: 360 * next() - 180 });
    const [one, two] = [pose(), pose()];
    const back = compose(compose(one, two), invert(two));
    assert.ok(Math.hypot(back.x - one.x, back.y - one.y) < 1e-9 && Math.abs(wrap(back.theta - one.theta)) < 1e-9);
  }
  assert.deepEqual([wrap(180), wrap(-180), wrap(540), wrap(-190)], [180, 180, 180, 170]);
});

test("a map lies where its places were marked, by the ways that leave the least doubt", () => {
  const rows = [
    place("door"),
    place("desk"),
    place("shelf"),
    place("lost"),
    arc("door", "desk", { x: 4, y: 0, theta: 90 }, 0.3),
    arc("shelf", "desk", { x: 0, y: -2, theta: 0 }, 0.2),
    // A wide way round.
    arc("door", "shelf", { x: 9, y: 9, theta: 0 }, 5),
    { kind: "landmark", name: "lamp", place: "desk", spot: { distance: 1, bearing: 90, radius: 0.1 } } as const,
  ];
  const map = layout(rows, "door", new Map([["door", { x: 1, y: 1, theta: 90 }]]));
  const by = (name: string) => map.places.find((each) => each.name === name);
  const near = (name: string, x: number, y: number) => {
    const { pose } = by(name) ?? {};
    assert.ok(pose && Math.hypot(pose.x - x, pose.y - y) < 1e-9, `${name} ${JSON.stringify(pose)}`);
  };
  near("door", 1, 1);
  near("desk", 1, 5);
  assert.equal(by("desk")?.pose?.theta, 180);
  // Seen from the desk, 2 m to the left of it: it looks along −x, so that is −y.
  near("shelf", 1, 3);
  assert.equal(by("lost")?.pose, undefined);
  const [lamp] = by("desk")?.landmarks ?? [];
  assert.ok(lamp?.x !== undefined && Math.hypot(lamp.x - 1, (lamp.y ?? 0) - 4) < 1e-9);
  assert.equal(map.assumed, undefined);
  assert.ok((by("desk")?.bound ?? 0) >= 0.3 && (by("shelf")?.bound ?? 0) > 0.5 && (by("shelf")?.bound ?? 9) < 1);
  assert.equal(layout(rows, "door", new Map()).assumed, "door");
});

test("the circles of a map are guarantees: no chain of possible motions leaves them", () => {
  const next = uniform(12);
  const possible = (row: MapRow): Pose => {
    assert.ok(row.kind === "arc");
    const { bound } = row;
    const [direction, off] = [2 * Math.PI * next(), bound.radius * Math.sqrt(next())];
    const angle = (bound.bearing * Math.PI) / 180;
    return {
      x: bound.distance * Math.cos(angle) + off * Math.cos(direction),
      y: bound.distance * Math.sin(angle) + off * Math.sin(direction),
      theta: bound.heading + bound.half * (2 * next() - 1),
    };
  };
  for (let trial = 0; trial < 300; trial += 1) {
    const random = () => ({ x: 8 * next() - 4, y: 8 * next() - 4, theta: 360 * next() - 180 });
    // a → b, and c → b, taken back.
    const [ab, cb] = [arc("a", "b", random(), next(), 20 * next()), arc("c", "b", random(), next(), 20 * next())];
    const map = layout([place("a"), place("b"), place("c"), ab, cb], "a", new Map([["a", { x: 0, y: 0, theta: 0 }]]));
    for (let sample = 0; sample < 20; sample += 1) {
      const b = possible(ab);
      const c = compose(b, invert(possible(cb)));
      for (const [name, at] of [
        ["b", b],
        ["c", c],
      ] as const) {
        const known = map.places.find((each) => each.name === name);
        const off = Math.hypot(at.x - (known?.pose?.x ?? 0), at.y - (known?.pose?.y ?? 0));
        assert.ok(off <= (known?.bound ?? 0) + 1e-9, `${name}: ${off} beyond ${known?.bound}`);
      }
    }
  }
});

test("noise is reproducible, of mean 0 and deviation 1", () => {
  const [one, same, other] = [gaussian(1), gaussian(1), gaussian(2)];
  const numbers = Array.from({ length: 20_000 }, () => one());
  assert.deepEqual(
    numbers.slice(0, 5),
    Array.from({ length: 5 }, () => same()),
  );
  assert.notEqual(numbers[0], other());
  const mean = numbers.reduce((sum, each) => sum + each, 0) / numbers.length;
  const variance = numbers.reduce((sum, each) => sum + (each - mean) ** 2, 0) / numbers.length;
  // Three deviations of the mean and the variance of so many.
  assert.ok(Math.abs(mean) < 3 / Math.sqrt(20_000) && Math.abs(variance - 1) < 3 * Math.sqrt(2 / 20_000));
});

test("what people said outlives the chatter, and neither grows", () => {
  const conversation = new Conversation();
  const line = (text: string): Spoken => ({ at: 0, direction: "heard", text });
  conversation.add(line("said"), false);
  for (let at = 0; at < 10_000; at += 1) conversation.add(line(`${at}`), true);
  assert.equal(conversation.lines[0]?.text, "said");
  assert.equal(conversation.lines.at(-1)?.text, "9999");
  assert.ok(conversation.lines.length <= 801);
  for (let at = 0; at < 10_000; at += 1) conversation.add(line(`${at}`), false);
  assert.ok(conversation.lines.length <= KEPT);
});

test("the vehicle is told by the simulator, or by the parameters that it has", () => {
  const parameters = (...names: string[]) => new Map(names.map((name) => [name, { name, value: 2, min: 0, max: 9, unit: "m", before: 2 }]));
  assert.equal(vehicleOf("Bi-Steerable"), "bisteerable");
  assert.equal(vehicleOf("car"), "bisteerable");
  assert.equal(vehicleOf("hovercraft"), undefined);
  assert.equal(geometryOf(parameters("wheel_base", "left_diameter", "right_diameter")).vehicle, "differential");
  assert.equal(geometryOf(parameters("wheel_base", "wheel_diameter", "steer_max")).vehicle, "tricycle");
  assert.deepEqual(geometryOf(parameters("wheel_base", "track", "steer_max", "rear_steered")), {
    vehicle: "bisteerable",
    wheelBase: 2,
    track: 2,
    wheelDiameter: 0.084,
  });
  assert.equal(geometryOf(parameters("turn_lever")).vehicle, "synchro");
  assert.equal(geometryOf(parameters("wheel_base"), "tricycle").vehicle, "tricycle");
});

test("what is not of the simulated world is not read as such", () => {
  for (const message of [
    "",
    "{",
    "[]",
    "null",
    "3",
    '{"world":{}}',
    '{"world":{"t":"1","x":0,"y":0,"theta":0}}',
    '{"seat":"mine"}',
    '{"done":"1"}',
    '{"sent":5}',
  ]) {
    assert.equal(read(message), undefined, message);
  }
  assert.deepEqual(read('{"refused":4,"why":"no"}'), { kind: "refused", id: 4, why: "no" });
  assert.equal(read('{"world":{"t":1,"x":0,"y":0,"theta":0}}')?.kind, "world");
});
