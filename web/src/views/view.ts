/** What each view of the desk is: something that shows a model, and can be given another one. */
import type { Model, Topic } from "../model/model.ts";

export interface View {
  setModel(model: Model): void;
  destroy(): void;
}

/** Says something to the user, beside the Stop button. */
export type Say = (text: string, kind?: "done" | "refused") => void;

/** Calls `changed` now, when one of the topics is new, and (with `anew`) when another model is shown. */
export function watch(model: Model, topics: readonly Topic[], changed: (model: Model, anew: boolean) => void): View {
  let end = () => {};
  const setModel = (next: Model) => {
    end();
    end = next.subscribe(topics, () => changed(next, false));
    changed(next, true);
  };
  setModel(model);
  return { setModel, destroy: () => end() };
}

/** Why the base refused, if its reply is an error. */
export function refusal(reply: string): string | undefined {
  return reply.startsWith("ERR") ? reply.replace(/^ERR\s*/, "") : undefined;
}

/** Gives an order and tells what became of it; true if the base obeys. */
export async function order(what: string, reply: Promise<string | undefined> | undefined, say: Say): Promise<boolean> {
  if (!reply) {
    say(`${what}: this page does not drive a base now`, "refused");
    return false;
  }
  try {
    const refused = refusal((await reply) ?? "");
    say(refused === undefined ? `${what}: done` : `${what} is refused: ${refused}`, refused === undefined ? "done" : "refused");
    return refused === undefined;
  } catch (error) {
    say(`${what}: ${reason(error)}`, "refused");
    return false;
  }
}

export function reason(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** The commands, if they would be obeyed. */
export function driving(model: Model) {
  return model.mayDrive ? model.commands : undefined;
}
