// @ts-check
/** The parts of a page that show an episode at a step: each has an element `root`, and `show(episode, step)`. */
import { make, makeSvg, panel, spoken } from "./dom.js";
import { COLOURS, NPC, PALETTE, css, drawTile } from "./tiles.js";
import { drawPicture, fittingTile } from "./room.js";
import { inView, slotsOf } from "./trace.js";

/** @typedef {import("./trace.js").Episode} Episode */
/** @typedef {import("./trace.js").Scene} Scene */
/** @typedef {(step: number) => void} Go */

/** The room, with what is said in bubbles. */
export class Stage {
  constructor() {
    this.letters = false;
    /** @type {Set<number> | undefined} cells that are marked in place of the agent's field of view */ this.seen = undefined;
    this.canvas = make("canvas", { role: "img" });
    this.bubbles = make("div", { class: "bubbles" });
    this.told = make("p", { class: "visually-hidden", "aria-live": "polite" });
    this.sheet = make("div", { class: "sheet" }, this.canvas, this.bubbles);
    this.root = make("div", { class: "stage" }, this.sheet, this.told);
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const scene = episode.scenes[step];
    const tile = fittingTile(scene.room, this.root.clientWidth, Math.max(240, this.root.clientHeight), 96);
    drawPicture(this.canvas, { ...scene.room, seen: this.seen ?? inSight(episode, scene) }, { tile, letters: this.letters });
    const scale = globalThis.devicePixelRatio || 1;
    this.canvas.style.width = `${this.canvas.width / scale}px`;
    this.canvas.style.height = `${this.canvas.height / scale}px`;
    this.canvas.setAttribute("aria-label", roomInWords(scene));
    this.bubbles.replaceChildren(...this.speech(episode, scene));
    spread(/** @type {HTMLElement[]} */ ([...this.bubbles.children]));
    this.told.textContent = momentInWords(episode, scene);
  }

  /** @param {Episode} episode @param {Scene} scene */
  speech(episode, scene) {
    const { moment, room } = scene;
    return episode.said(scene).map((line) => {
      const place = line.who === "agent" && moment.agent[0] >= 0 ? /** @type {[number, number]} */ ([moment.agent[0], moment.agent[1]]) : line.who ? episode.place(scene, line.who) : null;
      const text = place || !line.name ? line.text : `${line.name}: ${line.text}`;
      const bubble = make("p", { class: line.who === episode.own ? "bubble own" : "bubble" }, text);
      const [x, y] = place ?? [room.width / 2 - 0.5, 0];
      const across = (x + 0.5) / room.width, below = y < 1.5;
      bubble.classList.add(across < 0.35 ? "leaning-right" : across > 0.65 ? "leaning-left" : "upright");
      bubble.classList.add(below ? "below" : "above");
      bubble.style.left = `${100 * across}%`;
      bubble.style.top = `${(100 * (y + (below ? 1 : 0))) / room.height}%`;
      return bubble;
    });
  }
}

/** Move bubbles that would cover others, away from those who speak. @param {HTMLElement[]} bubbles */
function spread(bubbles) {
  /** @type {DOMRect[]} */ const placed = [];
  for (const bubble of bubbles) {
    const down = bubble.classList.contains("below");
    let box = bubble.getBoundingClientRect(), moved = 0;
    for (const other of [...placed].sort((a, b) => (down ? a.top - b.top : b.bottom - a.bottom))) {
      if (box.left >= other.right || box.right <= other.left || box.top >= other.bottom || box.bottom <= other.top) continue;
      moved += down ? other.bottom + 3 - box.top : other.top - 3 - box.bottom;
      bubble.style.marginTop = `${moved}px`;
      box = bubble.getBoundingClientRect();
    }
    placed.push(box);
  }
}

/** The cells in sight of the seat whose view is shown; undefined for the agent, whose sight is marked without.
 * @param {Episode} episode @param {Scene} scene @returns {Set<number> | undefined} */
