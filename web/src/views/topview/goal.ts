/**
 * A goal that is dragged out: a press fixes the point, a drag beyond some pixels sets the heading, the release gives the order. A robot drives by this, so
 * it ends without an order by anything that makes the order doubtful, and only the pointer that began it can finish it.
 */
import type { Goal } from "../../model/model.ts";
import { DEGREE, wrapDegrees } from "./geometry.ts";

/** A finger does not lie still: less than so many pixels is no direction. */
export const DRAG_PIXELS = 12;

export interface Dragged {
  readonly goal: Goal;
  /** Adds to the path instead of replacing it. */
  readonly append: boolean;
}

interface Drag {
  readonly pointer: number;
  readonly px: number;
  readonly py: number;
  readonly x: number;
  readonly y: number;
  append: boolean;
  theta: number | undefined;
}

export class GoalDrag {
  private drag: Drag | undefined;

  get active(): boolean {
    return this.drag !== undefined;
  }

  /** What would be ordered now. */
  get dragged(): Dragged | undefined {
    const { drag } = this;
    return drag && { goal: { x: drag.x, y: drag.y, theta: drag.theta }, append: drag.append };
  }

  /** Begins, if no other pointer has; returns whether it did. */
  press(pointer: number, px: number, py: number, world: readonly [number, number], append: boolean): boolean {
    if (this.drag) return false;
    this.drag = { pointer, px, py, x: world[0], y: world[1], append, theta: undefined };
    return true;
  }

  move(pointer: number, px: number, py: number, append: boolean): void {
    const { drag } = this;
    if (drag?.pointer !== pointer) return;
    drag.append = append;
    const [dx, dy] = [px - drag.px, drag.py - py];
    // Half a degree is finer than a hand is steady.
    drag.theta = Math.hypot(dx, dy) > DRAG_PIXELS ? wrapDegrees(Math.round((2 * Math.atan2(dy, dx)) / DEGREE) / 2) : undefined;
  }

  /** Ends it; returns what is to be ordered, if it was this pointer's and nothing has cancelled it. */
  release(pointer: number): Dragged | undefined {
    if (this.drag?.pointer !== pointer) return undefined;
    const { dragged } = this;
    this.drag = undefined;
    return dragged;
  }

  cancel(): void {
    this.drag = undefined;
  }
}

/** What a line of the conversation may be without making an order doubtful that is being given. */
const HARMLESS = /^! (posture \d+|move done|turn done|path done|map lost)\b/;
const STOPPING = /^(@\d+ )?e?stop\b/i;

/** One of the lines is a Stop that was sent, or an event after which nobody would want an old order to be given. */
export function interrupts(lines: readonly { readonly direction: string; readonly text: string }[]): boolean {
  return lines.some(({ direction, text }) =>
    direction === "sent" ? STOPPING.test(text) : direction === "heard" && text.startsWith("! ") && !HARMLESS.test(text),
  );
}

/** A goal set by keys: arrows move a crosshair, Enter fixes it, arrows turn the heading, Enter gives the order. */
export interface KeyGoal {
  readonly x: number;
  readonly y: number;
  /** Undefined: the point is still being moved; null: fixed, its heading left open. */
  readonly theta: number | null | undefined;
}

/** Degrees by which an arrow turns the heading. */
export const KEY_TURN = 15;
export const KEY_TURN_FINE = 1;

/** The next state by a key; "send" for the order itself, "leave" for giving up; undefined if the key means nothing. `step` is in metres. */
export function keyed(goal: KeyGoal, key: string, step: number, fine: boolean): KeyGoal | "send" | "leave" | undefined {
  if (key === "Escape") return "leave";
  if (key === "Enter") return goal.theta === undefined ? { ...goal, theta: null } : "send";
  const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
  if (!arrow) return undefined;
  const [right, up] = arrow as [number, number];
  if (goal.theta === undefined) {
    const length = fine ? step / 10 : step;
    return { x: goal.x + right * length, y: goal.y + up * length, theta: undefined };
  }
  // Up leaves the heading open again; sideways turns it, counter-clockwise to the left, beginning straight along x.
  if (up !== 0) return { ...goal, theta: up > 0 ? null : (goal.theta ?? 0) };
  const turn = -right * (fine ? KEY_TURN_FINE : KEY_TURN);
  return { ...goal, theta: wrapDegrees((goal.theta ?? 0) + turn) };
}
