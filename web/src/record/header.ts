/** The columns of a CSV file, and its cells. */

/** More counts than the base's own counters hold are none. */
const MAX_COUNT = 2 ** 31 - 1;

/** Takes a row's cells. Throws what is wrong with them. */
export type TakeRow = (cells: readonly string[]) => void;

export class Columns {
  readonly names: readonly string[];
  #at: ReadonlyMap<string, number>;

  /** Throws if a name appears twice. */
  constructor(line: string) {
    this.names = cells(line);
    for (const [at, name] of this.names.entries()) {
      if (this.names.indexOf(name) !== at) throw new Error(`column \`${name}\` appears twice`);
    }
    this.#at = new Map(this.names.map((name, at) => [name, at]));
  }

  has(...names: readonly string[]): boolean {
    return names.every((name) => this.#at.has(name));
  }

  /** Where it is; throws if it is missing. */
  find(name: string): number {
    const at = this.#at.get(name);
    if (at === undefined) throw new Error(`column \`${name}\` is missing`);
    return at;
  }

  /** The cells of a row. Throws if they are not as many as the columns. */
  split(line: string): readonly string[] {
    const row = cells(line);
    if (row.length !== this.names.length) throw new Error(`${row.length} cells instead of ${this.names.length}`);
    return row;
  }

  /** A cell's number. Throws if it is none. */
  number(row: readonly string[], at: number): number {
    const cell = row[at] ?? "";
    const value = Number(cell);
    if (cell === "" || !Number.isFinite(value)) throw new Error(`column \`${this.names[at]}\`: \`${clip(cell)}\` is not a number`);
    return value;
  }

  /** A cell's counts of an encoder. Throws if it is no whole number of them. */
  count(row: readonly string[], at: number): number {
    const value = this.number(row, at);
    if (!Number.isInteger(value) || Math.abs(value) > MAX_COUNT) throw new Error(`column \`${this.names[at]}\`: ${value} is not a count`);
    return value;
  }

  /** A cell's number, or NaN for an empty one. */
  maybe(row: readonly string[], at: number): number {
    return row[at] === "" ? Number.NaN : this.number(row, at);
  }

  /** A cell that is one of these words: which. */
  word(row: readonly string[], at: number, words: readonly string[]): number {
    const cell = row[at] ?? "";
    const found = words.indexOf(cell);
    if (found < 0) throw new Error(`column \`${this.names[at]}\`: \`${clip(cell)}\` is not one of ${words.join(", ")}`);
    return found;
  }
}

function cells(line: string): string[] {
  return line.split(",").map((cell) => {
    const text = cell.trim();
    return text.startsWith('"') && text.endsWith('"') ? text.slice(1, -1) : text;
  });
}

/** What is wrong may be long. */
export function clip(text: string): string {
  return text.length > 40 ? `${text.slice(0, 40)}…` : text;
}
