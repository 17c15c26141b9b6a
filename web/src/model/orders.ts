/** What the views may do to a live base, in protocol lines. */
import { format, haltOf } from "../protocol/command.ts";
import { unwrap } from "../protocol/line.ts";
import { OLDER_STREAM, OWN_STREAM, streamLine } from "../protocol/telemetry.ts";
import type { Commands, Goal, WorldRequest } from "./model.ts";
import { gaussian } from "./random.ts";

/** What a base may be asked for. */
export interface Line {
  /** As a user's command. `since`: the count of Stops when it was decided. */
  ask(line: string, since?: number): Promise<string>;
  /** Stops asked for so far. */
  readonly halts: number;
  halt(what: "Stop" | "EStop"): void;
  note(text: string): void;
  takeSeat(): void;
  confirmBase(): void;
  world(request: WorldRequest): Promise<void>;
  watchGains(on: boolean): void;
  /** The true pose, with its age in seconds; undefined if there is none, or it is too old. */
  truth(): { readonly x: number; readonly y: number; readonly theta: number; readonly age: number } | undefined;
}

/** Asks for the page's telemetry; a base that does not know all of it is asked for less. */
export async function ownStream(line: Pick<Line, "ask">): Promise<string> {
  const reply = await line.ask(streamLine(OWN_STREAM));
  return reply.startsWith("ERR syntax") ? line.ask(streamLine(OLDER_STREAM)) : reply;
}

/** What a byte takes on the serial line, at 115 200 baud. */
const BYTE_S = 10 / 115_200;
/** Bytes of a fix's line besides what it says: tag, age, check, line end. */
const AROUND_A_FIX = 20;

const TYPED_TAG = /^@\d*\s*/;
const TYPED_CHECK = /\*[^*]*$/;

/** A line as it was typed, without what the client puts around it. */
function bare(typed: string, note: (text: string) => void): string {
  const line = typed.trim();
  const rest = line.replace(TYPED_TAG, "").replace(TYPED_CHECK, "").trim();
  // Whatever follows a `*` is meant as a check; one that is wrong says that the line is not what it was. A Stop needs none.
  if (line.includes("*") && unwrap(line).check !== "good" && !haltOf(rest)) throw new Error("not sent: the line's check is wrong");
  if (rest !== line) note("the page puts its own tag and check around the line");
  return rest;
}

function place({ x, y }: Goal): string {
  return `${format(x)} ${format(y)}`;
}

export function orders(line: Line): Commands {
  const stop = (what: "Stop" | "EStop") => () => line.halt(what);
  return {
    send: async (typed) => {
      const body = bare(typed, line.note);
      if (body === "") throw new Error("not sent: an empty line says nothing");
      return line.ask(body);
    },
    stop: stop("Stop"),
    estop: stop("EStop"),
    enable: () => line.ask("Enable"),
    disable: () => line.ask("Disable"),
    clearFault: () => line.ask("ClearFault"),
    goTo: async (goal) => line.ask(`GoTo ${place(goal)}${goal.theta === undefined ? "" : ` ${format(goal.theta)}`}`),
    follow: async (goal) => {
      const since = line.halts;
      // Postures that a Stop has left are not what is asked for now: a path that does not go on begins with the click.
      const before = await line.ask("GetPath", since);
      if (/ idle$/.test(before) && !/ 0 idle$/.test(before)) await line.ask("Follow clear", since);
      const added = await line.ask(`Follow ${place(goal)} ${goal.theta === undefined ? "-" : format(goal.theta)}`, since);
      if (added.startsWith("ERR")) return added;
      const path = await line.ask("GetPath", since);
      return / idle$/.test(path) ? line.ask("Follow start", since) : added;
    },
    setParameter: async (name, value) => line.ask(`SetParam ${name} ${value}`),
    saveParameters: () => line.ask("SaveParams"),
    watchGains: (on) => line.watchGains(on),
    ownStream: () => ownStream(line),
    takeSeat: () => line.takeSeat(),
    confirmBase: () => line.confirmBase(),
    world: (request) => line.world(request),
    observeTruth: async (sigmaXy, sigmaTheta, seed) => {
      const truth = line.truth();
      if (!truth) throw new Error("the true pose is not known, or too old");
      const next = gaussian(seed);
      const [x, y] = [truth.x + sigmaXy * next(), truth.y + sigmaXy * next()];
      const theta = truth.theta + sigmaTheta * next();
      const [xx, tt] = [format(sigmaXy ** 2), format(sigmaTheta ** 2)];
      const fix = `ObservePos ${format(x)} ${format(y)} ${format(theta)} ${xx} 0 0 ${xx} 0 ${tt}`;
      // It is as old as it is when its line has arrived: at 90 deg/s, the 7 ms that it takes on the serial line are more than half a degree.
      const underWay = (fix.length + AROUND_A_FIX) * BYTE_S;
      return line.ask(`${fix} ${format(truth.age + underWay)}`);
    },
  };
}
