/** The top view: where the base is, was, and is to go. */
import type { Model, Spoken, Topic } from "../../model/model.ts";
import { setText, show } from "../dom.ts";
import { MAX_PIXEL_RATIO, type Palette, readPalette, watchPalette } from "../theme.ts";
import { reason, refusal, type View as Shown } from "../view.ts";
import { Extent, fit, follow, pan, toScreen, toWorld, type View, zoomAbout } from "./geometry.ts";
import { type Dragged, GoalDrag, interrupts, type KeyGoal, keyed } from "./goal.ts";
import { Ground } from "./ground.ts";
import { bind } from "./input.ts";
import { paint } from "./paint.ts";
import { panel } from "./panel.ts";
import { silhouette } from "./silhouette.ts";
import { freshFor, type Snapshot, snapshot } from "./snapshot.ts";
import { Trail } from "./trail.ts";
import { statusWords, whyNoGoal } from "./words.ts";

const TOPICS: readonly Topic[] = [
  "connection",
  "history",
  "estimate",
  "status",
  "parameters",
  "path",
  "map",
  "world",
  "spoken",
  "events",
  "alarm",
  "cursor",
];
/** At the start, a small base is drawn at so many pixels a metre, and a large one no larger than so many pixels. */
const FIRST_SCALE = 140;
const FIRST_RADIUS = 40;
/** Pixels a metre, the most that Fit zooms in. */
const CLOSEST_FIT = 300;
/** What Fit leaves free on each side, pixels: the buttons stand there, and names beside their places. */
const FIT_MARGIN = 72;
/** The share of the canvas in which the base is kept. */
const FOLLOWED = 0.6;
const STILL = { speed: 0, turning: 0 };
const KEY_PAN = 60;
/** How far an arrow moves the crosshair, pixels. */
const KEY_STEP = 20;
const HINT_MS = 6000;
const STATUS_MS = 1000;

