/** Elements without a framework. Text goes in as text, never as markup: what a base or a file says is shown, not run. */

type Child = Node | string | undefined | false;
type Attributes = Record<string, string | number | boolean | undefined>;

/** An element with attributes (true: without a value; false, undefined: left out) and children. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== undefined && value !== false) element.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) if (child) element.append(child);
  return element;
}

/** A button that does something. Enter presses it, the space bar does not: that is Stop everywhere on this page. */
export function button(label: string, pressed: () => void, attributes: Attributes = {}): HTMLButtonElement {
  const element = h("button", { type: "button", ...attributes }, label);
  element.addEventListener("click", pressed);
  return element;
}

/** A button that is on or off. The page has no check boxes: nothing but the space bar would tick them. */
export function toggle(label: string, on: boolean, changed: (on: boolean) => void, attributes: Attributes = {}): HTMLButtonElement {
  const element = button(
    label,
    () => {
      const next = element.getAttribute("aria-pressed") !== "true";
      element.setAttribute("aria-pressed", String(next));
      changed(next);
    },
    { "aria-pressed": String(on), class: "toggle", ...attributes },
  );
  return element;
}

let ids = 0;

/** A field for a number, with its label and unit. A blank has no meaning in it, so the space bar is Stop there at any time. */
export function numberField(label: string, value: string, unit: string): { root: HTMLElement; input: HTMLInputElement } {
  ids += 1;
  const id = `number-${ids}`;
  const input = h("input", { id, inputmode: "decimal", autocomplete: "off", value, size: 6 });
  return { root: h("span", { class: "field" }, h("label", { for: id }, label), input, h("span", { class: "unit" }, unit)), input };
}

/** Sets what changed only: a text that is written anew each frame would lose the selection, and be read out again. */
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function setAttribute(element: Element, name: string, value: string | undefined): void {
  if (value === undefined) {
    if (element.hasAttribute(name)) element.removeAttribute(name);
  } else if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

export function show(element: HTMLElement, shown: boolean): void {
  if (element.hidden === shown) element.hidden = !shown;
}
