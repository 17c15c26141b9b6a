/**
 * The time bar: now or the past, and how much of it. Pausing stops what is shown, never the base; so it says so as long as it lasts.
 */
import type { Model, Topic } from "../model/model.ts";
import { button, h, setAttribute, setText, show } from "./dom.ts";
import { picture } from "./strips/picture.ts";
import { SPANS, type Stretch, span } from "./strips/span.ts";
import { advance, clockWords, spanWords } from "./strips/timewords.ts";
import { reason, type Say, type View } from "./view.ts";

export interface TimelineOptions {
  /** Saves the rows of a stretch of time. */
  readonly onSaveCsv: (stretch: Stretch) => void;
  readonly say: Say;
}

const TOPICS: readonly Topic[] = ["history", "cursor", "connection"];
const SPEEDS: readonly number[] = [0.5, 1, 2, 5, 10];
const ALL: Stretch = { from: Number.NEGATIVE_INFINITY, to: Number.POSITIVE_INFINITY };
/** How often the bar follows what is new: it is no instrument. */
const UPDATE_MS = 200;
/** Steps of the slider, s: an arrow goes by one, a page by a tenth of all. */
const STEP = 0.02;

export function mount(element: HTMLElement, first: Model, options: TimelineOptions): View {
  let model = first;
  let unsubscribe = () => {};
  let playing = false;
  let speed = 1;

  const play = button("", () => (showsNow() || playing ? pause() : start()), { "data-testid": "play-button" });
  const live = button("Live", () => goLive(), { "data-testid": "live-button", class: "live-button" });
  const slider = h("input", {
    type: "range",
    class: "scrubber",
    min: "0",
    max: "1",
    step: String(STEP),
    value: "1",
    "aria-label": "Time",
    "data-testid": "scrubber",
  });
  const clock = h("output", { class: "timeline-clock", "data-testid": "shown-time" });
  const promise = h("p", { class: "timeline-promise" }, "Pausing stops what is shown, never the base.");
  const paused = h("p", { class: "timeline-paused", role: "status", "data-testid": "paused", hidden: true });
  const select = (
    label: string,
    choices: readonly (readonly [value: number, words: string])[],
    value: number,
    chosen: (value: number) => void,
  ) => {
    const list = h(
      "select",
      { "aria-label": label },
      ...choices.map(([each, words]) => h("option", { value: String(each), selected: each === value }, words)),
    );
    list.addEventListener("change", () => chosen(Number(list.value)));
    return list;
  };
  const length = select(
    "Length of time that the strips show",
    SPANS.map((each) => [each, spanWords(each)]),
    span.seconds,
    span.set,
  );
  const pace = select(
    "Speed of the playback",
    SPEEDS.map((each) => [each, `${each}×`]),
    speed,
    (value) => {
      speed = value;
    },
  );
  const root = h(
    "div",
    { class: "timeline", role: "group", "aria-label": "Time" },
    h("div", { class: "timeline-row" }, play, live, slider, clock),
    h(
      "div",
      { class: "timeline-row" },
      h("label", { class: "field" }, "Shows", length),
      h("label", { class: "field" }, "Plays at", pace),
      h("span", { class: "timeline-space" }),
      button("Save CSV", () => options.onSaveCsv(span.shown ?? ALL), {
        "data-testid": "save-csv",
        title: "What the strips show, as a table",
      }),
      button("Save all", () => options.onSaveCsv(ALL), { "data-testid": "save-all", title: "All that this page has, as a table" }),
      button("Save PNG", () => void savePicture().catch(onPictureFailed), { "data-testid": "save-png" }),
    ),
    h("div", { class: "timeline-note" }, promise, paused),
  );
  element.append(root);

  const bounds = () => {
    const { history } = model;
    return { oldest: history.at("t", 0), newest: history.at("t", history.length - 1) };
  };
  const showsNow = () => model.kind === "live" && model.cursor.t === undefined;

  let timer: ReturnType<typeof setTimeout> | undefined;
  let updatedAt = 0;
  const soon = () => {
    timer ??= setTimeout(update, Math.max(0, updatedAt + UPDATE_MS - performance.now()));
  };
  const update = () => {
    clearTimeout(timer);
    timer = undefined;
    updatedAt = performance.now();
    const { oldest, newest } = bounds();
    const known = newest >= oldest;
    const t = model.cursor.t ?? newest;
    slider.disabled = !known;
    if (known) {
      setAttribute(slider, "min", String(oldest));
      // A slider takes steps from its least value only: the newest instant must be one of them.
      setAttribute(slider, "max", String(oldest + Math.ceil((newest - oldest) / STEP) * STEP));
      if (Math.abs(Number(slider.value) - t) > STEP / 2) slider.value = String(t);
      setAttribute(slider, "aria-valuetext", `${t.toFixed(2)} s${showsNow() ? ", now" : ""}`);
    }
    setText(clock, known ? clockWords(t, model.cursor.t === undefined ? undefined : newest) : "no time yet");
    const now = showsNow();
    setText(play, now ? "❚❚ Pause" : playing ? "❚❚ Pause" : "▶ Play");
    setText(live, model.kind === "log" ? "End" : "Live");
    setAttribute(live, "aria-pressed", String(model.cursor.t === undefined));
    const past = model.kind === "live" && model.cursor.t !== undefined;
    show(paused, past);
    show(promise, !past && model.kind === "live");
    setText(paused, past ? `${playing ? "PLAYING THE PAST" : "PAUSED"}: the base goes on, unseen here.` : "");
  };

  const goTo = (t: number) => {
    const { oldest, newest } = bounds();
    if (newest >= oldest) model.setCursor(Math.min(newest, Math.max(oldest, t)));
    update();
  };
  const goLive = () => {
    playing = false;
    model.setCursor(undefined);
    update();
  };
  const pause = () => {
    playing = false;
    if (model.cursor.t === undefined) goTo(bounds().newest);
    update();
  };
  const start = () => {
    const { oldest, newest } = bounds();
    if (!(newest >= oldest)) return;
    // From its end, a log begins again.
    if (model.cursor.t === undefined || model.cursor.t >= newest - STEP) goTo(model.kind === "log" ? oldest : newest);
    playing = true;
    let last = performance.now();
    const step = (at: number) => {
      if (!playing || model.cursor.t === undefined) {
        playing = false;
        update();
        return;
      }
      const { t, ended } = advance(model.cursor.t, ((at - last) / 1000) * speed, bounds().newest);
      last = at;
      if (ended) {
        playing = false;
        // Live, the past has caught up with the present.
        model.setCursor(model.kind === "live" ? undefined : t);
        update();
        return;
      }
      model.setCursor(t);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
    update();
  };
  slider.addEventListener("input", () => {
    playing = false;
    goTo(Number(slider.value));
  });

  const savePicture = async () => {
    const t = model.cursor.t ?? bounds().newest;
    const { connection } = model;
    const name = connection.state === "log" ? connection.name : (model.world?.robot ?? "vehicle-controller");
    const blob = await picture(element.ownerDocument, `${name} · ${Number.isNaN(t) ? "" : `t = ${t.toFixed(2)} s`}`);
    const url = URL.createObjectURL(blob);
    h("a", { href: url, download: `${name.replace(/\.\w+$/, "")}-${Number.isNaN(t) ? "empty" : t.toFixed(0)}s.png` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  };

  const onPictureFailed = (error: unknown) => options.say(`Save PNG: ${reason(error)}`, "refused");

  const unspan = span.watch(() => {
    length.value = String(span.seconds);
  });
  const setModel = (next: Model) => {
    unsubscribe();
    playing = false;
    model = next;
    unsubscribe = model.subscribe(TOPICS, soon);
    update();
  };
  setModel(first);

  return {
    setModel,
    destroy: () => {
      unsubscribe();
      unspan();
      playing = false;
      clearTimeout(timer);
      root.remove();
    },
  };
}
