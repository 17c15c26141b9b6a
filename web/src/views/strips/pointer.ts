/** Pointers on the strips: the cross-hair, scrubbing by a drag, and Ctrl with the wheel for the length of time. */

export interface PointerActions {
  /** Where the plots lie in the column, pixels. */
  plot(): { readonly left: number; readonly width: number };
  /** A log or the past is looked at: a click goes there. Live, it takes a drag, so that a slip of the hand does not freeze the view. */
  paused(): boolean;
  hover(px: number | undefined): void;
  scrub(px: number): void;
  zoom(longer: boolean): void;
}

const DRAG_PIXELS = 6;
const ZOOM_STEP = 40;

export function bindPointer(column: HTMLElement, on: PointerActions): () => void {
  const ends = new AbortController();
  const { signal } = ends;
  let pressed: { id: number; x: number; scrubbing: boolean } | undefined;
  let turned = 0;
  const within = (event: PointerEvent) => {
    const { left, width } = on.plot();
    const px = event.clientX - column.getBoundingClientRect().left - left;
    return px >= 0 && px <= width ? px : undefined;
  };
  const onPlot = (event: PointerEvent) => (event.target as Element).closest(".strip-body") !== null;

  column.addEventListener(
    "pointerdown",
    (event) => {
      if (event.button !== 0 || !onPlot(event) || within(event) === undefined) return;
      pressed = { id: event.pointerId, x: event.clientX, scrubbing: on.paused() };
      if (pressed.scrubbing) on.scrub(within(event) ?? 0);
    },
    { signal },
  );
  column.addEventListener(
    "pointermove",
    (event) => {
      const px = within(event);
      on.hover(onPlot(event) ? px : undefined);
      if (pressed?.id !== event.pointerId) return;
      if (!pressed.scrubbing && Math.abs(event.clientX - pressed.x) > DRAG_PIXELS) {
        pressed.scrubbing = true;
        column.setPointerCapture(event.pointerId);
      }
      if (pressed.scrubbing && px !== undefined) on.scrub(px);
    },
    { signal },
  );
  for (const kind of ["pointerup", "pointercancel"] as const) {
    column.addEventListener(
      kind,
      (event) => {
        if (pressed?.id === event.pointerId) pressed = undefined;
      },
      { signal },
    );
  }
  column.addEventListener("pointerleave", () => on.hover(undefined), { signal });
  column.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      turned += event.deltaY;
      if (Math.abs(turned) < ZOOM_STEP) return;
      on.zoom(turned > 0);
      turned = 0;
    },
    { passive: false, signal },
  );
  return () => ends.abort();
}
