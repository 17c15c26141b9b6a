/**
 * The page put together: which view stands where, and which model each of them shows. The Stop bar, the header's base and the banners belong to the live base
 * at all times; the rest shows a log while one is loaded.
 */
import type { Model } from "./model/model.ts";
import * as banner from "./views/banner.ts";
import { beeper } from "./views/beep.ts";
import * as calibration from "./views/calibration.ts";
import * as connection from "./views/connection.ts";
import * as talk from "./views/console/console.ts";
import { h, toggle } from "./views/dom.ts";
import * as header from "./views/header.ts";
import * as help from "./views/help.ts";
import { bind } from "./views/keyboard.ts";
import * as parameters from "./views/parameters.ts";
import { scheme } from "./views/scheme.ts";
import * as stopbar from "./views/stopbar.ts";
import * as strips from "./views/strips/strips.ts";
import * as tabs from "./views/tabs.ts";
import * as timeline from "./views/timeline.ts";
import * as topview from "./views/topview/topview.ts";
import { type View, watch } from "./views/view.ts";
import * as world from "./views/world.ts";

/** Where models come from. */
export interface Sources {
  /** The page belongs to the simulator that it comes from. */
  readonly served: boolean;
  /** The browser has Web Serial. */
  readonly serial: boolean;
  /** The live base, or none yet. */
  readonly live: Model;
  /** Asks for a port, and resolves with the base there. */
  connect(): Promise<Model>;
  /** Leaves the base; resolves with none. */
  disconnect(): Promise<Model>;
  readLog(file: File, live: Model): Promise<Model>;
  /** The rows of a stretch of time as a table, and how many they are. */
  csv(model: Model, from: number, to: number): { readonly blob: Blob; readonly rows: number };
}

export interface App {
  /** What is shown: the live base, or a log. */
  readonly model: Model;
  readonly live: Model;
}

export function app(page: Window, sources: Sources): App {
  const { document } = page;
  const place = (id: string) => document.getElementById(id) as HTMLElement;
  let live = sources.live;
  let log: Model | undefined;
  const shown = () => log ?? live;

  const bar = stopbar.mount(place("stopbar"), live);
  const { say } = bar;
  const sound = beeper(page);
  const helping = help.mount(document.body);
  const banners = place("banners");
  const top = header.mount(place("header"), live, { help: helping.open, scheme: scheme(page) });
  const closeLog = () => showLog(undefined);
  const disconnect = async () => showLive(await sources.disconnect());
  const alerts = banner.mount(banners, live, { say, alarm: sound.sound, closeLog, disconnect: () => void disconnect() });
  let logAlerts: View | undefined;

  const desk = {
    console: h("div"),
    parameters: h("div"),
    calibration: h("div"),
    world: h("div"),
    connection: h("div"),
  };
  const conversation = talk.mount(desk.console, live);
  const gains = calibration.mount(desk.calibration, live, say);
  const worlds = world.mount(desk.world, live, say);
  const showLog = (next: Model | undefined) => {
    log = next;
    const model = shown();
    for (const view of views) view.setModel(model);
    bar.showsLog(next !== undefined);
    line.showsLog(next?.connection.state === "log" ? next.connection.name : undefined);
    logAlerts?.destroy();
    logAlerts = next && banner.mount(banners, next, { say, alarm: () => {}, closeLog, disconnect: () => {} });
    offerWorld();
  };
  const showLive = (next: Model) => {
    live = next;
    for (const view of [bar, top, alerts, line, worlds, offering]) view.setModel(next);
    showLog(undefined);
  };
  const line = connection.mount(desk.connection, live, {
    served: sources.served,
    serial: sources.serial,
    connect: async () => {
      showLive(await sources.connect());
      panels.select("Console");
    },
    disconnect,
    loadLog: async (file) => showLog(await sources.readLog(file, live)),
    closeLog,
    say,
  });
  const views: readonly View[] = [
    topview.mount(place("topview"), live),
    strips.mount(place("strips"), live),
    timeline.mount(place("timeline"), live, {
      say,
      onSaveCsv: ({ from, to }) => {
        const { blob, rows } = sources.csv(shown(), from, to);
        save(page, blob, fileName(shown(), "csv"));
        say(`Save CSV: ${rows} rows`);
      },
    }),
    conversation,
    parameters.mount(desk.parameters, live, say),
    gains,
  ];

  const tabList = [
    { name: "Console", panel: desk.console },
    { name: "Parameters", panel: desk.parameters },
    { name: "Calibration", panel: desk.calibration, shown: gains.shown },
    { name: "World", panel: desk.world },
    { name: "Connection", panel: desk.connection },
  ];
  const taller = toggle("Taller", false, (on) => place("main").classList.toggle("tall-desk", on), {
    title: "More room for the desk, less for the top view",
  });
  const panels = tabs.mount(place("desk"), "Desk", tabList, taller);
  const offerWorld = () => panels.offer("World", shown() === live && live.world !== undefined);
  const offering = watch(live, ["world"], offerWorld);
  if (!sources.served) panels.select("Connection");

  bind(page, {
    stop: bar.stop,
    estop: bar.estop,
    help: helping.open,
    command: () => {
      panels.select("Console");
      conversation.focus();
    },
    escape: helping.close,
    blanks: bar.blanks,
  });
  takeDrops(document, (file) => {
    panels.select("Connection");
    void line.load(file);
  });

  return {
    get model() {
      return shown();
    },
    get live() {
      return live;
    },
  };
}

/** A file that is dropped anywhere on the page is a log; the browser would leave the page for it. */
function takeDrops(document: Document, take: (file: File) => void): void {
  const root = document.documentElement;
  const files = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
  document.addEventListener("dragover", (event) => {
    if (!files(event)) return;
    event.preventDefault();
    root.classList.add("dropping");
  });
  document.addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) root.classList.remove("dropping");
  });
  document.addEventListener("drop", (event) => {
    root.classList.remove("dropping");
    if (!files(event)) return;
    event.preventDefault();
    const file = event.dataTransfer?.files[0];
    if (file) take(file);
  });
}

function save(page: Window, blob: Blob, name: string): void {
  const url = URL.createObjectURL(blob);
  h("a", { href: url, download: name }).click();
  page.setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

function fileName(model: Model, extension: string): string {
  const stem = model.connection.state === "log" ? model.connection.name.replace(/\.\w+$/, "") : "drive";
  return `${stem}-${new Date().toISOString().slice(0, 19).replaceAll(":", "")}.${extension}`;
}
