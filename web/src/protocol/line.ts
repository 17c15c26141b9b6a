/** What is around a line: tag and check. See docs/protocol.md. */

/** CRC-16/CCITT-FALSE, by the catalogue CRC-16/IBM-3740: polynomial 0x1021, beginning with 0xFFFF, nothing reflected. */
export function crc16(text: string): number {
  let crc = 0xffff;
  for (let at = 0; at < text.length; at += 1) {
    crc ^= text.charCodeAt(at) << 8;
    for (let bit = 0; bit < 8; bit += 1) crc = crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1;
    crc &= 0xffff;
  }
  return crc;
}

/** Four digits, in upper case always: with checks required the base holds a client to one case. */
export function check(text: string): string {
  return crc16(text).toString(16).toUpperCase().padStart(4, "0");
}

/** A command with its tag and its check. */
export function wrap(tag: number, body: string): string {
  const tagged = `@${tag} ${body}`;
  return `${tagged}*${check(tagged)}`;
}

export interface Opened {
  readonly tag: number | undefined;
  readonly body: string;
  /** Whether it came with a check, and whether that is right. */
  readonly check: "none" | "good" | "bad";
}

const CHECK = /\*([0-9A-Fa-f]{4})$/;
const TAG = /^@(\d{1,5})(?:[ \t]+|$)/;

/** Takes tag and check off a line. */
export function unwrap(line: string): Opened {
  const end = CHECK.exec(line);
  const content = end ? line.slice(0, end.index) : line;
  const outcome = end ? (end[1]?.toUpperCase() === check(content) ? "good" : "bad") : "none";
  const tag = TAG.exec(content);
  const number = tag ? Number(tag[1]) : undefined;
  if (!tag || number === undefined || number > 65_535) return { tag: undefined, body: content.trim(), check: outcome };
  return { tag: number, body: content.slice(tag[0].length).trim(), check: outcome };
}
