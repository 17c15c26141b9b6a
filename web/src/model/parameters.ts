/** The parameters of a base, as this page knows them. */
import type { ParamRow, ParamValue } from "../protocol/replies.ts";
import type { Parameter } from "./model.ts";

export class Parameters {
  #all = new Map<string, Parameter>();

  get all(): ReadonlyMap<string, Parameter> {
    return this.#all;
  }

  /** Some differ from what they were at first, or at the last save or load. */
  get unsaved(): boolean {
    return [...this.#all.values()].some((parameter) => parameter.value !== parameter.before);
  }

  clear(): void {
    this.#all = new Map();
  }

  /** All of them, as listed. */
  listed(rows: readonly ParamRow[]): void {
    const known = this.#all;
    this.#all = new Map(rows.map((row) => [row.name, { ...row, before: known.get(row.name)?.before ?? row.value }]));
  }

  /** One of them; nothing new of one that was never listed. */
  told(told: ParamValue): void {
    const known = this.#all.get(told.name);
    if (!known || known.value === told.value) return;
    this.#all = new Map(this.#all).set(told.name, { ...known, value: told.value });
  }

  /** What is in force is what is stored. */
  saved(): void {
    this.#all = new Map([...this.#all].map(([name, parameter]) => [name, { ...parameter, before: parameter.value }]));
  }
}
