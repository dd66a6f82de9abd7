// @ts-check
/** A page on which recorded episodes are played: forwards, backwards, step by step. */
import { make } from "./dom.js";
import { Cast, Mind, Replies, Rules, Seats, Sight, Stage, Transcript, legend, outcomeInWords } from "./panels.js";
import { Episode } from "./trace.js";

/** @typedef {import("./trace.js").Trace} Trace */

const SPEEDS = [1, 2, 4, 8];
const KEYS = [
  ["space", "play or pause"],
  ["← →", "a step back or on"],
  ["Home End", "first or last step"],
  ["↑ ↓", "another episode"],
  ["+ −", "faster or slower"],
  ["L", "letters for colours"],
];

class Replay {
  /** @param {Episode[]} episodes */
  constructor(episodes) {
    this.episodes = episodes;
    this.number = 0;
    this.step = 0;
    this.speed = 2;
    /** @type {ReturnType<typeof setInterval> | undefined} */ this.timer = undefined;
    const go = (/** @type {number} */ step) => this.go(this.number, step);
    this.stage = new Stage();
    this.sight = new Sight(() => this.show());
    this.panels = [this.stage, this.sight, new Transcript(go), new Cast(), new Seats(), new Mind(go), new Replies(), new Rules()];
    this.head = make("header");
    this.list = make("ol", { class: "episodes" });
    this.playing = make("button", { class: "main", onclick: () => this.toggle() });
    this.scrubber = make("input", { type: "range", min: 0, "aria-label": "step", oninput: () => go(Number(this.scrubber.value)) });
    this.count = make("output", {});
    this.speeds = make("select", { "aria-label": "steps a second", onchange: () => this.setSpeed(Number(this.speeds.value)) },
      ...SPEEDS.map((speed) => make("option", { value: speed }, `${speed}/s`)));
    this.root = this.layout();
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("hashchange", () => this.follow());
    addEventListener("resize", () => this.show());
  }

  layout() {
    const button = (/** @type {string} */ label, /** @type {string} */ sign, /** @type {() => number} */ step) =>
      make("button", { "aria-label": label, title: label, onclick: () => this.go(this.number, step()) }, sign);
    const controls = make("div", { class: "controls", role: "group", "aria-label": "player" },
      button("first step", "|◂", () => 0),
      button("a step back", "◂", () => this.step - 1),
      this.playing,
      button("a step on", "▸", () => this.step + 1),
      button("last step", "▸|", () => Infinity),
      this.scrubber, this.count, this.speeds);
    const keys = KEYS.flatMap(([key, meaning]) => [make("dt", {}, key), make("dd", {}, meaning)]);
    const [stage, sight, transcript, cast, seats, mind, replies, why] = this.panels.map((one) => one.root);
    return make("div", { class: "replay" }, this.head,
      make("nav", { "aria-label": "episodes", class: "panel" }, make("h2", {}, "Episodes"), this.list,
        make("details", {}, make("summary", {}, "Keys and colours"), make("dl", { class: "keys" }, ...keys), legend())),
      make("main", {}, stage, controls, seats, mind, replies, why),
      make("aside", {}, sight, transcript, cast));
  }

  get episode() {
    return this.episodes[this.number];
  }

  /** @param {number} number @param {number} step */
  go(number, step) {
    this.number = Math.max(0, Math.min(number, this.episodes.length - 1));
    this.step = Math.max(0, Math.min(step, this.episode.length));
    if (location.protocol !== "about:") history.replaceState(null, "", `#e${this.number + 1}s${this.step}`);
    this.show();
  }

  /** Go where the address says, `#e3s12`. */
  follow() {
    const [, number, step] = /^#e(\d+)s(\d+)$/.exec(location.hash) ?? ["", "1", "0"];
    this.go(Number(number) - 1, Number(step));
  }

  toggle() {
    if (this.timer !== undefined) this.pause();
    else {
      if (this.step === this.episode.length) this.go(this.number, 0);
      this.timer = setInterval(() => (this.step < this.episode.length ? this.go(this.number, this.step + 1) : this.pause()), 1000 / this.speed);
      this.show();
    }
  }

  pause() {
    clearInterval(this.timer);
    this.timer = undefined;
    this.show();
  }

  /** @param {number} speed steps a second */
  setSpeed(speed) {
    this.speed = speed;
    this.speeds.value = String(speed);
    if (this.timer === undefined) return;
    this.pause();
    this.toggle();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target instanceof HTMLSelectElement) return;
    const faster = SPEEDS.indexOf(this.speed) + ({ "+": 1, "=": 1, "-": -1 }[event.key] ?? 0);
    /** @type {Record<string, () => void>} */
    const actions = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.go(this.number, this.step - 1),
      ArrowRight: () => this.go(this.number, this.step + 1),
      Home: () => this.go(this.number, 0),
      End: () => this.go(this.number, Infinity),
      ArrowUp: () => this.go(this.number - 1, 0),
      ArrowDown: () => this.go(this.number + 1, 0),
      l: () => {
        this.stage.letters = !this.stage.letters;
        this.show();
      },
      "+": () => this.setSpeed(SPEEDS[Math.max(0, Math.min(faster, SPEEDS.length - 1))]),
    };
    actions["="] = actions["-"] = actions["+"];
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    if (event.key === " " && event.target instanceof HTMLButtonElement) event.target.blur();
    event.preventDefault();
    action();
  }

  show() {
    const { episode, step } = this, { trace } = episode;
    const member = episode.scenes[step].member;
    this.sight.choose(episode);
    this.head.replaceChildren(
      make("h1", {}, trace.scenario, member ? make("small", {}, ` ${member}`) : null),
      make("p", {}, `${trace.agent}${episode.seats.length > 1 ? ` as ${episode.called(episode.own)}` : ""}, ${trace.episode}. `, trace.about ?? ""), verdict(episode));
    this.list.replaceChildren(...this.episodes.map((one, k) => make("li", {},
      make("button", { "aria-current": k === this.number ? "true" : null, onclick: () => this.go(k, 0) },
        verdict(one), make("span", {}, `${one.trace.episode}, ${one.length} ${one.length === 1 ? "step" : "steps"}`)))));
    this.playing.textContent = this.timer === undefined ? "▶ play" : "⏸ pause";
    this.scrubber.max = String(episode.length);
    this.scrubber.value = String(step);
    this.count.textContent = `step ${step} of ${episode.length} · reward ${episode.part(episode.scenes[step]).reward.toFixed(3)}`;
    this.speeds.value = String(this.speed);
    for (const one of this.panels) one.show(episode, step);
  }
}

/** How an episode ended, by sign, word and colour. @param {Episode} episode */
function verdict({ ended }) {
  if (!ended) return make("strong", { class: "verdict open" }, "… not ended");
  return make("strong", { class: `verdict ${ended.success ? "good" : "bad"}` }, `${ended.success ? "✓" : "✗"} ${outcomeInWords(ended)}`);
}

/** Show the episodes that lie in the page, packed by gzip in base64. */
async function start() {
  const packed = document.getElementById("episodes")?.textContent ?? "";
  const bytes = Uint8Array.from(atob(packed.trim()), (letter) => letter.charCodeAt(0));
  const text = new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
  const replay = new Replay((await text.json()).map((/** @type {Trace} */ trace) => new Episode(trace)));
  document.body.replaceChildren(replay.root);
  replay.follow();
}

start();
