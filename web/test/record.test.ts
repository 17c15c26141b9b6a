import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { blank, Ring } from "../src/model/history.ts";
import { LogModel } from "../src/model/log.ts";
import { uniform } from "../src/model/random.ts";
import { csv } from "../src/record/csv.ts";
import { step } from "../src/record/odometry.ts";
import { type Known, MAX_BYTES, readLog, readRecording } from "../src/record/read.ts";

const NOBODY: Known = { geometry: { vehicle: "differential", wheelBase: 0.3, track: 0.3, wheelDiameter: 0.1 }, parameters: new Map() };

/** A file that comes in small pieces. */
function file(text: string | Blob, name = "a.csv", piece = 7) {
  const blob = typeof text === "string" ? new Blob([text]) : text;
  return {
    name,
    size: blob.size,
    stream: () =>
      new ReadableStream<Uint8Array>({
        async start(controller) {
          const bytes = new Uint8Array(await blob.arrayBuffer());
          for (let at = 0; at < bytes.length; at += piece) controller.enqueue(bytes.slice(at, at + piece));
          controller.close();
        },
      }),
  };
}

const TRACE =
  "t,true_x,true_y,true_theta,est_x,est_y,est_theta,cxx,cxy,cxt,cyy,cyt,ctt,s,s_ref,v_s,v_s_ref,alpha,alpha_ref,v_alpha,v_alpha_ref,move_state,turn_state,left_count,right_count,left_speed,right_speed,left_duty,right_duty,left_current,right_current,battery,fault";
const ROW = (t: number, fault = "none") =>
  `${t},1,2,3.14159265358979,1.1,2.1,1.5707963267949,1e-4,0,1e-3,1e-4,0,1e-2,0,0,0.3,0.31,0,0,0.5,0.6,MOVE,HOLD,10,11,0.3,0.3,0.5,0.6,0.1,0.2,12.3,${fault}`;

test("a trace: radians become degrees, with the truth, the covariance and the faults", async () => {
  const model = await readLog(file(`${TRACE}\r\n${ROW(0)}\r\n${ROW(0.5)}\r\n${ROW(1, "stall")}\r\n`, "run.csv"), NOBODY);
  const { history } = model;
  assert.deepEqual(model.connection, { state: "log", name: "run.csv" });
  const close = (value: number, to: number) => assert.ok(Math.abs(value - to) < 1e-9, `${value}`);
  close(history.at("theta", 0), 90);
  close(history.at("true_theta", 0), 180);
  close(history.at("v_alpha", 1), (0.5 * 180) / Math.PI);
  close(history.at("v_s_ref", 1), 0.31);
  assert.equal(history.length, 3);
  const [estimate] = model.estimates;
  close(estimate?.covariance[2] ?? 0, (1e-3 * 180) / Math.PI);
  close(estimate?.covariance[5] ?? 0, 1e-2 * (180 / Math.PI) ** 2);
  assert.deepEqual(model.status, { moveState: "MOVE", turnState: "HOLD", enabled: undefined, fault: "stall" });
  model.setCursor(0.7);
  assert.equal(model.status?.fault, "none");
  assert.ok(model.commands === undefined && !model.mayDrive);
  assert.match(model.spoken.at(-1)?.text ?? "", /does not tell the vehicle; it is drawn as differential, 0.3 m .* since no base has told/);
});