function inSight(episode, scene) {
  const pose = episode.pose(scene, episode.viewer), { width, height } = scene.room;
  if (pose && episode.viewer === "agent") return undefined;
  const cells = Array.from({ length: width * height }, (_, cell) => cell);
  return new Set(pose ? cells.filter((cell) => inView(pose, cell % width, Math.floor(cell / width))) : []);
}

/** Everything in the room, for those who do not see it. @param {Scene} scene */
function roomInWords(scene) {
  const things = Object.keys(scene.state).filter((address) => address.endsWith(".at") && scene.state[address]);
  const told = things.map((address) => {
    const who = address.slice(0, -".at".length), say = (/** @type {string} */ key) => scene.state[`${who}.${key}`];
    const looks = [say("color"), say("state"), say("facing") && `facing ${say("facing")}`].filter(Boolean).join(", ");
    return `${who}${looks ? ` (${looks})` : ""} at ${spoken(scene.state[address])}`;
  });
  return `Room of ${scene.room.width} by ${scene.room.height} cells. ${told.join("; ")}.`;
}

/** What happened in a step. @param {Episode} episode @param {Scene} scene */
function momentInWords(episode, scene) {
  const { moment, parts } = scene;
  if (!moment.t) return "Before the first step.";
  const did = parts.map((part, k) => `${episode.seats.length > 1 ? `${episode.called(episode.seats[k])} ` : ""}${part.did ?? "no action"}${part.said ? `, said “${part.said}”` : ""}`);
  const heard = episode.said(scene).filter(({ who }) => !episode.seats.includes(who ?? "")).map((line) => `${line.name ? `${line.name}: ` : ""}${line.text}`);
  const ended = moment.ended ? [`The episode ended: ${outcomeInWords(moment.ended)}.`] : [];
  return [`Step ${moment.t}: ${did.join("; ")}.`, ...heard, ...ended].join(" ");
}

/** How an episode ended; what the file says there often begins with the word. @param {import("./trace.js").Outcome} outcome */
export function outcomeInWords({ success, text }) {
  const word = success ? "success" : "failure";
  return text.startsWith(word) ? text : `${word}: ${text}`;
}

/** What is seen from a seat, the player's if no other is chosen. */
export class Sight {
  /** @param {() => void} [changed] told when another seat is chosen */
  constructor(changed = () => {}) {
    this.who = make("select", { "aria-label": "whose view", title: "whose view this is, and is marked in the room", onchange: changed });
    this.canvas = make("canvas", { role: "img" });
    this.root = panel("", "sight", this.who, this.canvas);
  }

  /** Let an episode be seen from the chosen seat. @param {Episode} episode */
  choose(episode) {
    const { seats } = episode;
    if (seats.join() !== [...this.who.options].map(({ value }) => value).join())
      this.who.replaceChildren(...seats.map((seat) => make("option", { value: seat, selected: seat === episode.viewer }, seat)));
    this.who.hidden = seats.length === 1;
    episode.viewer = this.who.value;
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const whose = episode.seats.length > 1 ? episode.called(episode.viewer) : "the agent";
    /** @type {HTMLElement} */ (this.root.firstElementChild).textContent = `${whose[0].toUpperCase()}${whose.slice(1)}'s own view`;
    this.canvas.setAttribute("aria-label", `${whose}'s own view, 7 by 7 cells; who sees it looks up`);
    drawPicture(this.canvas, episode.part(episode.scenes[step], episode.viewer).view, { tile: 32 });
  }
}

/** Who has which seat, and what was done and earned there; nothing where the agent plays alone. */
export class Seats {
  constructor() {
    this.rows = make("tbody");
    const heads = ["seat", "played by", "does", "says", "reward", ""].map((head) => make("th", { scope: "col" }, head));
    this.root = panel("The seats", "seats", make("table", {}, make("thead", {}, make("tr", {}, ...heads)), this.rows));
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const { seats, trace } = episode, scene = episode.scenes[step];
    this.root.hidden = seats.length === 1;
    if (this.root.hidden) return;
    this.rows.replaceChildren(...seats.map((seat, k) => {
      const { did, said, reward, success } = scene.parts[k], name = episode.called(seat);
      const by = seat === episode.own ? trace.agent : (trace.players?.[seat] ?? "script");
      return make("tr", {},
        make("th", { scope: "row" }, seat, name === seat ? null : make("small", {}, ` “${name}”`)),
        make("td", {}, by), make("td", {}, did ?? "–"), make("td", {}, said ?? ""), make("td", {}, reward.toFixed(3)),
        make("td", { class: success === null ? null : `verdict ${success ? "good" : "bad"}` }, success === null ? "" : success ? "✓ success" : "✗ no success"));
    }));
  }
}

