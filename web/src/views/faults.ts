/** The faults of docs/safety.md, as the banner tells them. A test holds each row against that page. */

export interface Fault {
  readonly cause: string;
  /** `off`: the motors are off at once; `stop`: it decelerates first. */
  readonly reaction: "off" | "stop";
  readonly clearing: string;
}

const AT_ONCE = "at once";
const RETURNS = "at once; it comes back with the next motion if its cause lasts";

export const FAULTS: ReadonlyMap<string, Fault> = new Map<string, Fault>([
  [
    "estop",
    {
      cause: "emergency-stop circuit open, stop button pressed, or the EStop command",
      reaction: "off",
      clearing: "circuit closed and button released",
    },
  ],
  [
    "output",
    { cause: "a PWM channel or a pin of a motor driver refused to be written", reaction: "off", clearing: "the outputs can be written" },
  ],
  ["watchdog", { cause: "the watchdog reset the controller: the tick or the main loop hung", reaction: "off", clearing: AT_ONCE }],
  [
    "no-motion",
    {
      cause:
        "a wheel's counts stand while its motor's voltage would turn it: blocked, no power, or a dead encoder (without current sensing they look alike)",
      reaction: "off",
      clearing: RETURNS,
    },
  ],
  [
    "stall",
    {
      cause: "as no-motion for half a second, and the motor's current is that of a motor that stands",
      reaction: "off",
      clearing: AT_ONCE,
    },
  ],
  [
    "encoder-stuck",
    {
      cause: "as no-motion, and the motor's current is that of a motor that turns: the encoder is stuck or unplugged",
      reaction: "off",
      clearing: AT_ONCE,
    },
  ],
  [
    "encoder-channel",
    {
      cause: "as no-motion, and the count flickers by one: one of the encoder's two channels is lost",
      reaction: "off",
      clearing: AT_ONCE,
    },
  ],
  [
    "encoder-sign",
    {
      cause: "a wheel's counts run against its motor's voltage: encoder or motor reversed, or the base is overpowered",
      reaction: "off",
      clearing: AT_ONCE,
    },
  ],
  [
    "encoder-jump",
    {
      cause: "more counts within 10 ms than 3 times max_wheel_speed can make; they are left out of the pose",
      reaction: "off",
      clearing: AT_ONCE,
    },
  ],
  [
    "mismatch",
    {
      cause:
        "a wheel's speed does not fit its motor's voltage: counts are lost or added, a weak motor, or motor parameters that are not the motor's",
      reaction: "off",
      clearing: AT_ONCE,
    },
  ],
  [
    "wheels-fighting",
    {
      cause: "both motors push, in opposite directions although no turn is under way, and neither wheel moves",
      reaction: "off",
      clearing: AT_ONCE,
    },
  ],
  ["overcurrent", { cause: "a motor's current above max_current for 20 ms", reaction: "off", clearing: "currents below max_current" }],
  ["overspeed", { cause: "a wheel above 1.25 times max_wheel_speed for 30 ms", reaction: "off", clearing: "wheels below max_wheel_speed" }],
  [
    "following",
    {
      cause: "an axis 5 times its lag away from its reference for 50 ms, or held up for a second",
      reaction: "off",
      clearing: AT_ONCE,
    },
  ],
  [
    "steering",
    {
      cause:
        "the steering is more than 10 degrees from where it is told to point for half a second: jammed, without power, or a torn sensor",
      reaction: "stop",
      clearing: RETURNS,
    },
  ],
  [
    "undervoltage",
    {
      cause: "battery below supply_min times supply for 0.1 s while the motors are on",
      reaction: "stop",
      clearing: "battery above supply_min times supply",
    },
  ],
  [
    "overvoltage",
    {
      cause: "battery above supply_max times supply for 0.1 s while the motors are on",
      reaction: "off",
      clearing: "battery below supply_max times supply",
    },
  ],
  [
    "link",
    {
      cause: "no accepted line for deadman seconds during a motion without a finite target; an axis with a target goes on to it",
      reaction: "stop",
      clearing: "at once: ClearFault is a sign of life",
    },
  ],
  ["overrun", { cause: "20 ticks missed in a row, or more than every third one for long", reaction: "stop", clearing: AT_ONCE }],
  ["estimator", { cause: "the pose or its covariance is not finite", reaction: "stop", clearing: "after ResetPos" }],
  [
    "storage",
    {
      cause: "at the start: what was saved last cannot be read any more; an older set or the defaults are in force",
      reaction: "off",
      clearing: "at once: it says that they have been looked at",
    },
  ],
]);

/** What the reaction means, for who does not know the table. */
export const REACTIONS: Readonly<Record<Fault["reaction"], string>> = {
  off: "The motors are off.",
  stop: "The base decelerates, then its motors are off.",
};

/** `no-motion (left wheel)`. */
export function faultTitle(name: string, place: "left" | "right" | "both" | undefined): string {
  if (place === undefined) return name;
  return place === "both" ? `${name} (both wheels)` : `${name} (${place} wheel)`;
}
