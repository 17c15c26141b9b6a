/** The strips: what the base does over time, in a column of charts with one time axis. */
import { type Channel, type Model, STATES, type Topic } from "../../model/model.ts";
import { button, h, setText, show } from "../dom.ts";
import { STALE, secondsSince } from "../freshness.ts";
import { readPalette, watchPalette } from "../theme.ts";
import { driving, reason, refusal, type View } from "../view.ts";
import { Runs } from "./bands.ts";
import { type Chart, type Frame, LEFT, makeChart, RIGHT } from "./chart.ts";
import { STATES_AFTER, STRIPS, type StripWish } from "./panels.ts";
import { bindPointer } from "./pointer.ts";
import { Pyramid } from "./pyramid.ts";
import { timeStep, timeTicks } from "./scales.ts";
import { neighbour, type Stretch, span, stretch } from "./span.ts";
import { makeStates, STATES_HEIGHT } from "./states.ts";
import { AXIS_HEIGHT, makeTimeAxis } from "./timeaxis.ts";

const TOPICS: readonly Topic[] = ["history", "cursor", "connection", "status"];
/** At most 25 times a second, and not more often than something moves by half a pixel. */
const LEAST_INTERVAL_MS = 40;
/** Drawn in one frame; a software renderer takes 1 to 2 ms for each. */
const STRIPS_A_FRAME = 3;
const HEAD = 24;
const [LEAST_HEIGHT, MOST_HEIGHT, FREE_HEIGHT] = [44, 130, 76];
/** Below this width the page scrolls, and the column is as high as it likes. */
const NARROW = "(max-width: 899px)";

interface Strip {
  readonly root: HTMLElement;
  readonly body: HTMLElement;
  readonly fold: HTMLButtonElement;
  seen: boolean;
  open: boolean;
}
interface LineStrip extends Strip {
  readonly wish: StripWish;
  readonly chart: Chart;
  readonly values: readonly HTMLElement[];
  readonly absent: HTMLElement;
}

