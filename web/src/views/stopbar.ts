/**
 * The bar with the Stop button: always there, below everything and above every dialog (which is why no dialog of this page is modal: a modal one makes
 * the rest of the page inert). It belongs to the live base, whatever the rest of the page shows.
 */
import type { Model } from "../model/model.ts";
import { button, h, setAttribute, setText, show } from "./dom.ts";
import { secondsSince } from "./freshness.ts";
import { driving, order, type Say, type View, watch } from "./view.ts";

export interface StopBar extends View {
  stop(): void;
  estop(): void;
  say: Say;
  /** The space bar types a blank now. */
  blanks(typed: boolean): void;
  /** The rest of the page shows a log. */
  showsLog(shown: boolean): void;
}

const SAID_FOR_MS = 8000;
const LONGEST_TOUCH_MS = 3000;
/** The status is asked for each quarter of a second: what is older was not answered several times, s. */
const OLD_S = 1;

export function mount(element: HTMLElement, first: Model): StopBar {
  let model = first;
  let hush: ReturnType<typeof setTimeout> | undefined;

  const said = h("output", { class: "said", "aria-live": "polite", "data-testid": "said" });
  const say: Say = (text, kind = "done") => {
    clearTimeout(hush);
    // A text that is said again is read again.
    said.textContent = "";
    said.textContent = text;
    said.className = `said ${kind}`;
    hush = setTimeout(() => {
      said.textContent = "";
    }, SAID_FOR_MS);
  };

  const give = (what: "Stop" | "EStop", send: (() => void) | undefined) => {
    // Sent wherever there is a way to send it; what is said beside it only tells how far that goes.
    send?.();
    const problem = unreachable(model);
    if (problem) say(`${what}: ${problem}`, "refused");
    else say(`${what} sent to ${describe(model)}`);
  };
  const stop = () => give("Stop", model.commands && (() => model.commands?.stop()));
  const estop = () => give("EStop", model.commands && (() => model.commands?.estop()));

  const stopButton = urgent("stop", stop, h("strong", {}, "STOP"), h("small", {}, "Space"));
  const estopButton = urgent("estop", estop, h("strong", {}, "EStop"), h("small", {}, "Ctrl + ."));
  const enable = button("Enable", () => void order("Enable", driving(model)?.enable(), say), { "data-testid": "enable" });
  const disable = button("Disable", () => void order("Disable", driving(model)?.disable(), say), { "data-testid": "disable" });
  const clear = button("Clear fault", () => void order("Clear fault", driving(model)?.clearFault(), say), {
    "data-testid": "clear-fault-bar",
  });
  const states = h("span");
  const motors = h("span");
  const motion = h("span", { class: "motion", "data-testid": "motion" }, states, motors);
  const hint = h("span", { class: "hint", role: "status", hidden: true }, "Space types a blank here. To stop: Esc, then Space");
  const whose = h("span", { class: "whose" });
  element.replaceChildren(
    stopButton,
    estopButton,
    h("div", { class: "motors", role: "group", "aria-label": "Motors" }, enable, disable, clear),
    h("div", { class: "told" }, whose, motion, hint, said),
  );

  let log = false;
  const draw = () => {
    const { status, connection } = model;
    const open = connection.state === "open";
    const tell = (element: HTMLElement, words: string, at: number | undefined) => {
      const { text, old } = aged(words, open, secondsSince(at));
      setText(element, status ? text : "");
      element.classList.toggle("old", old);
    };
    tell(states, `move ${status?.moveState ?? "–"} · turn ${status?.turnState ?? "–"}`, model.heardAt.states);
    tell(motors, ` · motors ${status?.enabled === undefined ? "–" : status.enabled ? "enabled" : "disabled"}`, model.heardAt.motors);
    show(whose, log && connection.state !== "none");
    setText(whose, log && connection.state !== "none" ? `These act on the live base (${describe(model)}), not on the log.` : "");
    const problem = unreachable(model);
    stopButton.title = problem ?? `Both axes decelerate and hold (space bar). To ${describe(model)}`;
    estopButton.title = problem ?? "Motors off at once (Ctrl + . or Pause)";
    setAttribute(stopButton, "data-reaches", String(!problem));
    setAttribute(estopButton, "data-reaches", String(!problem));
    for (const each of [enable, disable, clear]) each.disabled = !model.mayDrive;
    show(clear, status !== undefined && status.fault !== "none");
  };
  const base = watch(model, ["connection", "status", "world", "alarm"], (next) => {
    model = next;
    // What was said of a Stop before it turned out that nobody answers.
    if (next.alarm && said.classList.contains("done")) said.textContent = "";
    draw();
  });

  // What is heard no more grows old by itself.
  const ageing = setInterval(draw, 500);

  return {
    setModel: base.setModel,
    destroy: () => {
      clearTimeout(hush);
      clearInterval(ageing);
      base.destroy();
    },
    stop,
    estop,
    say,
    blanks: (typed) => show(hint, typed),
    showsLog: (shown) => {
      log = shown;
      draw();
    },
  };
}

/** What was told, as it is now: with its age, if that is not just now. */
export function aged(words: string, open: boolean, age: number | undefined): { text: string; old: boolean } {
  if (open && (age === undefined || age <= OLD_S)) return { text: words, old: false };
  return { text: `${words} (${age === undefined ? "last heard" : `${age.toFixed(0)} s old`})`, old: true };
}

/** A button that acts when it is touched, not when it is let go: half a second is 15 cm of a base at 0.3 m/s. */
function urgent(name: string, act: () => void, ...label: Node[]): HTMLButtonElement {
  const element = h("button", { type: "button", class: name, "data-testid": name }, ...label);
  let touchedAt = Number.NEGATIVE_INFINITY;
  element.addEventListener("pointerdown", (event) => {
    touchedAt = event.timeStamp;
    act();
  });
  // The click that ends a touch is not a second order; one of Enter or of a screen reader (without a count) is an order of its own.
  element.addEventListener("click", (event) => {
    if (event.detail === 0 || event.timeStamp - touchedAt > LONGEST_TOUCH_MS) act();
  });
  return element;
}

function describe(model: Model): string {
  const { connection, world } = model;
  if (world) return `the simulated base "${world.robot}"`;
  return "to" in connection ? connection.to : "the base";
}

/** Why an order would not reach the base; undefined if it would. */
export function unreachable({ connection, unresponsive }: Pick<Model, "connection" | "unresponsive">): string | undefined {
  switch (connection.state) {
    case "none":
    case "log":
      return "no base is connected";
    case "connecting":
      return "the connection is being made: it may not reach the base";
    case "lost":
      return "the connection is lost: it may not reach the base. Use the base's own emergency stop";
    case "open":
      if (connection.role === "watch")
        return "this page only watches: it reaches nobody. Take the seat, or use the base's own emergency stop";
      return unresponsive ? "the base does not answer: it may not hear it. Use the base's own emergency stop" : undefined;
  }
}
