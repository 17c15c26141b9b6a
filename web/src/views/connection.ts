/** The connection: to a simulator (by itself), to a board over USB, or to a log; and how the line is doing. */
import type { Model } from "../model/model.ts";
import { button, h, setText, show } from "./dom.ts";
import { reason, type Say, type View, watch } from "./view.ts";
import { connectionWords, LINE_BYTES_PER_SECOND } from "./words.ts";

export interface ConnectionOptions {
  /** This page comes from a simulator, which it belongs to: no other base may be mixed in. */
  readonly served: boolean;
  /** The browser has Web Serial. */
  readonly serial: boolean;
  /** Asks the user for a port, and connects. */
  readonly connect: () => Promise<void>;
  readonly disconnect: () => Promise<void>;
  readonly loadLog: (file: File) => Promise<void>;
  readonly closeLog: () => void;
  readonly say: Say;
}

const FACTS = ["heard", "sent", "damaged lines", "unanswered", "base"] as const;

export interface ConnectionView extends View {
  /** The log that is shown, if one is. */
  showsLog(name: string | undefined): void;
  load(file: File): Promise<void>;
}

export function mount(element: HTMLElement, first: Model, options: ConnectionOptions): ConnectionView {
  let model = first;
  const { say } = options;
  const state = h("p", { role: "status" });
  const cells = FACTS.map(() => h("dd"));
  const facts = h(
    "dl",
    { class: "facts", title: "Shares are of a serial line at 115 200 baud" },
    ...FACTS.map((name, at) => h("div", {}, h("dt", {}, name), " ", cells[at])),
  );
  const act = (what: string, done: () => Promise<void>) => async () => {
    try {
      await done();
    } catch (error) {
      say(`${what}: ${reason(error)}`, "refused");
    }
  };
  const connect = button("Connect over USB (Web Serial)…", () => void act("Connect", options.connect)(), {
    "data-testid": "connect-serial",
  });
  const disconnect = button("Disconnect", () => void act("Disconnect", options.disconnect)(), { "data-testid": "disconnect" });
  const without = h(
    "p",
    {},
    "This browser has no Web Serial, so this page cannot reach a board over USB. Chromium, Chrome, Edge and Opera on a computer have it. Logs can be looked at in any browser.",
  );

  const file = h("input", { type: "file", id: "log-file", accept: ".csv,.log,.txt,text/*", "data-testid": "load-log" });
  const back = button("Close the log: back to the live base", options.closeLog, { "data-testid": "close-log" });
  const shown = h("p", { role: "alert", "data-testid": "log-state" });
  const load = async (chosen: File) => {
    setText(shown, `Reading ${chosen.name} …`);
    try {
      await options.loadLog(chosen);
    } catch (error) {
      setText(shown, `${chosen.name}: ${reason(error)}`);
    }
  };
  file.addEventListener("change", () => {
    const chosen = file.files?.[0];
    // The same file may have grown, and is chosen again.
    if (chosen) void load(chosen).finally(() => (file.value = ""));
  });

  element.replaceChildren(
    h(
      "div",
      { class: "scroll" },
      h("fieldset", {}, h("legend", {}, "Base"), state, connect, disconnect, without, facts),
      h(
        "fieldset",
        {},
        h("legend", {}, "Log"),
        h("label", { for: "log-file" }, "Load a trace or a recorded log (CSV or a transcript; or drop it on the page)"),
        file,
        back,
        shown,
      ),
    ),
  );

  const draw = () => {
    const { connection, statistics } = model;
    const open = connection.state === "open";
    setText(state, connectionWords(connection).detail);
    const idle = connection.state === "none" || connection.state === "log";
    show(connect, !options.served && options.serial);
    setText(connect, idle ? "Connect over USB (Web Serial)…" : "Connect to another board…");
    show(disconnect, !options.served && !idle);
    show(without, !options.served && !options.serial);
    const values = [
      rate(statistics.heardBytesPerSecond),
      rate(statistics.sentBytesPerSecond),
      String(statistics.damagedLines),
      String(statistics.unanswered),
      model.version ?? "not told yet",
    ];
    show(facts, !idle);
    const old = open ? "" : " (before the connection was lost)";
    cells.forEach((cell, at) => void setText(cell, `${values[at]}${old}`));
  };
  const base = watch(model, ["connection", "status"], (next) => {
    model = next;
    draw();
  });
  const timer = setInterval(draw, 500);
  show(back, false);

  return {
    setModel: base.setModel,
    destroy: () => {
      clearInterval(timer);
      base.destroy();
    },
    load,
    showsLog: (name) => {
      show(back, name !== undefined);
      setText(shown, name === undefined ? "" : `Shown: ${name}`);
    },
  };
}

/** Bytes a second, and what share that is of what a serial line at 115 200 baud carries. */
export function rate(bytes: number): string {
  return `${Math.round(bytes)} B/s, ${((100 * bytes) / LINE_BYTES_PER_SECOND).toFixed(1)} % of the line`;
}
