/**
 * The keys of the whole page, and what they mean where. Nothing here touches the page: what a key means must be testable for each place in which it
 * can be pressed, since one of them stops a robot.
 */

export interface Press {
  readonly key: string;
  readonly code: string;
  readonly ctrlKey: boolean;
  readonly altKey: boolean;
  readonly metaKey: boolean;
  /** An input method is at work: its keys are not the page's. */
  readonly isComposing: boolean;
}

/** Where a key goes: into a field for text, one for a number (in which a blank has no meaning), or anything else. */
export interface Place {
  readonly field: "text" | "number" | "none";
  readonly empty: boolean;
}

export type Meaning = "stop" | "estop" | "help" | "command" | "escape";

export function isSpace(press: Pick<Press, "key" | "code">): boolean {
  return press.key === " " || press.code === "Space";
}

/** True where the space bar types a blank instead of stopping. */
export function typesBlanks(place: Place): boolean {
  return place.field === "text" && !place.empty;
}

/**
 * What a key means. Shift does not matter: who hits the space bar in a hurry may hold it. Ctrl, Alt and Meta with the space bar belong to the
 * system (input methods, menus of windows).
 */
export function meaning(press: Press, place: Place): Meaning | undefined {
  const { key, ctrlKey, altKey, metaKey } = press;
  if (key === "Pause" || (key === "." && ctrlKey && !altKey && !metaKey)) return "estop";
  if (ctrlKey || altKey || metaKey) return undefined;
  if (isSpace(press)) return typesBlanks(place) || (press.isComposing && place.field === "text") ? undefined : "stop";
  if (press.isComposing) return undefined;
  if (key === "Escape") return "escape";
  if (place.field !== "none" && !(place.field === "text" && place.empty)) return undefined;
  if (key === "?") return "help";
  return key === "/" && place.field === "none" ? "command" : undefined;
}

const NUMBERS = new Set(["decimal", "numeric"]);
const TEXTS = new Set(["text", "search", "url", "email", "tel", "password"]);

/** What of an element matters to the keys. */
export function placeOf(target: EventTarget | null): Place {
  const element = target as Partial<HTMLInputElement> | null;
  const tag = element?.tagName?.toUpperCase();
  const empty = (element?.value ?? "") === "";
  if (tag === "TEXTAREA") return { field: "text", empty };
  if (tag !== "INPUT") return { field: "none", empty: true };
  if (element?.type === "number" || NUMBERS.has(element?.inputMode ?? "")) return { field: "number", empty };
  return TEXTS.has(element?.type ?? "text") ? { field: "text", empty } : { field: "none", empty: true };
}

/** For the help dialog. */
export const KEYS: readonly { readonly where: string; readonly keys: readonly (readonly [key: string, does: string])[] }[] = [
  {
    where: "Everywhere",
    keys: [
      [
        "Space",
        "Stop: both axes decelerate and hold. With Shift, too; on buttons, in lists, in fields for numbers and in empty ones for text",
      ],
      ["Ctrl + . or Pause", "EStop: motors off at once, fault estop"],
      ["Esc", "Gives up what is begun: a dialog, a drag, a text; after it, Space stops"],
      ["/", "To the command field"],
      ["?", "This help; also in an empty field"],
      ["Tab, Shift + Tab", "To the next control, to the one before"],
      ["Enter", "Presses the button that has the focus (Space is Stop)"],
      ["← →", "On the desk's tabs: the one beside; also Home, End"],
    ],
  },
  {
    where: "Command field",
    keys: [
      ["Enter", "Sends the line"],
      ["↑ ↓", "What was sent before"],
      ["Tab", "Completes, if there is something to complete; else moves on"],
      ["Esc", "Empties the field; a second time leaves it"],
    ],
  },
  {
    where: "Parameters",
    keys: [
      ["Enter", "Sends the value"],
      ["Esc", "Restores what the base has"],
    ],
  },
  {
    where: "Top view",
    keys: [
      ["← ↑ → ↓", "Pan"],
      ["+ −", "Zoom"],
      ["f", "Follow the base"],
      ["0", "Fit all in"],
      [
        "g",
        "Set a goal: arrows move it (finer with Shift), Enter fixes it, arrows turn its heading, Enter sends, Shift + Enter adds it to the path, Esc leaves",
      ],
    ],
  },
  { where: "Time bar", keys: [["← →", "An instant back, an instant on; also Page Up, Page Down, Home, End"]] },
];
