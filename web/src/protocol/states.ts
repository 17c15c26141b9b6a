/** The states of an axis, in the order of their numbers in the history. */
export const STATES = ["HOLD", "ACCEL", "MOVE", "DECCEL"] as const;
export type AxisState = (typeof STATES)[number];
