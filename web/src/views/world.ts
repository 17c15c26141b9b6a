/** The simulated world: what can be pushed, broken and mended there. A real base has no such panel. */
import type { Model, WorldRequest } from "../model/model.ts";
import { button, h, numberField, setAttribute, setText } from "./dom.ts";
import { driving, reason, type Say, type View, watch } from "./view.ts";

const PUSHES: readonly (readonly [label: string, along: number, about: number, seconds: number])[] = [
  ["↑ ahead", 10, 0, 0.3],
  ["↓ back", -10, 0, 0.3],
  ["↺ left", 0, 1, 0.3],
  ["↻ right", 0, -1, 0.3],
  ["Shove", 25, 0.5, 0.5],
];
/** A fault whose factor has a slider. */
const WEAK = /^(left|right) motor weak\b/;

export function mount(element: HTMLElement, first: Model, say: Say): View {
  let model = first;
  const request = async (what: string, wish: WorldRequest) => {
    const commands = driving(model);
    if (!commands) {
      say(`${what}: this page does not drive`, "refused");
      return;
    }
    try {
      await commands.world(wish);
      say(`${what}: done`);
    } catch (error) {
      say(`${what}: ${reason(error)}`, "refused");
    }
  };

  const broken = h("p", { class: "broken", role: "status", "data-testid": "broken" });
  const [force, torque, time] = [numberField("Force", "10", "N"), numberField("Torque", "0", "N·m"), numberField("for", "0.3", "s")];
  const push = button("Push", () => {
    const [along, about, seconds] = [force, torque, time].map((field) => Number(field.input.value.trim() || Number.NaN));
    if (along === undefined || about === undefined || seconds === undefined) return;
    if (![along, about, seconds].every(Number.isFinite) || seconds <= 0) say("Push: three numbers, and more than 0 s", "refused");
    else void request("Push", { push: [along, about, seconds] });
  });
  const quick = PUSHES.map(([label, along, about, seconds]) =>
    button(label, () => void request(`Push ${label}`, { push: [along, about, seconds] }), {
      title: `${along} N along, ${about} N·m about, ${seconds} s`,
    }),
  );

  const faults = h("div", { class: "faults" });
  const weak = h("div", { class: "weak" });
  const clear = button("Mend all", () => void request("Mend all", { clear: true }), { "data-testid": "mend" });
  const circuit = button("Open the emergency-stop circuit", () => {
    const open = !(model.world?.estop ?? false);
    void request(open ? "Open the circuit" : "Close the circuit", { estop: open });
  });
  const power = button("Power off and on", () => void request("Power off and on", { power: "cycle" }));
  power.title = "What is not saved is gone: parameters, the map, the pose";

  element.dataset.testid = "world-panel";
  element.replaceChildren(
    h(
      "div",
      { class: "scroll" },
      broken,
      h("fieldset", {}, h("legend", {}, "Push"), ...quick, force.root, torque.root, time.root, push),
      h("fieldset", {}, h("legend", {}, "Weaker motor"), weak),
      h("fieldset", {}, h("legend", {}, "Break"), faults),
      h("fieldset", {}, h("legend", {}, "Circuit and power"), clear, circuit, power),
    ),
  );

  let offered = "";
  const sliders = new Map<string, { follow(broken: readonly string[]): void; input: HTMLInputElement }>();
  const offer = (all: readonly string[]) => {
    if (offered === all.join("\n")) return;
    offered = all.join("\n");
    sliders.clear();
    for (const fault of all) {
      const side = WEAK.exec(fault)?.[1];
      if (side && !sliders.has(side))
        sliders.set(
          side,
          slider(side, (factor) => request(`${side} motor`, weaker(side, factor))),
        );
    }
    weak.replaceChildren(...[...sliders.values()].map(({ input }) => input.parentElement ?? input));
    faults.replaceChildren(...all.filter((fault) => !WEAK.test(fault)).map((fault) => button(fault, () => void request(fault, { fault }))));
  };

  const draw = () => {
    const { world, mayDrive } = model;
    offer(world?.faults ?? []);
    const list = world?.broken ?? [];
    const words = [...list, ...(world?.estop ? ["emergency-stop circuit open"] : []), ...(world?.pushed ? ["being pushed"] : [])];
    setText(broken, words.length > 0 ? `⚠ ${words.join(", ")}` : "Nothing is broken.");
    broken.classList.toggle("some", words.length > 0);
    setText(circuit, world?.estop ? "Close the emergency-stop circuit" : "Open the emergency-stop circuit");
    setAttribute(circuit, "aria-pressed", String(world?.estop ?? false));
    for (const each of element.querySelectorAll("button")) each.disabled = !mayDrive;
    for (const { follow, input } of sliders.values()) {
      input.disabled = !mayDrive;
      follow(list);
    }
  };
  return watch(model, ["world", "connection"], (next) => {
    model = next;
    draw();
  });
}

/** A motor that gets all of its voltage is one that nothing is wrong with. */
export function weaker(side: string, factor: number): WorldRequest {
  return { fault: `${side} motor weak ${factor}` };
}

/** The factor of a side's motor among what is broken; 1 if it is not there. */
export function factorOf(side: string, broken: readonly string[]): number {
  for (const each of broken) {
    const words = each.split(" ");
    if (words[1] === "motor" && words[2] === "weak" && (words[0] === side || words[0] === "both")) return Number(words[3]);
  }
  return 1;
}

function slider(side: string, changed: (factor: number) => Promise<void>) {
  const shown = h("output");
  const input = h("input", { type: "range", min: 0, max: 100, step: 5, value: 100 });
  h("label", { class: "field" }, `${side} `, input, shown);
  // While it is dragged, what the world says is of before.
  let held = false;
  const word = () => setText(shown, `${input.value} % of its voltage`);
  input.addEventListener("input", () => {
    held = true;
    word();
  });
  input.addEventListener("change", () => {
    void changed(Number(input.value) / 100).finally(() => {
      held = false;
    });
  });
  word();
  return {
    input,
    follow: (broken: readonly string[]) => {
      if (held) return;
      input.value = String(Math.round(100 * factorOf(side, broken)));
      word();
    },
  };
}
