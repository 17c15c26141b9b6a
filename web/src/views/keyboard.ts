/** Listens to the keys of the whole page, before anything else on it does. */
import { isSpace, meaning, placeOf, typesBlanks } from "./keys.ts";

export interface Keyboard {
  stop(): void;
  estop(): void;
  help(): void;
  /** To the command field. */
  command(): void;
  /** Closes what is open on top of the page. */
  escape(): void;
  /** The space bar types a blank where the focus is now, or stops again. */
  blanks(typed: boolean): void;
}

/** Binds the keys to a window; the returned function ends that. */
export function bind(target: Window, on: Keyboard): () => void {
  // While the space bar is held down for a Stop: its repetitions are no further ones, and its release must not click the button that has the focus.
  let held = false;
  const down = (event: KeyboardEvent) => {
    const means = meaning(event, placeOf(event.target));
    if (means === undefined) return;
    if (means === "escape") {
      on.escape();
      return;
    }
    event.preventDefault();
    if (means === "stop") {
      event.stopPropagation();
      // A press of its own is an order of its own, also when the release of the one before was lost on the way.
      if (!held || !event.repeat) on.stop();
      held = true;
    } else if (!event.repeat) on[means]();
  };
  const up = (event: KeyboardEvent) => {
    if (!isSpace(event) || !held) return;
    held = false;
    event.preventDefault();
    event.stopPropagation();
  };
  const away = () => {
    held = false;
  };
  const look = () => on.blanks(typesBlanks(placeOf(target.document.activeElement)));
  // A field is emptied after its own listeners have run.
  const lookLater = () => target.setTimeout(look);

  target.addEventListener("keydown", down, { capture: true });
  target.addEventListener("keyup", up, { capture: true });
  target.addEventListener("blur", away);
  for (const kind of ["focusin", "focusout", "input", "keydown"]) target.document.addEventListener(kind, lookLater);
  return () => {
    target.removeEventListener("keydown", down, { capture: true });
    target.removeEventListener("keyup", up, { capture: true });
    target.removeEventListener("blur", away);
    for (const kind of ["focusin", "focusout", "input", "keydown"]) target.document.removeEventListener(kind, lookLater);
  };
}
