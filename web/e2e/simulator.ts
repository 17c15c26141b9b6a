/** The simulator as a process of its own: `$HIL_SIM`, or the release build of this repository. */
import { type ChildProcess, execFileSync, spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
export const WEB = dirname(here);
const BINARY = process.env.HIL_SIM ?? join(WEB, "../target/release/hil-sim");
const START_MS = 20_000;

/** They end with this process, whatever it ends by: a test that hangs is ended by a signal, and leaves none behind. */
const running = new Set<ChildProcess>();
process.once("exit", () => {
  for (const child of running) child.kill("SIGKILL");
});
for (const signal of ["SIGINT", "SIGTERM", "SIGHUP"] as const) process.once(signal, () => process.exit(1));

export interface Simulator {
  /** What it has printed that the caller waits for: an address or a path. */
  readonly at: string;
  readonly pid: number;
  /** It goes on, or stands still, as a process that the system does not let run. */
  freeze(frozen: boolean): void;
  end(): Promise<void>;
}

async function start(args: readonly string[], wanted: RegExp): Promise<Simulator> {
  if (!existsSync(BINARY)) throw new Error(`${BINARY} is not there: cargo build --release -p hil-sim, or set HIL_SIM`);
  const child = spawn(BINARY, ["drive", ...args], { stdio: ["pipe", "pipe", "inherit"] });
  running.add(child);
  const ended = new Promise<void>((resolve) => child.once("exit", () => resolve()));
  void ended.then(() => running.delete(child));
  return {
    at: await printed(child, wanted),
    pid: child.pid ?? 0,
    freeze: (frozen) => child.kill(frozen ? "SIGSTOP" : "SIGCONT"),
    end: async () => {
      child.kill("SIGKILL");
      await ended;
    },
  };
}

function printed(child: ChildProcess, wanted: RegExp): Promise<string> {
  return new Promise((resolve, reject) => {
    let text = "";
    const failed = (why: string) => {
      clearTimeout(timer);
      child.kill("SIGKILL");
      reject(new Error(`the simulator ${why}; it said: ${text}`));
    };
    const timer = setTimeout(() => failed("does not say where it is"), START_MS);
    child.once("error", (error) => failed(`does not start: ${error.message}`));
    const exited = (code: number | null) => failed(`ended with ${code}`);
    child.once("exit", exited);
    child.stdout?.on("data", (data) => {
      text += data;
      const found = wanted.exec(text)?.[1];
      if (found === undefined) return;
      clearTimeout(timer);
      child.off("exit", exited);
      resolve(found);
    });
  });
}

/** Runs a script of hil-sim/scenarios and writes its trace. */
export function trace(scenario: string, file: string): void {
  execFileSync(BINARY, ["run", join(WEB, "../hil-sim/scenarios", scenario), "--trace", file], { stdio: ["ignore", "ignore", "inherit"] });
}

/** The page is served at `at`. */
export function serve(port = 0, ...args: readonly string[]): Promise<Simulator> {
  return start(["--web", `127.0.0.1:${port}`, ...args], /(http:\/\/[\d.:]+\/)/);
}

/** The serial line is the pseudo-terminal `at`. */
export function pty(...args: readonly string[]): Promise<Simulator> {
  return start(["--pty", ...args], /pseudo-terminal (\S+)/);
}
