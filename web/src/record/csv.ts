/** Saves a stretch of the history as a table that this page, and any other program, can read. */
import { CHANNELS, type Channel, type Model, STATES } from "../model/model.ts";

const UNITS: Readonly<Record<Channel, string>> = {
  t: "s",
  x: "m",
  y: "m",
  theta: "deg",
  v_s: "m/s",
  v_s_ref: "m/s",
  v_alpha: "deg/s",
  v_alpha_ref: "deg/s",
  move_state: "state",
  turn_state: "state",
  left_duty: "-1 to 1",
  right_duty: "-1 to 1",
  left_current: "A",
  right_current: "A",
  battery: "V",
  tick_load: "share of the tick's period",
  true_x: "m",
  true_y: "m",
  true_theta: "deg",
};

/** Rows that are put together before the next piece begins: a string for all of them would be too long. */
const PIECE = 5000;

/** What has a history to save. */
export interface Saved extends Pick<Model, "history"> {
  /** The fault that was latched at a time, as far as it is known. */
  faultAt?(t: number): string | undefined;
}

/** An empty cell is not known. */
export function csv(model: Saved, from: number, to: number): { blob: Blob; rows: number } {
  const { history } = model;
  let begin = Math.max(0, history.indexAt(from));
  while (begin < history.length && history.at("t", begin) < from) begin += 1;
  const end = history.indexAt(to) + 1;
  const units = CHANNELS.map((channel) => `${channel} ${UNITS[channel]}`).join("; ");
  const pieces = [`# units: ${units}; empty: not known\n${[...CHANNELS, "fault"].join(",")}\n`];
  for (let first = begin; first < end; first += PIECE) {
    let piece = "";
    for (let at = first; at < Math.min(first + PIECE, end); at += 1) {
      const cells = CHANNELS.map((channel) => cell(channel, history.at(channel, at)));
      piece += `${cells.join(",")},${model.faultAt?.(history.at("t", at)) ?? ""}\n`;
    }
    pieces.push(piece);
  }
  return { blob: new Blob(pieces, { type: "text/csv" }), rows: Math.max(0, end - begin) };
}

function cell(channel: Channel, value: number): string {
  if (Number.isNaN(value)) return "";
  if (channel === "move_state" || channel === "turn_state") return STATES[value] ?? "";
  // Six decimals are what the base tells; more would be of the arithmetic.
  return String(Number(value.toFixed(6)));
}
