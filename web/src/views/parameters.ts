/** The parameters as a table: what the base has, what it may have, and what somebody has changed. Nothing is sent but by Enter or a button. */
import type { Model, Parameter } from "../model/model.ts";
import { button, h, setAttribute, setText, show } from "./dom.ts";
import { driving, order, reason, refusal, type Say, type View, watch } from "./view.ts";

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

/** Why a value is not sent; undefined if it may be. The base has the last word: it knows of values that depend on each other. */
export function refusedValue(text: string, parameter: Pick<Parameter, "min" | "max" | "unit">): string | undefined {
  if (!NUMBER.test(text)) return "not a number";
  const value = Number(text);
  const { min, max } = parameter;
  return value < min || value > max ? `outside its range, ${rangeWords(parameter)}` : undefined;
}

export function rangeWords({ min, max }: Pick<Parameter, "min" | "max">): string {
  return `${min} to ${max}`;
}

/** One row: what is edited is kept apart from what the base has. */
interface Row {
  readonly root: HTMLTableRowElement;
  /** Shows what the base has. */
  update(parameter: Parameter, mayDrive: boolean): void;
}

export function mount(element: HTMLElement, first: Model, say: Say): View {
  let model = first;
  const rows = new Map<string, Row>();
  const filter = h("input", {
    type: "search",
    id: "parameter-filter",
    placeholder: "name or unit",
    autocomplete: "off",
    spellcheck: "false",
  });
  const count = h("span", { class: "count", role: "status" });
  const body = h("tbody");
  const empty = h("p", { class: "empty" }, "No parameters yet.");
  const table = h(
    "table",
    { class: "parameters", "data-testid": "params-table" },
    h("caption", { class: "unseen" }, "Parameters of the base"),
    h("thead", {}, h("tr", {}, ...["Name", "Value", "Unit", "Range", "State"].map((name) => h("th", { scope: "col" }, name)))),
    body,
  );

  const send = (what: string, line: string) => void order(what, driving(model)?.send(line), say);
  const save = button("Save", () => void order("Save parameters", driving(model)?.saveParameters(), say), {
    title: "SaveParams: keeps them over power-off; refused while the base moves",
    "data-testid": "save-params",
  });
  const load = button("Load", () => send("Load parameters", "LoadParams"), { title: "LoadParams: takes what was saved" });
  const sure = h("span", { class: "sure", role: "group", hidden: true }, "All to their defaults? ");
  const reset = button("Reset…", () => {
    show(sure, true);
    no.focus();
  });
  reset.title = "ResetParams: takes the defaults, after a question";
  const endReset = () => {
    show(sure, false);
    reset.focus();
  };
  const yes = button("Yes, reset", () => {
    endReset();
    send("Reset parameters", "ResetParams");
  });
  const no = button("No", endReset);
  sure.append(yes, no);
  sure.addEventListener("keydown", (event) => {
    if (event.key === "Escape") endReset();
  });
  const unsaved = h("span", { class: "unsaved", role: "status" });

  element.replaceChildren(
    h("div", { class: "tools" }, h("label", { for: "parameter-filter" }, "Filter"), filter, count, save, load, reset, sure, unsaved),
    h("div", { class: "scroll" }, table, empty),
  );

  const sift = () => {
    const wanted = filter.value.trim().toLowerCase();
    let shown = 0;
    for (const [name, row] of rows) {
      const fits = name.includes(wanted) || (model.parameters.get(name)?.unit.toLowerCase().includes(wanted) ?? false);
      show(row.root, fits);
      if (fits) shown += 1;
    }
    setText(count, wanted === "" ? `${rows.size}` : `${shown} of ${rows.size}`);
  };
  filter.addEventListener("input", sift);
  filter.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    filter.value = "";
    sift();
  });

  const set = async (name: string, value: string) => {
    const commands = driving(model);
    if (!commands) throw new Error("this page does not drive the base");
    const why = refusal(await commands.setParameter(name, value));
    if (why !== undefined) throw new Error(why);
  };
  const draw = (anew: boolean) => {
    const { parameters, mayDrive } = model;
    if (anew || rows.size !== parameters.size || [...parameters.keys()].some((name) => !rows.has(name))) {
      rows.clear();
      for (const parameter of parameters.values()) rows.set(parameter.name, rowOf(parameter, set));
      body.replaceChildren(...[...rows.values()].map((row) => row.root));
      sift();
    }
    for (const [name, parameter] of parameters) rows.get(name)?.update(parameter, mayDrive);
    for (const each of [save, load, reset, yes]) each.disabled = !mayDrive;
    show(empty, parameters.size === 0);
    show(table, parameters.size > 0);
    setText(unsaved, model.unsaved ? "● changed since the last save" : "");
  };
  return watch(model, ["parameters", "connection"], (next, anew) => {
    model = next;
    draw(anew);
  });
}

function rowOf(parameter: Parameter, set: (name: string, value: string) => Promise<void>): Row {
  const { name } = parameter;
  let now = parameter;
  /** What the base had when the edit began; undefined while nothing is edited. */
  let edited: number | undefined;
  let waiting = false;

  const field = h("input", { inputmode: "decimal", autocomplete: "off", "aria-label": name, value: String(parameter.value), size: 10 });
  const note = h("span", { class: "note", role: "status" });
  const mark = h("span", { class: "changed" });
  const range = h("td", { class: "range" });
  const unit = h("td", { class: "unit" });
  const root = h(
    "tr",
    { "data-parameter": name },
    h("th", { scope: "row" }, name),
    h("td", {}, field),
    unit,
    range,
    h("td", {}, mark, note),
  );

  const tell = (text: string, refused = false) => {
    setText(note, text);
    note.classList.toggle("refused", refused);
  };
  const restore = () => {
    edited = undefined;
    field.value = String(now.value);
    tell("");
  };
  const send = async () => {
    const text = field.value.trim();
    if (waiting || edited === undefined) return;
    const problem = refusedValue(text, now);
    setAttribute(field, "aria-invalid", problem ? "true" : undefined);
    if (problem) {
      tell(`Not sent: ${problem}`, true);
      return;
    }
    waiting = true;
    tell("…");
    try {
      await set(name, text);
      // What was typed meanwhile is an edit of its own.
      if (field.value.trim() === text) {
        edited = undefined;
        tell("");
      }
    } catch (error) {
      tell(`Refused: ${reason(error)}`, true);
    } finally {
      waiting = false;
      update(now, !field.readOnly);
    }
  };
  field.addEventListener("input", () => {
    edited ??= now.value;
    setAttribute(field, "aria-invalid", undefined);
    tell("Enter sends, Esc restores");
    setAttribute(root, "data-edited", "true");
  });
  field.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && !event.repeat) void send();
    if (event.key === "Escape") {
      restore();
      update(now, !field.readOnly);
    }
  });

  const update = (next: Parameter, mayDrive: boolean) => {
    now = next;
    field.readOnly = !mayDrive;
    setText(unit, next.unit === "-" ? "" : next.unit);
    setText(range, rangeWords(next));
    const changed = next.value !== next.before;
    setText(mark, changed ? `● was ${next.before}` : "");
    setAttribute(root, "data-changed", changed ? "true" : undefined);
    setAttribute(root, "data-edited", edited === undefined ? undefined : "true");
    if (edited === undefined) {
      if (field.value !== String(next.value)) field.value = String(next.value);
    } else if (next.value !== edited && !waiting) tell(`Meanwhile the base has ${next.value}: Enter overwrites it, Esc takes it`, true);
  };
  return { root, update };
}
