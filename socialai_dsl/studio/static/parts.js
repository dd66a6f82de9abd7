// @ts-check
/** The parts of the page that show an episode and that replays do not have; as those of panels.js. */
import { make, panel } from "./dom.js";
import { drawPicture } from "./room.js";
import { NPC } from "./tiles.js";

/** @typedef {import("./trace.js").Episode} Episode */

const MARBLE = 16;

/** All rules with how often they have fired, in this episode and in all since the text was changed. */
export class Counts {
  /** @param {(at: string) => void} open */
  constructor(open) {
    this.open = open;
    this.rows = make("ul", { class: "rules" });
    this.root = panel("All rules, and how often each fired", "counts", this.rows);
    /** @type {string[]} of all rules; of a suite behind their member's name and ": " */ this.names = [];
    this.episodes = 0;
    /** @type {Map<string, number>} */ this.before = new Map();
    /** @type {Map<string, import("./trace.js").Rule>} */ this.met = new Map();
  }

  /** Begin to count anew. */
  forget() {
    this.episodes = 0;
    this.before.clear();
    this.met.clear();
  }

  /** Count an episode that another one follows. @param {Episode} episode */
  keep(episode) {
    if (!episode.length) return;
    this.episodes++;
    const counts = episode.counts(episode.length);
    episode.rules.forEach((rule, k) => {
      const key = JSON.stringify(rule);
      this.met.set(key, rule);
      this.before.set(key, (this.before.get(key) ?? 0) + (counts.get(k) ?? 0));
    });
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const counts = episode.counts(step), now = new Map(episode.rules.map((rule, k) => [JSON.stringify(rule), counts.get(k) ?? 0]));
    const rules = new Map([...this.met, ...episode.rules.map((rule) => /** @type {const} */ ([JSON.stringify(rule), rule]))]);
    const { member } = episode.scenes[step], prefix = member ? `${member}: ` : "", known = new Set([...rules.values()].map((rule) => rule.name));
    const others = this.names.filter((name) => name.startsWith(prefix)).map((name) => name.slice(prefix.length)).filter((name) => !known.has(name));
    const met = [...rules].map(([key, rule]) => {
      const here = now.get(key) ?? 0, all = here + (this.before.get(key) ?? 0);
      return make("li", { class: all ? "fired" : "not" },
        make("b", {}, `${here}× ${rule.who}`), rule.state ? ` in ${rule.state} ` : " ",
        make("small", {}, make("button", { class: "link", onclick: () => this.open(rule.at) }, rule.at),
          this.episodes ? ` · ${all}× in ${this.episodes + 1} episodes` : ""),
        make("code", {}, rule.words));
    });
    this.rows.replaceChildren(...met, ...others.map((name) => make("li", { class: "not" }, make("b", {}, "0× "), name, make("small", {}, " · not asked yet"))));
  }
}

/** The view with directions as the observation has them: where they are those of a compass, the agent's own is not given.
 * @param {import("./trace.js").Picture} view @param {number} facing where the agent looks @param {boolean} compass
 * @returns {import("./trace.js").Picture} */
function observed(view, facing, compass) {
  const turned = (/** @type {number} */ drawn) => (drawn + facing + 1) % 4;
  const turns = (/** @type {number} */ type) => type === MARBLE || (type === NPC && compass);
  const cells = view.cells.map(([type, colour, status, drawn]) =>
    /** @type {import("./trace.js").Look} */ ([type, colour, status, turns(type) ? turned(drawn) : drawn]));
  const gestures = new Map([...view.gestures].map(([cell, one]) =>
    [cell, compass && one.pointing >= 0 ? { ...one, pointing: turned(one.pointing) } : one]));
  return { ...view, cells, gestures };
}

/** What a person on the agent's seat gets, and nothing else. */
export class Seat {
  constructor() {
    this.told = make("p");
    this.canvas = make("canvas", { role: "img", "aria-label": "what the agent sees, 7 by 7 cells; the agent looks up" });
    this.seen = make("pre", { "aria-live": "polite" });
    this.root = panel("As the agent sees it", "seat", this.told, this.canvas, this.seen);
    /** @type {{told: string, seen: string, compass: boolean}[]} of each moment */ this.moments = [];
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const { told, seen, compass } = this.moments[step], { view, moment } = episode.scenes[step];
    drawPicture(this.canvas, observed(view, moment.agent[2], compass), { tile: 64 });
    this.told.textContent = told;
    this.seen.textContent = seen;
  }
}
