// @ts-check
/** What a person on a seat of a game sees and does, wherever it is played. */
import { NPC } from "./tiles.js";

/** @typedef {Record<string, any>} Reply */

export const MARBLE = 16;
const VIEW = 7, UP = 3;
/** What keys do. @type {Record<string, string>} */
export const MOVES = { ArrowLeft: "left", a: "left", ArrowRight: "right", d: "right", ArrowUp: "forward", w: "forward",
  t: "toggle", p: "pickup", o: "drop", x: "done", ".": "none", " ": "none" };

/** The view with directions as the observation has them: where they are those of a compass, the agent's own is not given.
 * @param {import("./trace.js").Picture} view @param {number} facing where the agent looks @param {boolean} compass
 * @returns {import("./trace.js").Picture} */
export function observed(view, facing, compass) {
  const turned = (/** @type {number} */ drawn) => (drawn + facing + 1) % 4;
  const turns = (/** @type {number} */ type) => type === MARBLE || (type === NPC && compass);
  const cells = view.cells.map(([type, colour, status, drawn]) =>
    /** @type {import("./trace.js").Look} */ ([type, colour, status, turns(type) ? turned(drawn) : drawn]));
  const gestures = new Map([...view.gestures].map(([cell, one]) =>
    [cell, compass && one.pointing >= 0 ? { ...one, pointing: turned(one.pointing) } : one]));
  return { ...view, cells, gestures };
}

/** What is seen, as it is drawn. @param {Reply} view @returns {import("./trace.js").Picture} */
export function pictureOf({ cells, gestures, held, marks }) {
  const shown = gestures.map((/** @type {any[]} */ [cell, pointing, act, ...at]) => [cell, { pointing, act, at }]);
  return { width: VIEW, height: VIEW, cells, agent: [(VIEW - 1) / 2, VIEW - 1, UP], below: new Map(), gestures: new Map(shown), held: new Map(held), marks: new Map(marks), tinted: false };
}
