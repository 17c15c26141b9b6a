/** The help: keys, and what one must know before driving. Not modal, so that the Stop button stays in reach; Esc closes it. */
import { button, h } from "./dom.ts";
import { KEYS } from "./keys.ts";

export interface Help {
  open(): void;
  close(): void;
}

const NOTES: readonly (readonly [title: string, ...paragraphs: string[]])[] = [
  [
    "Who drives",
    "One page drives a base; others watch, see everything and send nothing. A page that comes second watches, and can take the seat once it is free.",
  ],
  [
    "A lost page",
    "When the base hears nothing from this page for as long as its parameter deadman says (1 s unless changed), it stops motions without an end (m inf, t inf) and latches the fault link. Motions with a target go on to it, however long nobody speaks. With deadman 0 nothing of that is so: whatever moves goes on.",
    "A page in a hidden tab or a minimised window asks nothing: nobody looks, so it must not count as somebody who does. A motion without an end stops then, unless deadman is 0. When the page is seen again it asks anew; nothing moves by itself.",
    "After a lost connection nothing that was asked for before is sent, but for a Stop that was not answered.",
  ],
  [
    "Stop",
    "Stop and EStop go before everything that waits; what waits is dropped. A Stop without an answer is sent again twice a second, with a red banner and a sound, until the base answers, also when a lost connection is back. It is the only line that is.",
    "Stop needs this page, the line and the base's firmware. None of them is an emergency stop: a base that can hurt somebody needs one that cuts the motors' supply.",
    "While a log is shown, Stop, EStop and the motors' buttons still act on the live base, if one is connected.",
  ],
  [
    "Goals",
    "In the top view, press where the base shall go: release sends GoTo. Drag before releasing to set the heading. With Shift, or while Add is pressed, the posture is added to the path. Esc gives up.",
  ],
];

export function mount(element: HTMLElement): Help {
  let before: Element | null = null;
  const close = () => {
    if (root.hidden) return;
    root.hidden = true;
    if (before instanceof HTMLElement) before.focus();
  };
  const closing = button("Close (Esc)", close);
  const root = h(
    "div",
    { class: "dialog card", role: "dialog", "aria-label": "Help", hidden: true, "data-testid": "help-dialog" },
    h("div", { class: "dialog-head" }, h("h2", {}, "Help"), closing),
    ...KEYS.map(({ where, keys }) =>
      h(
        "table",
        { class: "keys" },
        h("caption", {}, where),
        h("tbody", {}, ...keys.map(([key, does]) => h("tr", {}, h("th", { scope: "row" }, h("kbd", {}, key)), h("td", {}, does)))),
      ),
    ),
    ...NOTES.flatMap(([title, ...paragraphs]) => [h("h3", {}, title), ...paragraphs.map((text) => h("p", {}, text))]),
  );
  element.append(root);
  return {
    open: () => {
      if (!root.hidden) {
        close();
        return;
      }
      before = document.activeElement;
      root.hidden = false;
      closing.focus();
    },
    close,
  };
}
