// @ts-check
/** The parts of the page that show an episode and that replays do not have; as those of panels.js. */
import { make, panel } from "./dom.js";
import { drawPicture } from "./room.js";
import { MARBLE, observed } from "./seat.js";
import { NPC } from "./tiles.js";

/** @typedef {import("./trace.js").Episode} Episode */

const UP = 3, VIEW = 7;
const AGENT = "the agent";
/** All rules with how often they have fired, in this episode and in all since the text was changed. */
export class Counts {
  /** @param {(at: string) => void} open */
  constructor(open) {
    this.open = open;
    this.rows = make("ul", { class: "rules", tabindex: 0, "aria-label": "all rules" });
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

/** What a person on a seat gets, and nothing else. */
export class Seat {
  constructor() {
    this.told = make("p");
    this.canvas = make("canvas", { role: "img" });
    this.seen = make("pre", { "aria-live": "polite" });
    this.root = panel("", "seat", this.told, this.canvas, this.seen);
    /** @type {{told: string, seen: string, compass: boolean}[]} of each moment */ this.moments = [];
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const { told, seen, compass } = this.moments[step], scene = episode.scenes[step];
    const who = episode.seats.length > 1 ? episode.called(episode.own) : AGENT, facing = episode.pose(scene, episode.own)?.[2] ?? UP;
    drawPicture(this.canvas, observed(episode.part(scene).view, facing, compass), { tile: 64 });
    this.canvas.setAttribute("aria-label", `what ${who} sees, 7 by 7 cells; who sees it looks up`);
    /** @type {HTMLElement} */ (this.root.firstElementChild).textContent = `As ${who} sees it`;
    this.told.textContent = told;
    this.seen.textContent = seen;
  }
}

/** @typedef {{who: string, step: number, side: number, cells: number[]}} Looked */

/** What a member of the cast sees, turned so that it looks up; what it does not see is dark.
 * @param {import("./trace.js").Picture} room @param {[number, number]} at where it is @param {number} facing
 * @param {Looked} looked @returns {import("./trace.js").Picture} */
function viewOf(room, [x, y], facing, { side, cells }) {
  const [alongX, alongY] = [[1, 0], [0, 1], [-1, 0], [0, -1]][facing], half = Math.floor(side / 2), width = 2 * half + 1;
  const turned = (/** @type {number} */ direction) => (direction + UP - facing + 4) % 4, seen = new Set(cells);
  /** @type {import("./trace.js").Picture} */
  const view = { width, height: side, cells: [], agent: [-1, -1, 0], below: new Map(), gestures: new Map(), held: new Map(), marks: new Map(), tinted: false };
  for (let k = 0; k < width * side; k++) {
    const ahead = side - 1 - Math.floor(k / width), right = (k % width) - half;
    const column = x + ahead * alongX - right * alongY, row = y + ahead * alongY + right * alongX, cell = row * room.width + column;
    const inside = column >= 0 && row >= 0 && column < room.width && row < room.height && seen.has(cell);
    const [type, colour, status, drawn] = inside ? room.cells[cell] : [0, 0, 0, 0];
    view.cells.push([type, colour, status, type === NPC || type === MARBLE ? turned(drawn) : drawn]);
    if (!inside) continue;
    if (column === room.agent[0] && row === room.agent[1]) view.agent = [k % width, Math.floor(k / width), turned(room.agent[2])];
    for (const part of /** @type {const} */ (["below", "held", "marks"])) {
      const one = room[part].get(cell);
      if (one !== undefined) /** @type {Map<number, any>} */ (view[part]).set(k, one);
    }
    const gesture = room.gestures.get(cell);
    if (gesture) {
      const { pointing, at } = gesture, [right, down] = at?.length ? at : [0, 0];
      view.gestures.set(k, { ...gesture, pointing: pointing < 0 ? pointing : turned(pointing),
        at: at?.length ? [down * alongX - right * alongY, -(right * alongX + down * alongY)] : at });
    }
  }
  return view;
}

/** What somebody sees: the agent or another seat, as it is observed, or a member of the cast. */
export class Views {
  /** @param {() => void} changed told when somebody else's view is to be shown */
  constructor(changed) {
    this.who = make("select", { "aria-label": "whose view", title: "whose view this is, and is marked in the room", onchange: changed });
    this.canvas = make("canvas", { role: "img" });
    this.words = make("p", { class: "quiet" });
    this.root = panel("What somebody sees", "sight", this.who, this.canvas, this.words);
    /** @type {Looked | null} what the chosen member of the cast sees */ this.looked = null;
    /** @type {string[]} the seats of the episode, whose views it has */ this.seats = [];
    this.own = "";
  }

  /** The member of the cast without a seat whose view is shown; null for that of a seat. */
  get member() {
    return this.who.value && this.who.value !== AGENT && !this.seats.includes(this.who.value) ? this.who.value : null;
  }

  /** Let an episode be seen from the chosen seat, at first from the player's. @param {Episode} episode @param {number} step */
  choose(episode, step) {
    const names = [AGENT, ...episode.scenes[step].cast.map(({ key }) => key)], called = (/** @type {string} */ seat) => (seat === "agent" ? AGENT : seat);
    const chosen = this.own === episode.own ? this.who.value : called(episode.own);
    if (names.join() !== [...this.who.options].map(({ value }) => value).join())
      this.who.replaceChildren(...names.map((name) => make("option", { value: name }, name)));
    this.who.value = names.includes(chosen) ? chosen : called(episode.own);
    Object.assign(this, { seats: episode.seats, own: episode.own });
    episode.viewer = this.member ? episode.own : this.who.value === AGENT ? "agent" : this.who.value;
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const scene = episode.scenes[step];
    if (!this.member) {
      this.looked = null;
      this.canvas.hidden = false;
      drawPicture(this.canvas, episode.part(scene, episode.viewer).view, { tile: 32 });
      this.canvas.setAttribute("aria-label", `${this.who.value}'s own view, 7 by 7 cells; who sees it looks up`);
      this.words.textContent = "";
      return;
    }
    const { looked } = this;
    if (!looked || looked.who !== this.member || looked.step !== step) return; // it is asked for
    const at = episode.place(scene, looked.who), facing = ["right", "down", "left", "up"].indexOf(scene.state[`${looked.who}.facing`]);
    this.canvas.hidden = !at;
    if (at) drawPicture(this.canvas, viewOf(scene.room, at, facing, looked), { tile: Math.floor((32 * VIEW) / Math.max(VIEW, looked.side)) });
    const cells = new Set(looked.cells);
    const things = Object.keys(scene.state).filter((address) => address.endsWith(".at") && scene.state[address] && address !== `${looked.who}.at`)
      .filter((address) => cells.has(scene.state[address][1] * scene.room.width + scene.state[address][0])).map((address) => address.slice(0, -".at".length));
    const sees = at ? `${looked.who} sees ${things.join(", ") || "nobody and nothing"}.` : `${looked.who} is not in the room.`;
    this.words.textContent = sees;
    this.canvas.setAttribute("aria-label", `the view of ${looked.who}, which looks up. ${sees}`);
  }
}