export function mount(element: HTMLElement, first: Model): View {
  let model = first;
  let unsubscribe = () => {};
  let palette = readPalette(element);
  let shown: Stretch | undefined;
  let hoverPx: number | undefined;
  let width = 0;
  const pyramid = new Pyramid(STRIPS.flatMap(({ lines }) => lines.map(({ channel }) => channel)));
  const runs = { move: new Runs("move_state"), turn: new Runs("turn_state") };

  const staleness = h("p", { class: "strips-note stale-note", hidden: true });
  const other = h("span", {});
  const own = button("Own telemetry", () => void askOwn());
  const notice = h("p", { class: "strips-note", role: "status", hidden: true }, other, " ", own);
  const column = h("div", { class: "strips-column" });
  const root = h("div", { class: "strips" }, notice, staleness, column);
  element.append(root);

  const seeing = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const strip = all.find((each) => each.body === target);
      if (strip) strip.seen = isIntersecting;
    }
    soon();
  });
  const makeStrip = (id: string, title: string, unit: string, heads: readonly HTMLElement[]) => {
    const body = h("div", { class: "strip-body", id: `strip-${id}-body` });
    const fold = button("", () => setOpen(strip, !strip.open), { class: "strip-fold", "aria-expanded": "true", "aria-controls": body.id });
    fold.append(h("span", { class: "strip-title" }, title), unit ? h("span", { class: "unit" }, ` ${unit}`) : "");
    const place = h(
      "section",
      { class: "strip", "data-testid": `strip-${id}`, "aria-label": title },
      h("div", { class: "strip-head" }, fold, ...heads),
      body,
    );
    column.append(place);
    const strip: Strip = { root: place, body, fold, seen: true, open: true };
    return strip;
  };
  const setOpen = (strip: Strip, open: boolean) => {
    strip.open = open;
    strip.fold.setAttribute("aria-expanded", String(open));
    show(strip.body, open);
    layout();
  };

  const lineStrips: LineStrip[] = [];
  const stateValues = h("span", { class: "strip-value" });
  const stateCanvas = h("canvas", { role: "img", "aria-label": "States of both axes over time" });
  let stateStrip: Strip | undefined;
  for (const wish of STRIPS) {
    const values = wish.lines.map(() => h("span", { class: "strip-number" }));
    const chips = wish.lines.map(({ name, colour, dashed }, index) => {
      const swatch = h("span", { class: `strip-swatch ${dashed ? "dashed" : ""} ink-${colour}`, "aria-hidden": "true" });
      return h("span", { class: "strip-value" }, swatch, `${name} `, values[index]);
    });
    const strip = makeStrip(wish.id, wish.title, wish.unit, chips);
    const absent = h("p", { class: "strip-absent", hidden: true }, wish.absent);
    strip.body.append(absent);
    lineStrips.push(Object.assign(strip, { wish, values, absent, chart: makeChart(strip.body, wish, () => palette) }));
    if (wish.id === STATES_AFTER) {
      stateStrip = makeStrip("states", "States", "", [stateValues]);
      stateStrip.body.append(stateCanvas);
    }
  }
  if (!stateStrip) throw new Error("the states have no place");
  const statesStrip = stateStrip;
  const states = makeStates(stateCanvas, () => palette);
  const axisCanvas = h("canvas", { class: "strips-axis", "aria-hidden": "true" });
  column.append(axisCanvas);
  const axis = makeTimeAxis(axisCanvas, () => palette);
  const all: readonly Strip[] = [...lineStrips, statesStrip];
  for (const { body } of all) seeing.observe(body);

  const narrow = matchMedia(NARROW);
  const layout = () => {
    width = column.clientWidth;
    if (width < LEFT + RIGHT + 40) return;
    const open = lineStrips.filter((strip) => strip.open).length;
    const taken = all.length * HEAD + AXIS_HEIGHT + (statesStrip.open ? STATES_HEIGHT : 0) + 4;
    const room = element.clientHeight - notice.offsetHeight - staleness.offsetHeight - taken;
    const height = narrow.matches ? FREE_HEIGHT : Math.floor(Math.min(MOST_HEIGHT, Math.max(LEAST_HEIGHT, room / Math.max(1, open))));
    for (const { chart, open: isOpen } of lineStrips) if (isOpen) chart.resize(width, height);
    states.resize(width);
    axis.resize(width);
    soon();
  };

  // One frame is asked for when something is new and the last one is long enough ago.
  let drawnAt = 0;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let frame = 0;
  const plotWidth = () => width - LEFT - RIGHT;
  let again = false;
  const soon = () => {
    if (timer !== undefined) return;
    const perPixel = shown ? ((shown.to - shown.from) * 1000) / Math.max(1, plotWidth()) : 0;
    const interval = Math.min(1000, Math.max(LEAST_INTERVAL_MS, perPixel / 2));
    timer = setTimeout(
      () => {
        timer = undefined;
        now();
      },
      Math.max(0, drawnAt + interval - performance.now()),
    );
  };
  /** For what the user does: he waits for it. If strips are being drawn, they are drawn once more. */
  const now = () => {
    clearTimeout(timer);
    timer = undefined;
    again = frame !== 0;
    if (frame === 0) frame = requestAnimationFrame(draw);
  };
  const draw = () => {
    drawnAt = performance.now();
    frame = 0;
    if (plotWidth() < 40) return;
    const { history, cursor } = model;
    const [oldest, newest] = [history.at("t", 0), history.at("t", history.length - 1)];
    shown = stretch(span.seconds, oldest, newest, cursor.t, shown);
    span.shown = shown;
    pyramid.update(history);
    for (const each of [runs.move, runs.turn]) each.update(history);
    const step = timeStep(shown.to - shown.from, plotWidth(), 70);
    const next: Frame = { stretch: shown, cursor: cursor.t, ticks: timeTicks(shown.from, shown.to, step) };
    axis.draw(next, step);
    drawValues(next);
    tellAge();
    drawSome(
      all.filter((strip) => strip.open && strip.seen),
      next,
    );
  };
  /** A few strips now, the others in the frames that follow: none of them takes long. */
  const drawSome = (strips: readonly Strip[], next: Frame) => {
    for (const strip of strips.slice(0, STRIPS_A_FRAME)) {
      const lines = lineStrips.find((each) => each === strip);
      if (lines) drawLines(lines, next);
      else drawStates(next);
    }
    const rest = strips.slice(STRIPS_A_FRAME);
    frame = rest.length > 0 ? requestAnimationFrame(() => drawSome(rest, next)) : 0;
    if (frame === 0 && again) now();
  };
  const drawStates = (next: Frame) => {
    const bands = (each: Runs) => each.bands(next.stretch.from, next.stretch.to, plotWidth());
    states.draw(
      [
        { name: "move", bands: bands(runs.move) },
        { name: "turn", bands: bands(runs.turn) },
      ],
      next,
    );
  };
  const drawLines = ({ wish, chart, absent }: LineStrip, frame: Frame) => {
    const columns = pyramid.columns(
      wish.lines.map(({ channel }) => channel),
      frame.stretch.from,
      frame.stretch.to,
      plotWidth(),
    );
    chart.draw(columns, frame);
    if (hoverPx !== undefined) chart.hover(hoverPx);
    show(absent, columns.t.length > 0 && columns.values.every((values) => values.every((value) => value === null)));
  };
  /** The values where the pointer is, or at the cursor, or now. */
  const drawValues = ({ stretch: { from, to }, cursor }: Frame) => {
    const { history } = model;
    const hovered = hoverPx === undefined ? undefined : from + (hoverPx / plotWidth()) * (to - from);
    const t = hovered ?? cursor;
    const index = t === undefined ? history.length - 1 : history.indexAt(t);
    const known = t === undefined || Math.abs(history.at("t", index) - t) < STALE;
    const value = (channel: Channel) => (known ? history.at(channel, index) : Number.NaN);
    for (const { wish, values } of lineStrips) {
      wish.lines.forEach(({ channel }, each) => {
        const number = value(channel) * wish.factor;
        setText(values[each] as HTMLElement, Number.isNaN(number) ? "–" : number.toFixed(wish.digits).replace("-", "−"));
      });
    }
    const [move, turn] = [STATES[value("move_state")] ?? "–", STATES[value("turn_state")] ?? "–"];
    setText(stateValues, `move ${move} · turn ${turn}`);
    statesStrip.root.dataset.move = move;
    statesStrip.root.dataset.turn = turn;
  };

  const tellAge = () => {
    const age = secondsSince(model.heardAt.telemetry) ?? 0;
    const stale = age > STALE;
    root.classList.toggle("stale", stale && model.cursor.t === undefined);
    show(staleness, stale);
    if (stale) setText(staleness, `STALE: telemetry is ${age < 100 ? `${age.toFixed(0)} s` : "long"} old`);
    const foreign = model.kind === "live" && !model.streaming && model.connection.state === "open";
    show(notice, foreign);
    show(own, driving(model) !== undefined);
    if (foreign && other.textContent === "") setText(other, FOREIGN);
    if (!foreign) setText(other, "");
  };
  const ageing = setInterval(() => {
    if (!document.hidden) tellAge();
  }, 500);
  const askOwn = async () => {
    try {
      const refused = refusal((await driving(model)?.ownStream()) ?? "ERR this page does not drive");
      if (refused !== undefined) setText(other, `Refused: ${refused}.`);
    } catch (error) {
      setText(other, `${reason(error)}.`);
    }
  };

  const unbind = bindPointer(column, {
    plot: () => ({ left: LEFT, width: plotWidth() }),
    paused: () => model.kind === "log" || model.cursor.t !== undefined,
    hover: (px) => {
      hoverPx = px;
      for (const { chart, open, seen } of lineStrips) if (open && seen) chart.hover(px);
      if (shown) drawValues({ stretch: shown, cursor: model.cursor.t, ticks: [] });
    },
    scrub: (px) => {
      const { history } = model;
      if (!shown || history.length === 0) return;
      const t = shown.from + (px / plotWidth()) * (shown.to - shown.from);
      model.setCursor(Math.min(history.at("t", history.length - 1), Math.max(history.at("t", 0), t)));
    },
    zoom: (longer) => span.set(neighbour(span.seconds, longer)),
  });
  const unspan = span.watch(now);
  const unwatch = watchPalette(() => {
    palette = readPalette(element);
    states.recolour();
    now();
  });
  const sizes = new ResizeObserver(layout);
  sizes.observe(element);
  for (const each of [column, notice, staleness]) sizes.observe(each);
  narrow.addEventListener("change", layout);

  const setModel = (next: Model) => {
    unsubscribe();
    model = next;
    shown = undefined;
    hoverPx = undefined;
    unsubscribe = model.subscribe(TOPICS, soon);
    now();
  };
  setModel(first);
  layout();

  return {
    setModel,
    destroy: () => {
      unsubscribe();
      unbind();
      unspan();
      unwatch();
      sizes.disconnect();
      seeing.disconnect();
      narrow.removeEventListener("change", layout);
      clearTimeout(timer);
      clearInterval(ageing);
      cancelAnimationFrame(frame);
      for (const { chart } of lineStrips) chart.destroy();
      root.remove();
    },
  };
}

const FOREIGN = "Another Stream is on: these strips show what it tells.";
