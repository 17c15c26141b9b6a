/** What stands about the canvas: buttons, legend, status, hint. */
import { button, h, toggle } from "../dom.ts";

export interface Panel {
  readonly frame: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly status: HTMLElement;
  readonly hint: HTMLElement;
  readonly follow: HTMLButtonElement;
  destroy(): void;
}

export interface PanelActions {
  zoom(factor: number): void;
  fit(): void;
  follow(): void;
  keyGoal(): void;
  /** From here on presses add postures, or no longer. */
  adds(on: boolean): void;
}

const LEGEND: readonly (readonly [swatch: string, text: string])[] = [
  ["est", "estimated: base (wheels to scale) and way"],
  ["true", "true: ghost and way (simulator, or a log that has it)"],
  ["banana", "95 % region, bent by the heading’s doubt (banana)"],
  ["ellipse", "95 % ellipse of x and y"],
  ["fan", "heading ± 1.96 σ"],
  ["plan", "planned postures and legs"],
  ["goal", "goal being set"],
  ["meadow", "place with its meadow"],
  ["bound", "where a place certainly lies"],
  ["freeway", "arc of the map, freeway with its width"],
  ["landmark", "landmark ◆"],
];

export function panel(element: HTMLElement, on: PanelActions): Panel {
  const status = h("p", { class: "topview-status", id: "topview-status" });
  const canvas = h("canvas", {
    class: "topview-canvas",
    tabindex: "0",
    role: "application",
    "aria-roledescription": "map",
    "aria-label":
      "Top view. A click or drag sets a goal, with Shift it adds a posture. Arrow keys pan, plus and minus zoom, F follows, 0 fits, G sets a goal by keys: Enter sends it, with Shift it adds a posture.",
    "aria-describedby": "topview-status",
    "data-picture": "Top view: estimated (solid), true (dashed)",
  });
  const follow = button("Follow", on.follow, { "aria-pressed": "true", title: "Keep the base in view (f)" });
  const tools = h(
    "div",
    { class: "topview-tools", role: "group", "aria-label": "View" },
    button("+", () => on.zoom(1.5), { "aria-label": "Zoom in", title: "Zoom in (+)" }),
    button("−", () => on.zoom(1 / 1.5), { "aria-label": "Zoom out", title: "Zoom out (−)" }),
    button("Fit", on.fit, { title: "Fit all in (0)" }),
    follow,
    button("Goal", on.keyGoal, { title: "Set a goal by keys (g)", "aria-label": "Set a goal by keys" }),
    toggle("Add", false, on.adds, {
      title: "A press adds a posture to the path, as with Shift, instead of replacing the goal",
      "data-testid": "add-postures",
    }),
  );
  const legend = h(
    "details",
    { class: "topview-legend" },
    h("summary", {}, "Legend"),
    h(
      "ul",
      {},
      ...LEGEND.map(([swatch, text]) => h("li", {}, h("span", { class: `swatch swatch-${swatch}`, "aria-hidden": "true" }), text)),
    ),
  );
  const hint = h("p", { class: "topview-hint", role: "status", hidden: true });
  const frame = h("div", { class: "topview-frame" }, canvas, tools, legend, hint);
  const root = h("div", { class: "topview" }, frame, status);
  element.append(root);
  return { frame, canvas, status, hint, follow, destroy: () => root.remove() };
}