export function mount(element: HTMLElement, first: Model): Shown {
  let model = first;
  let unsubscribe = () => {};
  let view: View = { x: 0, y: 0, scale: FIRST_SCALE, width: 0, height: 0 };
  let following = true;
  /** The view was laid about the base once; and the user has set its scale since. */
  let placed = false;
  let scaled = false;
  const ways = { estimated: new Trail("x", "y"), truly: new Trail("true_x", "true_y") };
  const ground = new Ground();
  const drag = new GoalDrag();
  /** Presses add postures without Shift, too: a finger has none. */
  let adds = false;
  let byKeys: KeyGoal | undefined;
  /** A goal whose answer is awaited. */
  let ordered: Dragged | undefined;
  let heardAtPress: Spoken | undefined;

  const ui = panel(element, {
    zoom: (factor) => zoom(view.width / 2, view.height / 2, factor),
    fit: () => fitAll(),
    follow: () => setFollowing(!following),
    keyGoal: () => {
      ui.canvas.focus();
      beginByKeys();
    },
    adds: (on) => {
      adds = on;
    },
  });
  const { canvas } = ui;
  const context = canvas.getContext("2d", { alpha: false });
  if (!context) throw new Error("this browser draws no canvas");
  let palette: Palette = readPalette(element);

  // One frame is asked for when something has changed, and none otherwise; what grows old changes by itself.
  let frame = 0;
  let ageing: ReturnType<typeof setTimeout> | undefined;
  const invalidate = () => {
    if (frame === 0) frame = requestAnimationFrame(draw);
  };
  const draw = () => {
    frame = 0;
    clearTimeout(ageing);
    if (!resize()) return;
    const shown = snapshot(model, performance.now());
    place(shown);
    const goal = drag.dragged ?? keyDragged() ?? ordered;
    const words = drag.active ? "release to order, Esc cancels" : byKeys ? keyWords(byKeys) : ordered ? "asked for" : "";
    const ratio = canvas.width / view.width;
    paint({ ctx: context, view, palette, ratio }, ground, model, shown, ways, goal && { dragged: goal, words });
    tell(shown);
    // A second later its age is another one, but a fresh one is stale within half of that.
    const wait = freshFor(shown) ?? (shown.age > 0 || shown.truthAge > 0 ? 1000 : undefined);
    if (wait !== undefined) ageing = setTimeout(invalidate, wait + 10);
  };
  const resize = () => {
    const ratio = Math.min(MAX_PIXEL_RATIO, devicePixelRatio || 1);
    const { clientWidth: width, clientHeight: height } = ui.frame;
    if (width < 1 || height < 1) return false;
    const [across, down] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== across || canvas.height !== down) {
      canvas.width = across;
      canvas.height = down;
    }
    if (view.width !== width || view.height !== height) view = { ...view, width, height };
    return true;
  };
  const place = ({ pose }: Snapshot) => {
    if (!pose) return;
    // What the base looks like is known only after it was asked.
    if (!scaled) view = { ...view, scale: Math.min(FIRST_SCALE, FIRST_RADIUS / silhouette(model.geometry, STILL, false).radius) };
    if (!placed) {
      view = { ...view, x: pose.x, y: pose.y };
      placed = true;
    } else if (following && !drag.active && !byKeys) view = follow(view, pose.x, pose.y, FOLLOWED);
  };

  let told = 0;
  let telling: ReturnType<typeof setTimeout> | undefined;
  const tell = (shown: Snapshot) => {
    const wait = told + STATUS_MS - performance.now();
    if (wait > 0) {
      telling ??= setTimeout(() => {
        telling = undefined;
        tell(snapshot(model, performance.now()));
      }, wait);
      return;
    }
    told = performance.now();
    setText(ui.status, statusWords(model, shown));
  };
  let hinting: ReturnType<typeof setTimeout> | undefined;
  const hint = (text: string) => {
    clearTimeout(hinting);
    setText(ui.hint, text);
    show(ui.hint, text !== "");
    if (text) hinting = setTimeout(() => hint(""), HINT_MS);
  };

  const setFollowing = (on: boolean) => {
    following = on;
    ui.follow.setAttribute("aria-pressed", String(on));
    if (on) {
      const { pose } = snapshot(model, performance.now());
      if (pose) view = { ...view, x: pose.x, y: pose.y };
    }
    invalidate();
  };
  const panBy = (dx: number, dy: number) => {
    view = pan(view, dx, dy);
    if (following) setFollowing(false);
    invalidate();
  };
  const zoom = (px: number, py: number, factor: number) => {
    view = zoomAbout(view, px, py, factor);
    scaled = true;
    invalidate();
  };
  const fitAll = () => {
    const extent = new Extent();
    for (const { line } of [ways.estimated, ways.truly]) {
      for (let index = 0; index < line.x.length; index += 1) extent.add(line.x[index] as number, line.y[index] as number);
    }
    const { pose, truth } = snapshot(model, performance.now());
    for (const at of [pose, truth]) if (at) extent.add(at.x, at.y, 0.5);
    for (const { x, y } of model.path.postures) extent.add(x, y, 0.3);
    for (const { pose: at, radius, bound } of model.map?.places ?? []) if (at) extent.add(at.x, at.y, Math.max(radius, bound));
    if (extent.bounds) view = fit(view, extent.bounds, FIT_MARGIN, CLOSEST_FIT);
    scaled = true;
    if (following) setFollowing(false);
    invalidate();
  };

  const begun = () => {
    heardAtPress = model.spoken.at(-1);
    hint("");
  };
  const giveUp = (why: string) => {
    if (!drag.active && !byKeys) return;
    drag.cancel();
    byKeys = undefined;
    hint(`The goal was given up (${why}): nothing was sent.`);
    invalidate();
  };
  const order = async (given: Dragged) => {
    const refused = whyNoGoal(model);
    const { commands } = model;
    if (refused !== undefined || !commands) {
      hint(refused ?? "");
      return;
    }
    ordered = given;
    invalidate();
    try {
      const why = refusal(await (given.append ? commands.follow(given.goal) : commands.goTo(given.goal)));
      if (why !== undefined) hint(`Refused: ${why}`);
    } catch (error) {
      hint(reason(error));
    } finally {
      if (ordered === given) ordered = undefined;
      invalidate();
    }
  };

  const beginByKeys = () => {
    const refused = whyNoGoal(model);
    if (refused !== undefined) {
      hint(refused);
      return;
    }
    byKeys = { x: view.x, y: view.y, theta: undefined };
    begun();
    invalidate();
  };
  const keyDragged = (append = adds): Dragged | undefined =>
    byKeys && { goal: { x: byKeys.x, y: byKeys.y, theta: byKeys.theta ?? undefined }, append };
  const keyForGoal = (goal: KeyGoal, key: string, fine: boolean) => {
    doubt();
    if (!byKeys) return true;
    const next = keyed(goal, key, KEY_STEP / view.scale, fine);
    if (next === undefined) return false;
    if (next === "leave") giveUp("Esc");
    else if (next === "send") {
      const given = keyDragged(adds || fine);
      byKeys = undefined;
      if (given) void order(given);
    } else {
      byKeys = next;
      hint(keyWords(next));
      const [px, py] = toScreen(view, next.x, next.y);
      if (px < 30 || py < 30 || px > view.width - 30 || py > view.height - 30) view = follow(view, next.x, next.y, FOLLOWED);
      invalidate();
    }
    return true;
  };
  const keyForView = (key: string) => {
    const arrow = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key] as [number, number] | undefined;
    if (arrow) panBy(arrow[0] * KEY_PAN, arrow[1] * KEY_PAN);
    else if (key === "+" || key === "=") zoom(view.width / 2, view.height / 2, 1.25);
    else if (key === "-" || key === "−") zoom(view.width / 2, view.height / 2, 0.8);
    else if (key === "f" || key === "F") setFollowing(!following);
    else if (key === "0") fitAll();
    else if (key === "g" || key === "G") beginByKeys();
    else return false;
    return true;
  };

  const unbind = bind(canvas, {
    press: (pointer, px, py, append) => {
      if (whyNoGoal(model) !== undefined) return false;
      byKeys = undefined;
      begun();
      invalidate();
      return drag.press(pointer, px, py, toWorld(view, px, py), adds || append);
    },
    move: (pointer, px, py, append) => {
      drag.move(pointer, px, py, adds || append);
      invalidate();
    },
    release: (pointer) => {
      // What was heard since the last frame counts, too.
      doubt();
      const given = drag.release(pointer);
      if (given) void order(given);
      invalidate();
    },
    click: () => hint(whyNoGoal(model) ?? ""),
    cancel: giveUp,
    get giving() {
      return drag.active || byKeys !== undefined;
    },
    pan: panBy,
    zoom,
    key: (key, fine) => (byKeys && keyForGoal(byKeys, key, fine)) || keyForView(key),
  });

  /** What was begun on one state of the base is not ordered in another. */
  const doubt = () => {
    if (!drag.active && !byKeys) return;
    const refused = whyNoGoal(model);
    if (refused !== undefined) giveUp("this page no longer drives");
    else if (model.alarm) giveUp("alarm");
    else if (model.status && (model.status.fault !== "none" || model.status.enabled === false))
      giveUp(model.status.enabled === false ? "motors disabled" : `fault ${model.status.fault}`);
    else if (interrupts(since(model.spoken, heardAtPress))) giveUp("Stop, or an event of the base");
  };
  const setModel = (next: Model) => {
    unsubscribe();
    giveUp("another base is shown");
    model = next;
    ordered = undefined;
    placed = false;
    scaled = false;
    unsubscribe = model.subscribe(TOPICS, () => {
      doubt();
      invalidate();
    });
    setFollowing(true);
  };
  const unwatch = watchPalette(() => {
    palette = readPalette(element);
    invalidate();
  });
  const sizes = new ResizeObserver(invalidate);
  sizes.observe(ui.frame);
  setModel(first);

  return {
    setModel,
    destroy: () => {
      unsubscribe();
      unbind();
      unwatch();
      sizes.disconnect();
      cancelAnimationFrame(frame);
      for (const timer of [ageing, telling, hinting]) clearTimeout(timer);
      ui.destroy();
    },
  };
}

function keyWords({ theta }: KeyGoal): string {
  return theta === undefined
    ? "arrows move, Enter fixes, Esc leaves"
    : "left and right turn, Enter sends, Shift + Enter adds to the path, Esc leaves";
}

/** What was said after an entry; all that is kept, if that was forgotten meanwhile. */
function since(spoken: readonly Spoken[], last: Spoken | undefined): readonly Spoken[] {
  return last ? spoken.slice(spoken.lastIndexOf(last) + 1) : spoken;
}
