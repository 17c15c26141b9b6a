/** The console: the same lines that a terminal would show, and a field to type more of them. */
import type { Model, Spoken } from "../../model/model.ts";
import { button, h, setText, show, toggle } from "../dom.ts";
import { keep, recall } from "../storage.ts";
import { driving, reason, refusal, type View, watch } from "../view.ts";
import { complete } from "./completion.ts";
import { HelpBook } from "./helpbook.ts";
import { isNoise, KEPT, type Line, Lines } from "./lines.ts";
import { Past } from "./past.ts";
import { plain, refused } from "./typed.ts";

export interface Console extends View {
  focus(): void;
}

/** Marks that a screen reader and a colour-blind user tell apart as well. */
const MARKS: Readonly<Record<Spoken["direction"], readonly [mark: string, spoken: string]>> = {
  sent: ["›", "sent"],
  heard: ["‹", "heard"],
  note: ["·", "note"],
};
const LISTED = 24;

export function mount(element: HTMLElement, first: Model): Console {
  let model = first;
  let lines = new Lines();
  let last: Spoken | undefined;
  let noise = false;
  let tags = false;
  const past = new Past(recall("sessionStorage", "lines"));

  const log = h("div", { class: "log", role: "log", "aria-label": "Conversation", tabindex: 0, "data-testid": "console-log" });
  const field = h("input", {
    type: "text",
    id: "command",
    "data-testid": "command-input",
    autocomplete: "off",
    autocapitalize: "off",
    spellcheck: "false",
    enterkeyhint: "send",
    placeholder: "m 1 0.3",
    "aria-describedby": "command-hint",
  });
  const hint = h("div", { class: "command-hint", id: "command-hint", role: "status" });
  const tail = button("↓ newest", () => follow(), { class: "tail", hidden: true });
  const send = h("button", { type: "submit" }, "Send");
  const form = h("form", { class: "command-form" }, h("label", { for: "command" }, "Command"), field, send);
  element.replaceChildren(
    h(
      "div",
      { class: "tools" },
      toggle("Questions and telemetry", noise, (on) => {
        noise = on;
        log.setAttribute("aria-live", on ? "off" : "polite");
        redraw();
      }),
      toggle("Tags and checks", tags, (on) => {
        tags = on;
        redraw();
      }),
      tail,
    ),
    log,
    form,
    hint,
  );

  const book = new HelpBook(() => hintFor(field.value));
  /** What the base has known so far: another base, another version or a connection made anew makes a new book. */
  let bookOf = "";

  // The newest line stays in view until the user scrolls away from it, also when the log gets shorter since a banner has come.
  let sticks = true;
  const atEnd = () => log.scrollHeight - log.scrollTop - log.clientHeight < 30;
  const follow = () => {
    log.scrollTop = log.scrollHeight;
    show(tail, false);
  };
  log.addEventListener("scroll", () => {
    sticks = atEnd();
    show(tail, !sticks);
  });
  const sizes = new ResizeObserver(() => {
    if (sticks) follow();
  });
  sizes.observe(log);

  const rowOf = (line: Line) => {
    const [mark, spoken] = MARKS[line.direction];
    const text = tags ? line.text : plain(line.text);
    const error = text.startsWith("ERR") ? " error" : "";
    return h(
      "div",
      { class: `line ${line.direction} ${line.kind}${error}`, "data-direction": line.direction },
      h("span", { class: "mark", role: "img", "aria-label": spoken }, mark),
      text,
    );
  };
  const redraw = () => {
    log.replaceChildren(...lines.shown(noise).map(rowOf));
    follow();
  };
  const append = () => {
    const { spoken } = model;
    let at = last ? spoken.lastIndexOf(last) + 1 : 0;
    if (at >= spoken.length) return;
    const rows: Node[] = [];
    for (; at < spoken.length; at += 1) {
      const next = spoken[at];
      if (!next) continue;
      last = next;
      const line = lines.add(next);
      if (noise || !isNoise(line)) rows.push(rowOf(line));
    }
    if (rows.length === 0) return;
    log.append(...rows.slice(-KEPT));
    while (log.childElementCount > KEPT) log.firstElementChild?.remove();
    if (sticks) follow();
  };

  const known = () => ({
    topics: book.topics,
    commands: book.commands,
    parameters: [...model.parameters.keys()],
    places: model.map?.places.map((place) => place.name) ?? [],
    landmarks: model.map?.places.flatMap((place) => place.landmarks.map((landmark) => landmark.name)) ?? [],
  });
  const warn = (text: string) => {
    hint.className = "command-hint refused";
    setText(hint, text);
  };
  const hintFor = (text: string) => {
    const problem = refused(text);
    if (problem) {
      warn(`Not sent: ${problem}`);
      return;
    }
    hint.className = "command-hint";
    const { candidates } = complete(text, known());
    const keyword = text.trim().split(/[\s,]/, 1)[0] ?? "";
    const says = keyword === "" ? undefined : book.of(keyword);
    const more = candidates.length > LISTED ? ` … ${candidates.length - LISTED} more` : "";
    const list = candidates.length > 1 ? candidates.slice(0, LISTED).join("  ") + more : "";
    setText(hint, says && list ? `${says} | ${list}` : (says ?? list));
  };

  const submit = async () => {
    const line = field.value.trim();
    if (line === "") return;
    const problem = refused(field.value);
    const commands = driving(model);
    past.add(line);
    keep("sessionStorage", "lines", past.toString());
    // Emptied whatever becomes of the line (the arrow brings it back): the space bar is Stop from here on.
    field.value = "";
    hintFor("");
    if (problem || !commands) {
      warn(`Not sent: ${problem ?? (model.kind === "log" ? "this is a log" : "this page does not drive the base")}`);
      return;
    }
    lines.expect(line);
    const asked = model;
    try {
      const why = refusal(await commands.send(line));
      if (why !== undefined && asked === model && field.value === "") warn(`${line}: refused, ${why}`);
    } catch (error) {
      if (asked === model) warn(`${line}: ${reason(error)}`);
    }
  };

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    void submit();
  });
  field.addEventListener("focus", () => void book.open());
  field.addEventListener("input", () => {
    void book.open();
    hintFor(field.value);
  });
  field.addEventListener("paste", (event) => {
    const text = event.clipboardData?.getData("text") ?? "";
    if (!/[\r\n]/.test(text.trim())) return;
    // The browser would glue the lines together: `m 1` and `5 0.3` are `m 15 0.3`.
    event.preventDefault();
    warn("Not pasted: it has several lines, and one is sent at a time");
  });
  field.addEventListener("keydown", (event) => {
    const put = (text: string | undefined) => {
      if (text === undefined) return;
      event.preventDefault();
      field.value = text;
      field.setSelectionRange(text.length, text.length);
      hintFor(text);
    };
    const { key, shiftKey, ctrlKey, altKey, metaKey } = event;
    if (event.isComposing || ctrlKey || altKey || metaKey) return;
    if (key === "Tab" && !shiftKey) {
      if (field.selectionStart === field.value.length) put(complete(field.value, known()).completed);
    } else if (key === "ArrowUp" || key === "ArrowDown") {
      event.preventDefault();
      put(past.step(key === "ArrowUp" ? -1 : 1, field.value));
    } else if (key === "Escape") {
      if (field.value === "") field.blur();
      put("");
    } else if (key === "Enter" && event.repeat) event.preventDefault();
  });

  const base = watch(model, ["spoken", "connection", "parameters", "map"], (next, anew) => {
    model = next;
    const { connection } = model;
    const of = `${connection.state} ${"to" in connection ? connection.to : ""} ${model.mayDrive} ${model.version ?? ""}`;
    if (anew || of !== bookOf) {
      bookOf = of;
      book.reset(driving(model) && ((line) => model.commands?.send(line) ?? Promise.reject(new Error("no base to ask"))));
      if (document.activeElement === field) void book.open();
    }
    if (anew) {
      lines = new Lines();
      last = undefined;
      redraw();
    }
    field.disabled = model.kind === "log";
    // Not while another page drives: Enter would do nothing then, and leave the text, in which the space bar types blanks.
    send.disabled = model.kind === "log";
    append();
  });

  return {
    setModel: base.setModel,
    destroy: () => {
      sizes.disconnect();
      base.destroy();
    },
    focus: () => field.focus(),
  };
}