/** What was said and heard so far. */
export class Transcript {
  /** @param {Go} go */
  constructor(go) {
    this.go = go;
    this.list = make("ol", { class: "lines", tabindex: 0, "aria-label": "what was said and heard" });
    this.root = panel("Said and heard", "transcript", this.list);
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const lines = episode.transcript(step).map((line) =>
      make("li", { class: [line.t === step ? "now" : "", line.reached ? "" : "unheard"].join(" ").trim() || null, title: line.reached ? null : `${episode.called(episode.viewer)} did not hear this` },
        make("button", { class: "step", title: `go to step ${line.t}`, onclick: () => this.go(line.t) }, String(line.t)),
        make("span", {}, make("b", { class: line.who === episode.own ? "own" : "heard" }, line.name ? `${line.name}: ` : ""), line.text)));
    this.list.replaceChildren(...(lines.length ? lines : [make("li", { class: "quiet" }, "Nothing was said yet.")]));
    this.list.scrollTop = this.list.scrollHeight;
  }
}

/** Who is in the room, in which state of which frame, and what else there is to know. */
export class Cast {
  constructor() {
    this.rows = make("tbody");
    this.facts = make("dl");
    const heads = ["", "who", "state", "looks"].map((head) => make("th", { scope: "col" }, head));
    this.root = panel("Who is in which state", "cast",
      make("table", {}, make("thead", {}, make("tr", {}, ...heads)), this.rows),
      make("details", { open: true }, make("summary", {}, "Drawn and remembered"), this.facts));
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const scene = episode.scenes[step];
    this.rows.replaceChildren(...scene.cast.map((member) => this.row(scene, member)));
    const shown = new Set(["at", "facing", "color", "clock", "poked", "state", "name", "last", "pointing", "gone"]);
    const cast = new Set(["agent", ...scene.cast.map((member) => member.key)]);
    const facts = Object.entries(scene.state).filter(([address]) => {
      const dot = address.lastIndexOf("."), who = address.slice(0, dot), key = address.slice(dot + 1);
      return !(cast.has(who) ? shown.has(key) : ["at", "facing", "clock"].includes(key)) && who !== "room" && address !== "member";
    });
    this.facts.replaceChildren(...facts.flatMap(([address, value]) => [
      make("dt", {}, address),
      make("dd", { class: address in scene.changed ? "changed" : null }, spoken(value)),
    ]));
  }

  /** @param {Scene} scene @param {import("./trace.js").Member} member */
  row(scene, member) {
    const say = (/** @type {string} */ key) => scene.state[`${member.key}.${key}`];
    const colour = COLOURS.indexOf(say("color"));
    const face = make("canvas", { width: 32, height: 32, "aria-hidden": true });
    const context = /** @type {CanvasRenderingContext2D} */ (face.getContext("2d"));
    drawTile(context, 0, 0, 32, [NPC, colour < 0 ? member.look[1] : colour, member.look[2], 1]);
    const looks = say("at") ? [say("color"), say("facing"), say("pointing") && `points ${say("pointing")}`].filter(Boolean).join(", ") : "gone";
    return make("tr", {},
      make("td", {}, face),
      make("th", { scope: "row" }, member.key, member.name !== member.key ? make("small", {}, ` “${member.name}”`) : null),
      make("td", { class: `${member.key}.state` in scene.changed ? "changed" : null }, spoken(say("state") ?? "–")),
      make("td", {}, looks));
  }
}