test("what is wrong is told with its line and column", async () => {
  const wrong: [string, RegExp][] = [
    [`${TRACE}\n${ROW(0)}\n${ROW(1).replace("12.3", "NaN")}\n`, /^Error: line 3: column `battery`: `NaN` is not a number$/],
    [`${TRACE}\n${ROW(0).replace("MOVE", "RUN")}\n`, /^Error: line 2: column `move_state`: `RUN` is not one of HOLD/],
    [`${TRACE}\n${ROW(1)}\n${ROW(0.5)}\n`, /^Error: line 3: column `t`: 0.5 is before 1/],
    [`${TRACE}\n${ROW(1)},7\n`, /^Error: line 2: 34 cells instead of 33/],
    [TRACE.replace("battery,", ""), /^Error: line 1: column `battery` is missing/],
    [`${TRACE},t\n`, /^Error: line 1: column `t` appears twice/],
    ["a,b,c\n1,2,3\n", /^Error: line 1: these are not the columns/],
    ["hello\n", /^Error: line 1: `hello` is neither/],
    ["\0\0\x01,\n", /^Error: line 1: it is no text file/],
    ["", /no row/],
    [`${TRACE}\n`, /no row/],
    ["t,left,right,x\n", /^Error: line 1: of the columns x, y and theta/],
    ["t,left\n", /^Error: line 1: these are not the columns/],
    ["t,drive,steer\n", /vehicle that steers/],
    // A car's: not to be taken for a differential drive's.
    ["t,left,right,steer,front_left,front_right\n", /^Error: line 1: .*vehicle that steers/],
    ["t,left,right\n0,1,2\n1,1.5,2\n", /^Error: line 3: column `left`: 1.5 is not a count$/],
    ["t,left,right\n0,1,3e9\n", /^Error: line 2: column `right`: 3000000000 is not a count$/],
  ];
  for (const [text, message] of wrong)
    await assert.rejects(
      readRecording(file(text), NOBODY),
      (error) => message.test(String(error)) || assert.fail(`${error} for ${message}`),
    );
  await assert.rejects(readRecording({ ...file("x"), size: MAX_BYTES + 1 }, NOBODY), /201 MB, and 200 MB are the most/);
  await assert.rejects(readRecording(file("x".repeat(300_000), "a", 65_536), NOBODY), /of no log/);
});

