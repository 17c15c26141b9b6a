/** What the user must see at once: an unanswered Stop, a lost connection, a fault with its cause and what clears it. */
import type { Connection, Model, Status } from "../model/model.ts";
import { button, h, setText, show } from "./dom.ts";
import { FAULTS, faultTitle, REACTIONS } from "./faults.ts";
import { driving, order, type Say, type View, watch } from "./view.ts";

export type Lost = Extract<Connection, { state: "lost" }>;

export interface BannerOptions {
  readonly say: Say;
  /** The alarm begins or ends. */
  readonly alarm: (on: boolean) => void;
  /** Gives up the connection to the live base. */
  readonly disconnect: () => void;
  /** Leaves the log, for the live base. */
  readonly closeLog: () => void;
}

export function mount(element: HTMLElement, first: Model, options: BannerOptions): View {
  let model = first;
  const ofLog = first.kind === "log";
  const testid = (name: string) => ({ "data-testid": ofLog ? `log-${name}` : name });
  const alarm = h("div", { class: "banner alarm", role: "alert", ...testid("alarm"), hidden: true });
  const lostText = h("span", { role: "alert" });
  // Beside the alert, not in it: a screen reader would read every second.
  const again = h("span", { class: "again", "aria-hidden": "true" });
  const lost = h("div", { class: "banner lost", ...testid("connection-lost"), hidden: true }, lostText, again);
  const silent = h("div", { class: "banner lost", role: "alert", ...testid("no-answer"), hidden: true });
  const another = h(
    "div",
    { class: "banner lost", role: "alert", ...testid("another-base"), hidden: true },
    h(
      "span",
      {},
      "⚠ What came back may be another base than before. It is asked what it is, and Stop reaches it; it is driven when you say so.",
    ),
    button("Drive it", () => model.commands?.confirmBase(), testid("drive-it")),
    button("Disconnect", options.disconnect, testid("disconnect-it")),
  );
  const name = h("strong", testid("fault-name"));
  const cause = h("span", { class: "cause" });
  const clearing = h("span", { class: "clearing" });
  const refused = h("span", { class: "refused", role: "status" });
  const say: Say = (text, kind) => {
    setText(refused, kind === "refused" ? text : "");
    options.say(text, kind);
  };
  const clear = button("Clear fault", () => void order("Clear fault", driving(model)?.clearFault(), say), testid("clear-fault"));
  const fault = h(
    "div",
    { class: "banner fault", role: "alert", ...testid("banner"), hidden: true },
    h("span", { class: "sign", "aria-hidden": "true" }, "⚠"),
    h("div", { class: "words" }, h("span", {}, "Fault ", name), cause, clearing, refused),
    clear,
  );
  const logName = h("span");
  const log = h(
    "div",
    { class: "banner log-shown", role: "status", "data-testid": "log-shown", hidden: true },
    logName,
    button("Close the log", options.closeLog),
  );
  const root = h("div", { class: "banner-group" }, ofLog && log, alarm, lost, another, silent, fault);
  element.append(root);

  let latest: Lost | undefined;
  const draw = () => {
    setText(alarm, model.alarm ? `⚠ ${model.alarm.text}` : "");
    show(alarm, model.alarm !== undefined);
    options.alarm(model.alarm !== undefined);

    const { state } = model.connection;
    // It stays while the next attempt is made: what comes and goes is not read.
    if (model.connection.state === "lost") latest = model.connection;
    else if (state !== "connecting") latest = undefined;
    const words = latest && lostWords(latest, model.parameters.get("deadman")?.value, state === "connecting" ? undefined : Date.now());
    setText(lostText, words?.text ?? "");
    setText(again, words?.again ?? "");
    show(lost, words !== undefined);

    const { status, connection } = model;
    show(another, connection.state === "open" && connection.another);
    setText(
      silent,
      model.unresponsive ? "⚠ The base does not answer: a Stop may not reach it, whatever telemetry says. Use its own emergency stop." : "",
    );
    show(silent, model.unresponsive);
    show(log, connection.state === "log");
    if (connection.state === "log") setText(logName, `▤ What is shown is the log ${connection.name}, not a live base.`);
    fault.classList.toggle("of-log", model.kind === "log");
    const latched = status !== undefined && status.fault !== "none";
    show(fault, latched);
    if (!latched) {
      setText(refused, "");
      return;
    }
    const told = faultWords(status);
    setText(name, `${model.kind === "log" ? "in the log: " : ""}${told.title}`);
    setText(cause, told.cause);
    setText(clearing, told.clearing);
    show(clear, model.kind === "live");
    clear.disabled = !model.mayDrive;
  };
  const base = watch(model, ["alarm", "connection", "status"], (next) => {
    model = next;
    draw();
  });
  // The seconds until the next attempt run, and what is not answered makes no event.
  const timer = setInterval(draw, 500);

  return {
    setModel: base.setModel,
    destroy: () => {
      clearInterval(timer);
      base.destroy();
      options.alarm(false);
      root.remove();
    },
  };
}

export function faultWords(status: Pick<Status, "fault" | "place">): { title: string; cause: string; clearing: string } {
  const known = FAULTS.get(status.fault);
  const title = faultTitle(status.fault, status.place);
  if (!known) return { title, cause: "A fault that this page does not know.", clearing: "See the base's documentation." };
  return {
    title,
    cause: `Cause: ${known.cause}. ${REACTIONS[known.reaction]}`,
    clearing: `Clears: ${known.clearing}. Nothing moves at the clearing.`,
  };
}

/** What a lost connection means for the base, by its own dead-man's time (s; undefined: not known), and when the next attempt is (`now` undefined: it is under way). */
export function lostWords(lost: Lost, deadman: number | undefined, now: number | undefined): { text: string; again: string } {
  const why = lost.why.replace(/\.$/, "");
  const text = `⚠ The base does not hear this page: ${why}. ${deadmanWords(deadman)}`;
  if (now === undefined) return { text, again: "Trying again now." };
  if (lost.retryAt === undefined) return { text, again: "" };
  const seconds = Math.max(0, Math.ceil((lost.retryAt - now) / 1000));
  return { text, again: seconds === 0 ? "Trying again now." : `Trying again in ${seconds} s.` };
}

function deadmanWords(seconds: number | undefined): string {
  if (seconds === 0)
    return "Its deadman is off: a motion without an end goes on until something else stops it; others go on to their target.";
  const after = seconds === undefined ? ", unless it is off" : ` ${seconds} s after the last line`;
  return `Its deadman stops motions without an end${after}; others go on to their target.`;
}
