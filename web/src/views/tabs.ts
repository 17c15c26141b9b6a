/** Tabs as the ARIA practices have them: one is in the order of the Tab key, arrows go to the others. */
import { h, setAttribute, show } from "./dom.ts";

export interface Tab {
  readonly name: string;
  readonly panel: HTMLElement;
  /** Shown or hidden now. */
  readonly shown?: (shown: boolean) => void;
}

export interface Tabs {
  select(name: string): void;
  /** Takes a tab away, or brings it back. */
  offer(name: string, offered: boolean): void;
}

/** `extra` stands behind the tabs, and is none of them. */
export function mount(element: HTMLElement, label: string, tabs: readonly Tab[], extra: HTMLElement): Tabs {
  const list = h("div", { class: "tabs", role: "tablist", "aria-label": label });
  const buttons = new Map<string, HTMLButtonElement>();
  let selected: string | undefined;

  const select = (name: string) => {
    if (selected === name) return;
    selected = name;
    for (const tab of tabs) {
      const on = tab.name === name;
      const each = buttons.get(tab.name);
      if (each) {
        setAttribute(each, "aria-selected", String(on));
        each.tabIndex = on ? 0 : -1;
      }
      const was = !tab.panel.hidden;
      show(tab.panel, on);
      if (was !== on) tab.shown?.(on);
    }
  };
  const offered = () => tabs.filter((tab) => !buttons.get(tab.name)?.hidden);
  for (const tab of tabs) {
    const id = `tab-${tab.name.toLowerCase()}`;
    const each = h("button", { type: "button", role: "tab", id, "aria-controls": `${id}-panel`, "data-testid": id }, tab.name);
    each.addEventListener("click", () => select(tab.name));
    each.addEventListener("keydown", (event) => {
      const there = offered();
      const at = there.indexOf(tab);
      const to = { ArrowRight: at + 1, ArrowLeft: at - 1 + there.length, Home: 0, End: there.length - 1 }[event.key];
      const next = to === undefined ? undefined : there[to % there.length];
      if (!next) return;
      event.preventDefault();
      select(next.name);
      buttons.get(next.name)?.focus();
    });
    buttons.set(tab.name, each);
    list.append(each);
    tab.panel.id = `${id}-panel`;
    tab.panel.classList.add("panel");
    setAttribute(tab.panel, "role", "tabpanel");
    setAttribute(tab.panel, "aria-labelledby", id);
    tab.panel.hidden = true;
  }
  element.replaceChildren(h("div", { class: "tab-row" }, list, extra), ...tabs.map((tab) => tab.panel));
  const first = tabs[0];
  if (first) select(first.name);

  return {
    select,
    offer: (name, on) => {
      const each = buttons.get(name);
      if (each) show(each, on);
      if (!on && selected === name && first) select(first.name);
    },
  };
}
