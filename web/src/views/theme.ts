/**
 * The colours of what is drawn on canvases. The style sheet has them as custom properties, for light and dark; canvases take no notice of a change, so
 * they are read anew. The defaults are Okabe and Ito's colours, which colour-blind people tell apart.
 */

const DEFAULTS = {
  ink: "#16202b",
  paper: "#ffffff",
  grid: "#e1e6ec",
  est: "#0072b2",
  true: "#b84a00",
  plan: "#8b3f7f",
  goal: "#00775a",
  hold: "#b9c2cc",
  accel: "#56b4e9",
  move: "#009e73",
  deccel: "#e69f00",
  fault: "#b3261e",
  muted: "#526070",
} as const;

export type Palette = Readonly<Record<keyof typeof DEFAULTS, string>>;

export function readPalette(element: Element): Palette {
  const style = getComputedStyle(element);
  const entries = Object.entries(DEFAULTS).map(([name, otherwise]) => [name, style.getPropertyValue(`--${name}`).trim() || otherwise]);
  return Object.fromEntries(entries) as Palette;
}

/** Calls back when the colours may have changed: by the system's scheme, or the page's own switch. */
export function watchPalette(changed: () => void): () => void {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", changed);
  const switched = new MutationObserver(changed);
  switched.observe(document.documentElement, { attributeFilter: ["data-theme", "class", "style"] });
  return () => {
    dark.removeEventListener("change", changed);
    switched.disconnect();
  };
}

/** Red, green and blue, 0 to 255, of `#rgb` or `#rrggbb`. */
export function channels(colour: string): readonly [number, number, number] {
  const digits = colour.slice(1);
  const wide = digits.length === 3 ? digits.replace(/./g, "$&$&") : digits;
  const value = Number.parseInt(wide, 16);
  return [(value >> 16) & 255, (value >> 8) & 255, value & 255];
}

/** Black or white, whichever is read better on a colour: by the contrast of WCAG 2. */
export function inkOn(colour: string): "#000000" | "#ffffff" {
  const linear = (channel: number) => {
    const part = channel / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  };
  const [red, green, blue] = channels(colour);
  const luminance = 0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue);
  return (luminance + 0.05) ** 2 > 1.05 * 0.05 ? "#000000" : "#ffffff";
}

/** A canvas has at most so many pixels for one of the page: more are not seen, and cost the software renderer time. */
export const MAX_PIXEL_RATIO = 2;
