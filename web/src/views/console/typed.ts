/** What may be typed: a line as the base takes it, with room for the tag and the check that the page adds. */

/** The longest line, less `@65535 ` and `*hhhh`. */
export const LONGEST = 255 - 7 - 5;

/** Why a line is not sent; undefined if it may be. */
export function refused(line: string): string | undefined {
  if (/[\r\n]/.test(line)) return "one line at a time: glued together, two lines can mean a third";
  for (const character of line) {
    const code = character.codePointAt(0) ?? 0;
    if (code === 127 || (code < 32 && code !== 9)) return `a control character (${code}) is in the line: the base would refuse it`;
    if (code > 127) return `“${character}” is not ASCII: the base would refuse the line`;
  }
  if (line.length > LONGEST) return `longer than ${LONGEST} characters`;
  return undefined;
}

/** A line without its tag and its check. */
export function plain(line: string): string {
  return line.replace(/^@\d{1,5}\s+/, "").replace(/\*[0-9A-Fa-f]{4}$/, "");
}

export function tagOf(line: string): string | undefined {
  return /^@(\d{1,5})\b/.exec(line)?.[1];
}