test("what is saved is read as it was", async () => {
  const ring = new Ring(100);
  for (let at = 0; at < 150; at += 1) {
    ring.push({
      ...blank(),
      t: at / 50,
      x: at / 3,
      y: -1e-9,
      theta: 179.99999,
      move_state: at % 4,
      turn_state: 0,
      left_current: at % 2 ? Number.NaN : 0.5,
      battery: 12,
    });
  }
  const { blob, rows } = csv(
    { history: ring, faultAt: (t) => (t < 2 ? undefined : t < 2.5 ? "stall" : "none") },
    Number.NEGATIVE_INFINITY,
    Number.POSITIVE_INFINITY,
  );
  assert.equal(rows, ring.length);
  const part = csv({ history: ring }, 1.99, 2.5);
  assert.equal(part.rows, 26, "the rows of a stretch, its ends included");
  assert.match((await part.blob.text()).split("\n")[2] ?? "", /^2,/);
  assert.equal(csv({ history: ring }, 10, 20).rows, 0);
  assert.equal(csv({ history: new Ring(1) }, Number.NEGATIVE_INFINITY, Number.POSITIVE_INFINITY).rows, 0);
  const text = await blob.text();
  const [comment = "", header = ""] = text.split("\n");
  assert.match(comment, /^# units: t s; x m; .*theta deg/);
  assert.equal(
    header,
    "t,x,y,theta,v_s,v_s_ref,v_alpha,v_alpha_ref,move_state,turn_state,left_duty,right_duty,left_current,right_current,battery,tick_load,true_x,true_y,true_theta,fault",
  );
  const model = await readLog(file(blob, "saved.csv", 1000), NOBODY);
  assert.equal(model.history.length, ring.length);
  for (let at = 0; at < ring.length; at += 1) {
    for (const channel of ["t", "x", "y", "theta", "move_state", "left_current", "battery", "true_x"] as const) {
      const [saved, was] = [model.history.at(channel, at), ring.at(channel, at)];
      // Six decimals are kept.
      assert.ok(Object.is(saved, was) || Math.abs(saved - was) <= 5e-7, `${channel} ${saved} ${was}`);
    }
  }
  assert.ok(model instanceof LogModel);
  assert.deepEqual([model.faultAt(1.5), model.faultAt(2.2), model.faultAt(2.9)], [undefined, "stall", "none"]);
});

test("a replay: radians, with its covariance", async () => {
  const text =
    "t,x,y,theta,cxx,cxy,cxt,cyy,cyt,ctt,position_error,heading_error\n0.000000,1.0,2.0,-1.570796327,1e-4,0,0,1e-4,0,1e-2,0,0\n0.1,1,2,0,0,0,0,0,0,0,0,0\n";
  const model = await readLog(file(text), NOBODY);
  assert.ok(Math.abs(model.history.at("theta", 0) + 90) < 1e-6);
  assert.equal(model.estimates.length, 2);
  assert.ok(Number.isNaN(model.history.at("v_s", 0)));
});

test("a robot's log is integrated with the wheels in use, and says with which", async () => {
  const parameter = (value: number) => ({ name: "", value, min: 0, max: 9e9, unit: "", before: value });
  const known: Known = {
    ...NOBODY,
    parameters: new Map([
      ["wheel_base", parameter(0.5)],
      ["left_diameter", parameter(0.1)],
      ["right_diameter", parameter(0.1)],
      ["counts_per_turn", parameter(1000)],
      ["gain_right", parameter(1.1)],
    ]),
  };
  // The first row's counts were before the start.
  const text = "t,left,right,x,y,theta\n0,999,999,1,2,1.5707963267949\n1,1000,1000,1,2.3,1.5707963267949\n";
  const model = await readLog(file(text), known);
  const [left, right] = [Math.PI * 0.1, Math.PI * 0.11];
  const [x, y, theta] = step([1, 2, Math.PI / 2], left, right, 0.5);
  const last = (channel: "x" | "y" | "theta" | "v_s") => model.history.at(channel, 1);
  assert.ok(Math.hypot(last("x") - x, last("y") - y) < 1e-9 && Math.abs(last("theta") - (theta * 180) / Math.PI) < 1e-6);
  assert.ok(Math.abs(last("v_s") - (left + right) / 2) < 1e-12);
  assert.equal(model.history.at("true_y", 1), 2.3);
  assert.match(model.spoken[0]?.text ?? "", /0.5 m apart, with 1000 counts to a turn: those that the connected base has told/);
  assert.match((await readLog(file(text), NOBODY)).spoken[0]?.text ?? "", /those of a new base/);
  assert.equal(model.estimates.length, 0, "there is no covariance, so none is claimed");
});

test("a step of odometry is along an arc of a circle", () => {
  // A quarter of a circle of radius 1 about (0, 1), wheels 0.4 m apart.
  const [x, y, theta] = step([0, 0, 0], (Math.PI / 2) * 0.8, (Math.PI / 2) * 1.2, 0.4);
  assert.ok(Math.abs(x - 1) < 1e-12 && Math.abs(y - 1) < 1e-12 && Math.abs(theta - Math.PI / 2) < 1e-12);
  assert.deepEqual(step([0, 0, 0], 1, 1, 0.4), [1, 0, 0]);
});

test("a transcript: telemetry by its look, estimates, faults, and all that was said", async () => {
  const text = [
    "0.001\t! boot power-on",
    "0.100\t~ 0.100 0.100000 0.200000 30.00000 0.300000 1.00000",
    "0.120\t~ 0.120 0.2 0 0 0 0 0 0 HOLD",
    "0.200\t~ place door 0.300",
    "0.300\t@4 EstPos 0.4 0.2 30 1e-4 0 0 1e-4 0 1",
    "0.400\t! fault no-motion left",
    "0.500\tStatus HOLD HOLD enabled no-motion",
    "0.700\t@5 EstPos 0.5 0.2 30 1e-4 0 0 1e-4 0 1",
    "0.800\tOK*0000",
    "",
  ].join("\n");
  const model = await readLog(file(text, "run.txt"), NOBODY);
  assert.deepEqual(
    [model.history.length, model.history.at("x", 0), model.history.at("v_s", 0), model.history.at("x", 1)],
    [2, 0.1, 0.3, 0.5],
  );
  // Among telemetry a reply is no row of its own, but what it tells is kept.
  assert.deepEqual(
    model.estimates.map(({ t }) => t),
    [0.3, 0.7],
  );
  assert.ok(model instanceof LogModel);
  assert.deepEqual([model.faultAt(0.3), model.faultAt(0.4)], [undefined, "no-motion"]);
  assert.equal(model.spoken.length, 10);
  assert.match(model.spoken[8]?.text ?? "", /damaged/);
  await assert.rejects(readRecording(file("1.0\tOK\nrubbish\n"), NOBODY), /line 2: column 1: `rubbish`/);
});

test("comments, empty lines, a byte order mark, quoted cells and any line end are read", async () => {
  for (const end of ["\n", "\r\n", "\r"]) {
    const text = [
      "\uFEFF# saved",
      "",
      TRACE.split(",")
        .map((name) => `"${name}"`)
        .join(","),
      ROW(0),
      "",
      ROW(1),
    ].join(end);
    assert.equal((await readRecording(file(text), NOBODY)).history.length, 2);
  }
});

test("a long log keeps all its rows, and thins its ellipses rather than its ends", async () => {
  const rows = Array.from({ length: 250_000 }, (_, at) => `${at / 50},0,0,0,0,0,0,0,0,0`);
  const recording = await readRecording(file(`t,x,y,theta,cxx,cxy,cxt,cyy,cyt,ctt\n${rows.join("\n")}`, "long.csv", 1 << 16), NOBODY);
  assert.equal(recording.history.length, 250_000);
  assert.equal(recording.history.indexAt(4999), 249_950);
  assert.ok(recording.estimates.length > 50_000 && recording.estimates.length <= 100_000);
  assert.ok((recording.estimates.at(-1)?.t ?? 0) > 4999.8 && (recording.estimates[0]?.t ?? 9) < 0.2);
});

test("random damage to a log is an error with its line, or no matter; never a hang", async () => {
  const next = uniform(5);
  const whole = `${TRACE}\n${ROW(0)}\n${ROW(1)}\n${ROW(2)}\n`;
  let refused = 0;
  for (let trial = 0; trial < 300; trial += 1) {
    const at = Math.floor(next() * whole.length);
    const damaged = whole.slice(0, at) + String.fromCharCode(Math.floor(next() * 256)) + whole.slice(at + 1 + Math.floor(next() * 4));
    try {
      const { history } = await readRecording(file(damaged, "x", 512), NOBODY);
      for (let row = 0; row < history.length; row += 1)
        assert.ok(Number.isFinite(history.at("t", row)) && Number.isFinite(history.at("x", row)));
    } catch (error) {
      refused += 1;
      assert.match(String(error), /^Error: (line \d+: |there is no row)/);
    }
  }
  assert.ok(refused > 50);
});

/** What `hil-sim run hil-sim/scenarios/faults.script` gave: with `--trace` and `--trace-period 0.25`, and what it printed. */
const real = async (name: string) => readLog(file(await readFile(new URL(`data/${name}`, import.meta.url), "utf8"), name, 1000), NOBODY);

test("a run in which things break: its trace and its transcript tell the same faults", async () => {
  const trace = await real("faults-trace.csv");
  const transcript = await real("faults-transcript.txt");
  assert.ok(trace instanceof LogModel && transcript instanceof LogModel);
  // Between two rows of the trace nothing is known: times are such that both have told.
  for (const [t, fault] of [
    [2.4, "no-motion"],
    [3, "estop"],
    [4.8, "none"],
    [6, "mismatch"],
    [11.2, "none"],
  ] as const) {
    assert.deepEqual([t, trace.faultAt(t), transcript.faultAt(t)], [t, fault, fault]);
  }
  // No pose is told in the transcript, and still it can be scrubbed through, with its states.
  assert.ok(Number.isNaN(transcript.history.at("x", 0)));
  transcript.setCursor(2.6);
  assert.deepEqual(transcript.status, { moveState: "HOLD", turnState: "HOLD", enabled: undefined, fault: "estop" });
  trace.setCursor(2.05);
  assert.deepEqual([trace.status?.moveState, trace.status?.fault], ["MOVE", "none"]);
  // The stuck encoder makes the estimate stop short of where the base is.
  const last = trace.history.length - 1;
  assert.ok(trace.history.at("true_x", last) - trace.history.at("x", last) > 0.02);
});
