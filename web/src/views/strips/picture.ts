/** What the canvases show, as one picture: the top view on the left, the strips with their names on the right. */

const MARGIN = 12;
const CAPTION = 16;
const TITLE = 26;
const FONT = "12px system-ui, 'DejaVu Sans', sans-serif";

export interface Tile {
  readonly caption: string;
  readonly width: number;
  readonly height: number;
}

export interface Placed {
  readonly x: number;
  readonly y: number;
}

/** Where each tile lies, the first one on the left, the rest below each other on the right; and how large that is. In pixels of the page. */
export function arrange(tiles: readonly Tile[]): { readonly width: number; readonly height: number; readonly placed: readonly Placed[] } {
  const [first, ...rest] = tiles;
  const room = (tile: Tile) => (tile.caption ? CAPTION : 0) + tile.height;
  const right = 2 * MARGIN + (first?.width ?? 0);
  let y = TITLE;
  const placed: Placed[] = first ? [{ x: MARGIN, y: TITLE + (first.caption ? CAPTION : 0) }] : [];
  for (const tile of rest) {
    placed.push({ x: right, y: y + (tile.caption ? CAPTION : 0) });
    y += room(tile);
  }
  const widest = Math.max(0, ...rest.map((tile) => tile.width));
  return {
    width: right + (widest > 0 ? widest + MARGIN : 0),
    height: Math.max(y, TITLE + (first ? room(first) : 0)) + MARGIN,
    placed,
  };
}

/** All canvases of a document that say what they are a picture of, and are seen. */
export async function picture(document: Document, title: string): Promise<Blob> {
  const canvases = [...document.querySelectorAll<HTMLCanvasElement>("canvas[data-picture]")].filter(
    (canvas) => canvas.offsetParent !== null,
  );
  const tiles = canvases.map((canvas) => ({
    caption: canvas.dataset.picture ?? "",
    width: canvas.clientWidth,
    height: canvas.clientHeight,
  }));
  const { width, height, placed } = arrange(tiles);
  const ratio = Math.max(1, ...canvases.map((canvas) => canvas.width / Math.max(1, canvas.clientWidth)));
  const page = document.createElement("canvas");
  page.width = Math.ceil(width * ratio);
  page.height = Math.ceil(height * ratio);
  const ctx = page.getContext("2d");
  if (!ctx) throw new Error("this browser draws no canvas");
  const style = getComputedStyle(document.documentElement);
  ctx.scale(ratio, ratio);
  ctx.fillStyle = style.getPropertyValue("--paper").trim() || "#ffffff";
  ctx.fillRect(0, 0, width, height);
  ctx.fillStyle = style.getPropertyValue("--ink").trim() || "#000000";
  ctx.textBaseline = "middle";
  ctx.font = `bold ${FONT}`;
  ctx.fillText(title, MARGIN, TITLE / 2);
  ctx.font = FONT;
  canvases.forEach((canvas, index) => {
    const [tile, place] = [tiles[index] as Tile, placed[index] as Placed];
    if (tile.caption) ctx.fillText(tile.caption, place.x, place.y - CAPTION / 2);
    ctx.drawImage(canvas, place.x, place.y, tile.width, tile.height);
  });
  return new Promise((resolve, reject) =>
    page.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the picture could not be made"))), "image/png"),
  );
}