/** Which rules fired in a step, why the others did not, and how often each has fired. */
export class Rules {
  /** @param {(at: string) => void} [open] shows a place `file:line`; without it places are plain text */
  constructor(open) {
    this.open = open;
    /** @type {[Episode, number] | null} */ this.shown = null;
    this.who = make("select", { "aria-label": "whose rules", onchange: () => this.shown && this.show(...this.shown) });
    this.list = make("ul", { class: "rules", tabindex: 0, "aria-label": "rules of this step" });
    this.root = panel("Rules: what fired, and why others did not", "why", this.who, this.list);
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    this.shown = [episode, step];
    const { fired = [], others = [] } = episode.scenes[step].moment;
    this.choices(["everyone", ...new Set(episode.rules.map((rule) => rule.who))]);
    const counts = episode.counts(step), wanted = this.who.value;
    const chosen = (/** @type {number} */ rule) => wanted === "everyone" || episode.rules[rule].who === wanted;
    const items = [
      ...fired.filter(chosen).map((rule) => this.item(episode, rule, null, counts)),
      ...others.filter(([rule]) => chosen(rule)).map(([rule, why]) => this.item(episode, rule, episode.texts[why], counts)),
    ];
    const none = step ? "No rule was asked in this step." : "Rules are asked from the first step on.";
    this.list.replaceChildren(...(items.length ? items : [make("li", { class: "quiet" }, none)]));
  }

  /** @param {string[]} names */
  choices(names) {
    const chosen = this.who.value;
    if (names.length === this.who.options.length) return;
    this.who.replaceChildren(...names.map((name) => make("option", { value: name, selected: name === chosen }, name)));
  }

  /** @param {Episode} episode @param {number} number @param {string | null} why @param {Map<number, number>} counts */
  item(episode, number, why, counts) {
    const rule = episode.rules[number], { open } = this, times = counts.get(number) ?? 0;
    const place = open ? make("button", { class: "link", onclick: () => open(rule.at) }, rule.at) : make("span", {}, rule.at);
    return make("li", { class: why === null ? "fired" : "not" },
      make("span", { class: "mark" }, why === null ? "✓ fired" : "– not"),
      make("b", {}, rule.who), rule.state ? ` in ${rule.state} ` : " ",
      make("small", {}, place, times ? ` · fired ${times}×` : ""),
      make("code", {}, rule.words),
      why === null ? null : make("span", { class: "reason" }, why));
  }
}

const SHADES = ["#3a6ecd", "#e08a1e", "#2f9e62", "#8e54b2", "#c23b3b", "#0f8f9b", "#9a7b1f", "#888c94"];

/** What a trained agent made of each moment: what it would do, how likely, and what it expects to get. */
export class Mind {
  /** @param {Go} go */
  constructor(go) {
    this.go = go;
    this.chart = make("div", { class: "chart" });
    this.bars = make("div", { class: "bars" });
    this.value = make("p", { class: "value" });
    this.root = panel("What the agent expected and preferred", "mind", this.value, this.chart, this.bars);
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    const known = episode.scenes.some((scene) => scene.moment.thought);
    this.root.hidden = !known;
    if (!known) return;
    this.chart.replaceChildren(this.draw(episode, step));
    const { thought } = episode.scenes[step].moment, { action } = episode.part(episode.scenes[step]);
    if (!thought) {
      this.value.textContent = "Before the first step.";
      this.bars.replaceChildren();
      return;
    }
    const { actions, templates } = episode.trace;
    const [body, speak, template, ...words] = thought.probabilities;
    this.value.textContent =
      `Chose step ${step} expecting a return of ${thought.value?.toFixed(3) ?? "?"}; ` +
      `spoke with probability ${percent(speak[1])}.`;
    const spoke = action?.[1] === 1;
    this.bars.replaceChildren(
      this.list("moves", [...actions, "none"], body, action?.[0] ?? -1),
      this.list(spoke ? "says" : "would say", templates, template, spoke ? (action?.[2] ?? -1) : -1),
      ...slotsOf(episode.trace).map(([name, known], k) =>
        this.list(name === "noun" ? "about" : name, known, words[k], spoke ? (action?.[3 + k] ?? -1) : -1)));
  }

