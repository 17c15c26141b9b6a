/** The top of the page: which base this is, how it is connected, who drives, and what everything else depends on: battery, line, pace. */
import type { Model } from "../model/model.ts";
import { button, h, setAttribute, setText, show } from "./dom.ts";
import { STALE, secondsSince } from "./freshness.ts";
import { type View, watch } from "./view.ts";
import { connectionWords, LINE_BYTES_PER_SECOND } from "./words.ts";

export interface HeaderOptions {
  readonly help: () => void;
  /** Shows and changes the colour scheme. */
  readonly scheme: { label(): string; next(): void };
}

export function mount(element: HTMLElement, first: Model, options: HeaderOptions): View {
  let model = first;
  const name = h("span", { class: "base-name" });
  const state = h("span", { class: "chip", "data-testid": "connection-state", role: "status" });
  const seat = button("Take the seat", () => model.commands?.takeSeat(), { "data-testid": "take-seat", hidden: true });
  const age = h("span", { class: "chip stale", hidden: true });
  const [battery, pace, load] = [chip("battery", "Battery"), chip("pace", "Pace"), chip("line-load", "Line")];
  const scheme = button(options.scheme.label(), () => {
    options.scheme.next();
    setText(scheme, options.scheme.label());
  });
  scheme.title = "Colours: as the system has them, light, dark";
  element.replaceChildren(
    h("h1", {}, "vehicle-controller"),
    name,
    state,
    seat,
    age,
    h("span", { class: "filler" }),
    battery.root,
    load.root,
    pace.root,
    scheme,
    button("Help ?", options.help, { "data-testid": "help" }),
  );

  const draw = () => {
    const { connection, world, history, statistics } = model;
    setText(name, baseName(model));
    const words = connectionWords(connection);
    setText(state, words.text);
    setAttribute(state, "title", words.detail);
    setAttribute(state, "data-state", connection.state);
    setAttribute(state, "data-role", connection.state === "open" ? connection.role : undefined);
    const watches = connection.state === "open" && connection.role === "watch";
    show(seat, watches);
    if (watches) {
      seat.disabled = !connection.seatFree;
      seat.title = connection.seatFree ? "Drive this base from here" : "Another page drives: it must leave first";
    }

    const silence = secondsSince(model.heardAt.telemetry) ?? 0;
    const stale = connection.state === "open" && silence > STALE;
    show(age, stale);
    if (stale) setText(age, `telemetry ${seconds(silence)} old`);

    const volts = history.length > 0 ? history.at("battery", history.length - 1) : Number.NaN;
    battery.set(Number.isNaN(volts) ? undefined : `${volts.toFixed(1)} V`, stale || connection.state === "lost");
    const bytes = statistics.heardBytesPerSecond / LINE_BYTES_PER_SECOND;
    const damaged = statistics.damagedLines > 0 ? `, ${statistics.damagedLines} damaged` : "";
    load.set(connection.state === "open" ? `${Math.round(100 * bytes)} %${damaged}` : undefined, false);
    load.root.title = "What the base sends, as a share of a serial line at 115 200 baud";
    const frozen = world !== undefined && (secondsSince(world.heardAt) ?? 0) > STALE;
    pace.set(world && paceWords(world.pace, world.speed), frozen);
  };
  const base = watch(model, ["connection", "world", "status"], (next) => {
    model = next;
    draw();
  });
  const timer = setInterval(draw, 250);
  return {
    setModel: base.setModel,
    destroy: () => {
      clearInterval(timer);
      base.destroy();
    },
  };
}

function chip(testid: string, label: string) {
  const value = h("b");
  const root = h("span", { class: "chip", "data-testid": testid, hidden: true }, `${label} `, value);
  return {
    root,
    set(text: string | undefined, stale: boolean) {
      show(root, text !== undefined);
      if (text !== undefined) setText(value, stale ? `${text} (old)` : text);
      root.classList.toggle("stale", stale);
    },
  };
}

const seconds = (age: number) => `${age.toFixed(age < 10 ? 1 : 0)} s`;

export function paceWords(pace: number, speed: number | undefined): string {
  const share = `${Math.round(100 * pace)} %`;
  if (speed === undefined) return "as fast as it goes";
  return speed === 1 ? share : `${share} of ${speed}×`;
}

/** `Version` answers name, version, target, protocol version. */
export function baseName(model: Pick<Model, "kind" | "connection" | "version" | "world">): string {
  if (model.connection.state === "log") return model.connection.name;
  const [, version, target] = (model.version ?? "").replace(/^Version /, "").split(" ");
  const what = model.world ? `simulated "${model.world.robot}"` : target;
  return [what, version].filter(Boolean).join(" ");
}
