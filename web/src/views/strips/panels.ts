/** What the strips show: which channels, how each line looks, and over which range. */
import type { Channel } from "../../model/model.ts";
import type { Palette } from "../theme.ts";
import { closeRange, niceRange } from "./scales.ts";

export interface LineWish {
  readonly channel: Channel;
  readonly name: string;
  readonly colour: keyof Palette;
  readonly dashed: boolean;
}

export interface StripWish {
  /** Of its test id, `strip-…`. */
  readonly id: string;
  readonly title: string;
  readonly unit: string;
  readonly lines: readonly LineWish[];
  /** What is shown of a value: a share as percents. */
  readonly factor: number;
  readonly digits: number;
  readonly range: (low: number | null, high: number | null) => [number, number];
  /** What is said if the channels are never told. */
  readonly absent: string;
}

const line = (channel: Channel, name: string, colour: keyof Palette, dashed = false): LineWish => ({ channel, name, colour, dashed });
const nice = (low: number, high: number, fixed = false) => {
  const wish = { least: [low, high] as const, fixed };
  return (least: number | null, greatest: number | null) => niceRange(least, greatest, wish);
};

export const STRIPS: readonly StripWish[] = [
  {
    id: "speed",
    title: "Speed",
    unit: "m/s",
    lines: [line("v_s_ref", "reference", "plan", true), line("v_s", "v_s", "est")],
    factor: 1,
    digits: 3,
    range: nice(-0.05, 0.05),
    absent: "not in this Stream",
  },
  {
    id: "turn",
    title: "Turning",
    unit: "°/s",
    lines: [line("v_alpha_ref", "reference", "plan", true), line("v_alpha", "v_α", "est")],
    factor: 1,
    digits: 1,
    range: nice(-5, 5),
    absent: "not in this Stream",
  },
  {
    id: "duty",
    title: "Duties",
    unit: "",
    lines: [line("left_duty", "left", "est"), line("right_duty", "right", "true", true)],
    factor: 1,
    digits: 2,
    range: nice(-1, 1, true),
    absent: "not in this Stream",
  },
  {
    id: "current",
    title: "Currents",
    unit: "A",
    lines: [line("left_current", "left", "est"), line("right_current", "right", "true", true)],
    factor: 1,
    digits: 2,
    range: nice(-0.5, 0.5),
    absent: "not measured by this base",
  },
  {
    id: "battery",
    title: "Battery",
    unit: "V",
    lines: [line("battery", "supply", "est")],
    factor: 1,
    digits: 2,
    range: (low, high) => closeRange(low, high, 1),
    absent: "not measured by this base",
  },
  {
    id: "load",
    title: "Tick load",
    unit: "%",
    lines: [line("tick_load", "of its period", "est")],
    factor: 100,
    digits: 1,
    range: nice(0, 10),
    absent: "not measured by this base",
  },
];

/** Where the states stand among them. */
export const STATES_AFTER = "turn";
