/** Pointers and keys of the top view. What they mean for a goal is in goal.ts; here is which of them it is. */
import { isSpace } from "../keys.ts";

export interface Actions {
  /** A plain press: true if a goal is dragged out from here on, false if the view is panned by it. */
  press(pointer: number, px: number, py: number, append: boolean): boolean;
  move(pointer: number, px: number, py: number, append: boolean): void;
  release(pointer: number): void;
  /** A press that neither dragged a goal nor panned. */
  click(): void;
  /** Whatever is being given is given up; `why` is for the user. */
  cancel(why: string): void;
  /** Something is being given that can be cancelled. */
  readonly giving: boolean;
  pan(dx: number, dy: number): void;
  zoom(px: number, py: number, factor: number): void;
  /** True: the key was meant for the view. */
  key(key: string, fine: boolean): boolean;
}

/** A hand that clicks moves by less, pixels. */
const STILL = 4;

/** Binds a canvas; the returned function ends that. */
export function bind(canvas: HTMLCanvasElement, on: Actions): () => void {
  const ends = new AbortController();
  const { signal } = ends;
  /** `spent`: a goal was given up; what its pointer does until it is released means nothing. */
  const pointers = new Map<number, { x: number; y: number; moved: number; role: "goal" | "view" | "spent" }>();
  const at = (event: PointerEvent | WheelEvent) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top] as const;
  };
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return a && b ? { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) } : undefined;
  };

  const down = (event: PointerEvent) => {
    const [x, y] = at(event);
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    if (on.giving) on.cancel("a second pointer");
    for (const pointer of pointers.values()) pointer.role = "view";
    const goal = event.button === 0 && pointers.size === 0 && on.press(event.pointerId, x, y, event.shiftKey);
    pointers.set(event.pointerId, { x, y, moved: 0, role: goal ? "goal" : "view" });
  };
  const move = (event: PointerEvent) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const [x, y] = at(event);
    if (pointer.role === "spent") return;
    if (pointer.role === "goal") {
      // A second button of the same mouse makes no pointerdown.
      if (event.buttons !== 1) {
        pointer.role = "spent";
        on.cancel("a second button");
      } else on.move(event.pointerId, x, y, event.shiftKey);
      return;
    }
    const before = spread();
    const [dx, dy] = [x - pointer.x, y - pointer.y];
    pointer.moved += Math.hypot(dx, dy);
    pointer.x = x;
    pointer.y = y;
    const after = spread();
    if (before && after) {
      on.pan(after.x - before.x, after.y - before.y);
      if (before.apart > 0 && after.apart > 0) on.zoom(after.x, after.y, after.apart / before.apart);
    } else if (pointer.moved > STILL) on.pan(dx, dy);
  };
  const up = (event: PointerEvent) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    pointers.delete(event.pointerId);
    if (pointer.role === "goal") on.release(event.pointerId);
    else if (pointer.role === "view" && event.button === 0 && pointer.moved <= STILL && pointers.size === 0) on.click();
  };
  const lost = (event: PointerEvent) => {
    const pointer = pointers.get(event.pointerId);
    pointers.delete(event.pointerId);
    if (pointer?.role === "goal") on.cancel("the pointer was lost");
  };
  const away = () => {
    pointers.clear();
    if (on.giving) on.cancel("the page lost the focus");
  };

  canvas.addEventListener("pointerdown", down, { signal });
  canvas.addEventListener("pointermove", move, { signal });
  canvas.addEventListener("pointerup", up, { signal });
  canvas.addEventListener("pointercancel", lost, { signal });
  canvas.addEventListener("lostpointercapture", lost, { signal });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
  canvas.addEventListener("auxclick", (event) => event.preventDefault(), { signal });
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const pixels = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 18 : 1);
      // Two fingers on a touch pad come as a wheel with Ctrl, in small steps.
      on.zoom(...at(event), Math.exp(-Math.max(-120, Math.min(120, pixels)) * (event.ctrlKey ? 0.01 : 0.002)));
    },
    { passive: false, signal },
  );
  canvas.addEventListener(
    "keydown",
    (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (on.key(event.key, event.shiftKey)) event.preventDefault();
    },
    { signal },
  );
  addEventListener("blur", away, { signal });
  document.addEventListener("visibilitychange", () => document.hidden && away(), { signal });
  // Who presses a stopping key, or anything else on the page, has something else in mind than to finish a drag: before anything else hears of it.
  addEventListener(
    "keydown",
    (event) => {
      if (on.giving && (isSpace(event) || event.key === "Escape" || event.key === "Pause" || event.ctrlKey))
        on.cancel(event.key === "Escape" ? "Esc" : "Stop");
    },
    { capture: true, signal },
  );
  document.addEventListener(
    "pointerdown",
    (event) => {
      if (on.giving && event.target !== canvas) on.cancel("a press elsewhere");
    },
    { capture: true, signal },
  );
  return () => ends.abort();
}
