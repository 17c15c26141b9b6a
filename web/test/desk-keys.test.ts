/** The keys that stop a robot, in every place where they can be pressed. */
import assert from "node:assert/strict";
import { test } from "node:test";
import { bind } from "../src/views/keyboard.ts";
import { meaning, type Place, type Press, placeOf } from "../src/views/keys.ts";

const press = (key: string, more: Partial<Press> = {}): Press => ({
  key,
  code: key === " " ? "Space" : key,
  ctrlKey: false,
  altKey: false,
  metaKey: false,
  isComposing: false,
  ...more,
});
const NONE: Place = { field: "none", empty: true };
const EMPTY: Place = { field: "text", empty: true };
const TYPING: Place = { field: "text", empty: false };
const NUMBER: Place = { field: "number", empty: false };

test("the space bar stops everywhere but in a text that has begun", () => {
  assert.equal(meaning(press(" "), NONE), "stop");
  assert.equal(meaning(press(" "), EMPTY), "stop");
  assert.equal(meaning(press(" "), NUMBER), "stop");
  assert.equal(meaning(press(" "), TYPING), undefined);
  // A keyboard whose layout puts something else there still has that bar.
  assert.equal(meaning(press("\u00a0", { code: "Space" }), NONE), "stop");
});

test("the space bar with Ctrl, Alt or Meta is the system's, with an input method at work the text's", () => {
  for (const modifier of ["ctrlKey", "altKey", "metaKey"] as const)
    assert.equal(meaning(press(" ", { [modifier]: true }), NONE), undefined);
  assert.equal(meaning(press(" ", { isComposing: true }), EMPTY), undefined);
  assert.equal(meaning(press(" ", { isComposing: true }), NONE), "stop");
});

test("Ctrl and a full stop, or Pause, is EStop, also while a text is typed", () => {
  for (const place of [NONE, EMPTY, TYPING, NUMBER]) {
    assert.equal(meaning(press(".", { ctrlKey: true }), place), "estop");
    assert.equal(meaning(press("Pause"), place), "estop");
    assert.equal(meaning(press("."), place), undefined);
  }
});

test("keys that are letters act only where nothing is typed", () => {
  assert.equal(meaning(press("?"), NONE), "help");
  assert.equal(meaning(press("?"), EMPTY), "help");
  assert.equal(meaning(press("?"), TYPING), undefined);
  assert.equal(meaning(press("/"), NONE), "command");
  assert.equal(meaning(press("/"), EMPTY), undefined);
  assert.equal(meaning(press("m"), NONE), undefined);
});

test("what is a field, and of which kind", () => {
  const element = (tagName: string, more = {}) => ({ tagName, ...more }) as unknown as EventTarget;
  assert.deepEqual(placeOf(element("BUTTON", { value: "" })), NONE);
  assert.deepEqual(placeOf(element("SELECT", { value: "x" })), NONE);
  assert.deepEqual(placeOf(element("INPUT", { type: "range", value: "5" })), NONE);
  assert.deepEqual(placeOf(element("INPUT", { type: "text", value: "" })), EMPTY);
  assert.deepEqual(placeOf(element("INPUT", { type: "search", value: "x" })), TYPING);
  assert.deepEqual(placeOf(element("INPUT", { type: "text", inputMode: "decimal", value: "1" })), NUMBER);
  assert.deepEqual(placeOf(element("TEXTAREA", { value: "x" })), TYPING);
  assert.deepEqual(placeOf(null), NONE);
});

/** As much of a window as the keyboard asks for. */
function pageWith(focus: () => object | null) {
  const target = Object.assign(new EventTarget(), {
    document: Object.defineProperty(new EventTarget(), "activeElement", { get: focus }),
    setTimeout: (run: () => void) => run(),
  });
  const key = (kind: "keydown" | "keyup", name: string, more = {}) => {
    const event = new Event(kind, { cancelable: true, bubbles: true });
    Object.assign(event, press(name), { repeat: false, ...more });
    Object.defineProperty(event, "target", { get: focus });
    target.dispatchEvent(event);
    return event;
  };
  return { target: target as unknown as Window, key };
}

test("a held space bar stops once, and neither its press nor its release clicks the button that has the focus", () => {
  let stops = 0;
  const none = () => {};
  const { target, key } = pageWith(() => ({ tagName: "BUTTON" }));
  const on = { stop: () => (stops += 1), estop: none, help: none, command: none, escape: none, blanks: none };
  const unbind = bind(target, { ...on, stop: () => void on.stop() });
  assert.ok(key("keydown", " ").defaultPrevented);
  assert.ok(key("keydown", " ", { repeat: true }).defaultPrevented);
  assert.ok(key("keydown", " ", { shiftKey: true, repeat: true }).defaultPrevented);
  assert.ok(key("keyup", " ").defaultPrevented);
  assert.equal(stops, 1);
  // Held down elsewhere and then here: its first event on this page counts, though it is a repetition.
  key("keydown", " ", { repeat: true });
  assert.equal(stops, 2);
  // Its release was lost on the way (a remote desktop, a wireless keyboard): a press that is no repetition counts.
  key("keydown", " ");
  assert.equal(stops, 3);
  // Its release was another window's.
  target.dispatchEvent(new Event("blur"));
  key("keydown", " ");
  assert.equal(stops, 4);
  unbind();
  key("keydown", " ");
  assert.equal(stops, 4);
});

test("a blank that is typed stays one, and its release is left alone", () => {
  let stops = 0;
  let blanks: boolean | undefined;
  const none = () => {};
  const field = { tagName: "INPUT", type: "text", value: "m" };
  const { target, key } = pageWith(() => field);
  bind(target, {
    stop: () => {
      stops += 1;
    },
    estop: none,
    help: none,
    command: none,
    escape: none,
    blanks: (typed) => {
      blanks = typed;
    },
  });
  target.document.dispatchEvent(new Event("input"));
  assert.equal(blanks, true);
  assert.equal(key("keydown", " ").defaultPrevented, false);
  assert.equal(key("keyup", " ").defaultPrevented, false);
  assert.equal(stops, 0);
  field.value = "";
  target.document.dispatchEvent(new Event("input"));
  assert.equal(blanks, false);
  key("keydown", " ");
  assert.equal(stops, 1);
});
