/** Calibration: what the base has learned of its wheels, how well, and the ways to teach it. */
import type { Model } from "../model/model.ts";
import * as convergence from "./convergence.ts";
import { button, h, numberField, setText, show } from "./dom.ts";
import { Fixes, type Tally } from "./fixes.ts";
import { GAIN_NAMES, trueGains } from "./gains.ts";
import { driving, order, type Say, type View, watch } from "./view.ts";

export interface Calibration extends View {
  /** The panel is seen: the gains are asked for. */
  shown(shown: boolean): void;
}

export function mount(element: HTMLElement, first: Model, say: Say): Calibration {
  let model = first;
  let seen = false;

  const send = (line: string) => void order(line, driving(model)?.send(line), say);
  const length = numberField("Measured", "1", "m");
  const straight = button("Calibrate straight", () => {
    const metres = Number(length.input.value.trim() || Number.NaN);
    if (!(metres > 0)) say("Calibrate straight: the measured length is a number of metres above 0", "refused");
    else send(`Calibrate straight ${Number(metres.toFixed(6))}`);
  });
  straight.title = "The last move was a straight line of this length, measured from outside";
  const orders = [
    button("On", () => send("Calibrate on"), { title: "From here on observations correct the gains, too" }),
    button("Off", () => send("Calibrate off"), { title: "Observations only consider the gains" }),
    button("Reset", () => send("Calibrate reset"), { title: "The gains are 1 again; refused while moving" }),
  ];

  const told = h("span", { class: "tally", role: "status" });
  const fixes = new Fixes((tally) => {
    setText(told, tallyWords(tally));
    setText(feed, tally.running ? "Stop the fixes" : "Start the fixes");
    feed.setAttribute("aria-pressed", String(tally.running));
  });
  const period = numberField("every", "2", "s");
  const sigma = numberField("σ", "1", "cm");
  const angle = numberField("σ", "0.5", "°");
  const seed = numberField("seed", "1", "");
  const feed = button("Start the fixes", () => {
    if (fixes.running) fixes.stop("");
    else startFixes();
  });
  feed.setAttribute("aria-pressed", "false");
  const startFixes = () => {
    const [every, cm, degrees, first] = [period, sigma, angle, seed].map((field) => Number(field.input.value.trim() || Number.NaN));
    if (every === undefined || cm === undefined || degrees === undefined || first === undefined) return;
    if (!(every >= 0.05 && every <= 3600 && cm > 0 && cm <= 1000 && degrees > 0 && degrees <= 180 && Number.isInteger(first))) {
      say("Fixes: every 0.05 to 3600 s, σ above 0, at most 1000 cm and 180°, a whole number as the seed", "refused");
      return;
    }
    const commands = driving(model);
    if (!commands) {
      say("Fixes: this page does not drive the base", "refused");
      return;
    }
    fixes.start(
      every,
      (number) => commands.observeTruth(cm / 100, degrees, seedOf(first, number)),
      () => !document.hidden,
    );
  };
  const feeding = h(
    "fieldset",
    {},
    h("legend", {}, "Fixes from the true pose (simulator)"),
    period.root,
    sigma.root,
    angle.root,
    seed.root,
    feed,
    told,
  );

  const charts = h("div", { class: "charts" });
  const legend = h("p", { class: "legend" }, "— learned, band ± σ");
  let chart: convergence.Convergence | undefined;
  let vehicle: string | undefined;

  element.replaceChildren(
    h(
      "div",
      { class: "scroll" },
      h("fieldset", {}, h("legend", {}, "Calibrate"), ...orders, length.root, straight),
      feeding,
      legend,
      charts,
    ),
  );

  const draw = () => {
    const names = GAIN_NAMES[model.geometry.vehicle];
    const truth = trueGains(model);
    show(feeding, model.world !== undefined);
    for (const each of [...orders, straight]) each.disabled = !model.mayDrive;
    feed.disabled = !model.mayDrive && !fixes.running;
    setText(legend, truth ? "— learned, band ± σ   – – true" : "— learned, band ± σ");
    if (!seen) return;
    if (vehicle !== model.geometry.vehicle) {
      chart?.destroy();
      chart = convergence.mount(charts, names);
      vehicle = model.geometry.vehicle;
    }
    chart?.draw(model.gains, truth);
  };
  const look = (on: boolean) => model.commands?.watchGains(on);
  const base = watch(model, ["gains", "connection", "parameters"], (next, anew) => {
    if (anew && next !== model) {
      fixes.stop("another base is shown");
      if (seen) look(false);
    }
    model = next;
    if (!model.mayDrive) fixes.stop("this page does not drive the base any more");
    if (anew && seen) look(true);
    draw();
  });

  return {
    setModel: base.setModel,
    destroy: () => {
      fixes.stop("");
      if (seen) look(false);
      base.destroy();
      chart?.destroy();
    },
    shown: (shown) => {
      seen = shown;
      look(shown);
      draw();
    },
  };
}

/** Fixes of one run have noise of their own each, and two runs with neighbouring seeds have none in common for a million fixes. */
export function seedOf(first: number, number: number): number {
  return first * 1_000_000 + number;
}

function tallyWords({ running, taken, refused, last }: Tally): string {
  if (!running && taken + refused === 0) return last;
  return `${running ? "" : "ended: "}${taken} taken, ${refused} refused${last && `; ${last}`}`;
}
