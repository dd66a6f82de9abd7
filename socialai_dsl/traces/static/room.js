// @ts-check
/** Draws a picture of cells on a canvas, and over it what is said. */
import { SEEN_LINE, drawTile } from "./tiles.js";
import { inView } from "./trace.js";

/** @typedef {import("./trace.js").Picture} Picture */

/**
 * Draw a picture; the canvas gets its size.
 * @param {HTMLCanvasElement} canvas
 * @param {Picture} picture
 * @param {{tile: number, letters?: boolean}} options tile: side of a cell in pixels of the canvas; letters: also the
 *   first letters of colours
 */
export function drawPicture(canvas, picture, { tile, letters = false }) {
  const { width, height, cells, agent, below, gestures, held, marks, tinted, seen: marked } = picture;
  canvas.width = width * tile;
  canvas.height = height * tile;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const seen = (/** @type {number} */ x, /** @type {number} */ y) =>
    tinted && x >= 0 && y >= 0 && x < width && y < height && (marked ? marked.has(y * width + x) : inView(agent, x, y));
  cells.forEach((look, cell) => {
    const x = cell % width, y = Math.floor(cell / width);
    drawTile(context, x * tile, y * tile, tile, look, {
      agent: agent[0] === x && agent[1] === y ? agent[2] : undefined,
      seen: seen(x, y),
      below: below.get(cell),
      gesture: gestures.get(cell),
      held: held.get(cell),
      marks: marks.get(cell),
      rays: raysAt(picture, x, y),
      letter: letters,
    });
  });
  context.fillStyle = SEEN_LINE;
  const line = Math.max(1, Math.floor(tile / 16));
  cells.forEach((_, cell) => {
    const x = cell % width, y = Math.floor(cell / width), left = x * tile, top = y * tile;
    if (!seen(x, y)) return;
    if (!seen(x - 1, y)) context.fillRect(left, top, line, tile);
    if (!seen(x + 1, y)) context.fillRect(left + tile - line, top, line, tile);
    if (!seen(x, y - 1)) context.fillRect(left, top, tile, line);
    if (!seen(x, y + 1)) context.fillRect(left, top + tile - line, tile, line);
  });
}

/** The lines from NPCs to the cells that they point at, as far as they may come through a cell.
 * @param {Picture} picture @param {number} x @param {number} y @returns {import("./tiles.js").Ray[]} */
function raysAt({ width, cells, gestures }, x, y) {
  return [...gestures].flatMap(([cell, { pointing, at }]) => {
    if (!at?.length) return [];
    const left = (cell % width) - x, up = Math.floor(cell / width) - y, right = left + at[0], down = up + at[1];
    return left * right <= 0 && up * down <= 0 ? [[[left, up], [right, down], pointing, cells[cell][1]]] : [];
  });
}

/** A side of a cell at which the picture fits into so many CSS pixels, on this screen.
 * @param {Picture} picture @param {number} width @param {number} height @param {number} most */
export function fittingTile(picture, width, height, most) {
  const side = Math.max(12, Math.min(most, width / picture.width, height / picture.height));
  return Math.floor(side * (globalThis.devicePixelRatio || 1));
}
