/** What a line of the serial protocol may be, and how bytes become lines. */

/** The longest line without its end, either way. */
export const MAX_LINE = 255;

/** Why this is not a line that may be sent; undefined if it is one. */
export function notALine(line: string): string | undefined {
  if (line.length === 0) return "an empty line says nothing";
  if (line.length > MAX_LINE) return `the line is ${line.length} characters long, and ${MAX_LINE} is the most`;
  for (const character of line) {
    const code = character.codePointAt(0) ?? 0;
    if (code > 126) return `“${character}” is not ASCII`;
    if (code < 32 && code !== 9) return `the line has a control character (code ${code})`;
  }
  return undefined;
}

/** Takes bytes as they come and gives the lines that they make. Lines end with LF, CR or both; empty ones are nobody's. */
export class LineSplitter {
  #line = "";
  #dropping = false;
  /** Lines that were left out: longer than any may be, or with bytes that no line has. */
  dropped = 0;

  push(bytes: Uint8Array, line: (text: string) => void): void {
    for (const byte of bytes) {
      if (byte === 10 || byte === 13) this.#end(line);
      else if (this.#dropping) continue;
      else if (this.#line.length < MAX_LINE && isText(byte)) this.#line += String.fromCharCode(byte);
      else this.#drop();
    }
  }

  /** Bytes were lost: what goes on now is not what had begun. */
  lost(): void {
    if (this.#line !== "" && !this.#dropping) this.#drop();
  }

  #drop(): void {
    this.#dropping = true;
    this.#line = "";
    this.dropped += 1;
  }

  #end(line: (text: string) => void): void {
    const text = this.#line;
    this.#line = "";
    this.#dropping = false;
    if (text !== "") line(text);
  }
}

function isText(byte: number): boolean {
  return byte === 9 || (byte >= 32 && byte <= 126);
}
