/** What the client must know of commands: which stop, and how numbers are written. */

/** The keyword of a command, in lower case. */
export function keywordOf(body: string): string {
  return body.trim().split(/[\s,]/, 1)[0]?.toLowerCase() ?? "";
}

/** The words behind the keyword. */
export function wordsOf(body: string): string[] {
  return body
    .trim()
    .split(/[\s,]+/)
    .slice(1);
}

export type Halt = "Stop" | "EStop";

/** Whether a line is a Stop or an EStop, however it is written. */
export function haltOf(body: string): Halt | undefined {
  const only = body.trim().toLowerCase();
  return only === "stop" ? "Stop" : only === "estop" ? "EStop" : undefined;
}

/** The answers that may take longer than others, by the protocol's page: flash is written, the map is searched. */
const SLOW = new Set([
  "saveparams",
  "loadparams",
  "mark",
  "amithere",
  "sight",
  "label",
  "route",
  "crosses",
  "getmap",
  "forgetmap",
  "freeway",
]);

/** Silence after which a command counts as unanswered, ms. */
export function patience(body: string): number {
  return SLOW.has(keywordOf(body)) ? 3000 : 1000;
}

/** A number for the base, which reads f32: six decimals, or six digits if it is small. */
export function format(value: number): string {
  if (!Number.isFinite(value) || Math.abs(value) > 3.4e38) throw new Error(`${value} is not a number that the base takes`);
  if (value === 0) return "0";
  if (Math.abs(value) < 1e-3) return value.toExponential(5).replace("e+", "e");
  return value.toFixed(6).replace(/\.?0+$/, "");
}