  /** @param {string} title @param {string[]} words @param {number[]} shares @param {number} chosen */
  list(title, words, shares, chosen) {
    const order = words.map((_, k) => k).sort((a, b) => (shares[b] ?? 0) - (shares[a] ?? 0)).slice(0, 6);
    return make("table", {}, make("caption", {}, title), make("tbody", {}, ...order.map((k) => {
      const bar = make("span", { class: "bar" });
      bar.style.width = `${100 * (shares[k] ?? 0)}%`;
      return make("tr", { class: k === chosen ? "chosen" : null },
        make("th", { scope: "row" }, words[k], k === chosen ? " ✓" : ""), make("td", {}, bar, make("span", {}, percent(shares[k] ?? 0))));
    })));
  }

  /** Probabilities of movements stacked over the steps, and the expected return as a line.
   * @param {Episode} episode @param {number} step */
  draw(episode, step) {
    const width = 600, height = 120, moments = episode.scenes.map((scene) => scene.moment);
    const across = width / Math.max(1, episode.length);
    const parts = moments.flatMap(({ thought, t }) => {
      let top = 0;
      return (thought?.probabilities[0] ?? []).map((share, k) => {
        top += share;
        return makeSvg("rect", {
          x: (t - 1) * across, width: across + 0.3, y: height * (top - share), height: height * share, fill: SHADES[k % SHADES.length],
        });
      });
    });
    const values = moments.map(({ thought }) => thought?.value ?? null);
    const known = /** @type {number[]} */ (values.filter((value) => value !== null));
    const low = Math.min(0, ...known), high = Math.max(1, ...known);
    const line = values.flatMap((value, t) =>
      value === null ? [] : [`${(t - 0.5) * across},${height * (1 - (value - low) / (high - low))}`]);
    const chart = makeSvg("svg", { viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: "none", role: "img",
        "aria-label": "probability of each movement over the steps, and the expected return" },
      ...parts,
      makeSvg("polyline", { points: line.join(" "), class: "halo" }),
      makeSvg("polyline", { points: line.join(" "), class: "line" }),
      makeSvg("rect", { x: (step - 1) * across, width: across, y: 0, height, class: "now" }));
    chart.addEventListener("click", (event) => {
      const box = chart.getBoundingClientRect(), share = (/** @type {MouseEvent} */ (event).clientX - box.left) / box.width;
      this.go(Math.min(episode.length, Math.floor(share * episode.length) + 1));
    });
    const words = [...episode.trace.actions, "none"];
    const key = make("ul", { class: "key" }, make("li", {}, "— expected return"), ...words.map((word, k) => {
      const swatch = make("i", {});
      swatch.style.background = SHADES[k % SHADES.length];
      return make("li", {}, swatch, word);
    }));
    return make("div", {}, chart, key);
  }
}

/** What language models answered in a step, and on which seat, where several play. */
export class Replies {
  constructor() {
    this.list = make("ul", {});
    this.root = panel("What the model answered", "replies", this.list);
  }

  /** @param {Episode} episode @param {number} step */
  show(episode, step) {
    this.root.hidden = !episode.scenes.some((scene) => scene.moment.replies);
    const items = (episode.scenes[step].moment.replies ?? []).map(({ text, error, seat }) =>
      make("li", { tabindex: 0 }, seat ? make("strong", {}, `${seat}: `) : null, text || "(nothing)", error ? make("small", { class: "verdict bad" }, `✗ ${error}`) : null));
    this.list.replaceChildren(...(items.length ? items : [make("li", { class: "quiet" }, "Before the first step.")]));
  }
}

const percent = (/** @type {number} */ share) => `${(100 * share).toFixed(share > 0.0995 ? 0 : 1)} %`;

/** What the letters of colours mean. */
export function legend() {
  return make("ul", { class: "key" }, ...COLOURS.map((colour, k) => {
    const swatch = make("i", {});
    swatch.style.background = css(PALETTE[k]);
    return make("li", {}, swatch, `${"RGBPYE"[k]} ${colour}`);
  }));
}
