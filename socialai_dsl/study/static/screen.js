// @ts-check
/** What a participant sees of a study, on its own page and on others that show it: rooms, and where others are waited for. */
import { make, panel } from "./dom.js";
import { drawPicture } from "./room.js";
import { MOVES, pictureOf } from "./seat.js";

/** @typedef {Record<string, any>} Reply */
/** @typedef {Record<string, (now: Reply) => Node[]>} Pages */

const TILE = 64, MOST_IN_A_LIST = 120;

export class Screen {
  /** @param {Record<string, string>} words the texts of the page @param {(what: Reply) => void} send tells the server
   * @param {Pages} pages what is shown besides rooms, by what the server calls it
   * @param {() => void} [onward] goes on from an episode that has ended */
  constructor(words, send, pages, onward) {
    this.words = words;
    this.send = send;
    this.onward = onward ?? (() => this.go());
    /** @type {Pages} */ this.pages = { room: (now) => this.room(now), ...pages };
    /** @type {Reply} */ this.now = {};
    /** @type {string[]} */ this.actions = [];
    /** @type {string[]} */ this.phrases = [];
    this.shown = 0;
    this.offline = false;
    this.title = make("h1", { tabindex: -1 }, words.title);
    this.state = make("output", { class: "quiet", "aria-live": "polite" });
    this.message = make("p", { class: "message", role: "status" });
    this.body = make("main");
    this.root = make("div", { class: "study" }, make("header", {}, this.title, this.state), this.message, this.body);
    this.canvas = make("canvas", { role: "img", "aria-label": words.sees });
    this.seen = make("pre", { class: "seen", "aria-live": "polite" });
    this.heard = make("ol", { class: "lines", tabindex: 0, "aria-live": "polite", "aria-label": words.heard });
    /** @type {string[]} */ this.listed = []; // the lines among `heard`, each with its step
    this.told = make("p", { class: "quiet" });
    this.moves = make("div", { class: "moves", role: "group", "aria-label": words.movements });
    this.speech = make("form", { class: "say", onsubmit: (/** @type {Event} */ event) => this.speak(event) });
    this.buttons = make("div", { class: "buttons" });
    this.keys = make("p", { class: "quiet" }, words.keys);
    addEventListener("keydown", (event) => this.key(event));
  }

  /** A text of the page with its values. @param {string} name @param {Reply} values */
  say(name, values = {}) {
    return this.words[name].replace(/\{(\w+)\}/g, (_, key) => String(values[key]));
  }

  /** @param {string} text @param {string} kind */
  tell(text, kind = "") {
    this.message.textContent = text;
    this.message.className = `message ${kind}`;
  }

  /** Say that the connection was lost, and take nothing until the server shows something again. @param {string} [why] */
  lose(why) {
    this.offline = true;
    this.root.classList.add("offline");
    this.tell(this.words[why ?? "offline"]);
  }

  /** Show nothing until the server shows something. */
  clear() {
    this.now = {};
    clearInterval(this.counting);
    this.body.replaceChildren();
    this.tell("");
  }

  /** @param {Reply} now what the server says that is to be seen */
  show(now) {
    const before = this.now;
    this.now = now;
    this.offline = false;
    this.root.classList.remove("offline");
    if (now.actions) [this.actions, this.phrases] = [now.actions, now.phrases];
    this.tell(now.notice ? this.words[now.notice] : "");
    const same = before.do === now.do && (now.do === "play" || before.on === now.on);
    if (now.do === "play") this.play(now, same);
    else if (!same || now.do === "room" || now.do === "consent") this.page(now);
    if (!same) this.title.focus();
  }

  /** @param {Reply} now */
  page(now) {
    clearInterval(this.counting);
    this.title.textContent = this.words.title;
    this.state.textContent = "";
    this.body.setAttribute("aria-live", "polite");
    this.body.replaceChildren(...this.pages[now.do](now));
  }

  /** @param {Reply} now */
  room(now) {
    const until = performance.now() + now.seconds * 1000, left = make("output");
    const count = () => { left.textContent = this.say("room_left", { number: Math.max(0, Math.ceil((until - performance.now()) / 1000)) }); };
    count();
    this.counting = setInterval(count, 1000);
    return [make("p", { class: "text" }, this.words.room), left];
  }

  go() {
    this.send({ do: "go", on: this.now.on });
  }

  // -- rooms ------------------------------------------------------------------------------------------------

  /** @param {Reply} now @param {boolean} same */
  play(now, same) {
    const numbers = { number: now.episode, of: now.episodes };
    this.title.textContent = this.say(now.practice ? "practice" : "episode", numbers);
    this.state.textContent = this.say("step", { number: now.t });
    this.told.textContent = now.told;
    if (!same || now.actions) {
      this.body.setAttribute("aria-live", "off"); // but for what is seen and heard
      this.body.replaceChildren(this.told, this.canvas, this.moves, this.speech, this.buttons, panel(this.words.heard, "transcript", this.heard), this.seen, this.keys);
      this.choices();
    }
    this.canvas.hidden = !now.view;
    this.seen.hidden = !now.seen;
    if (now.view) drawPicture(this.canvas, pictureOf(now.view), { tile: TILE });
    this.seen.textContent = now.seen ?? "";
    this.hear(now);
    this.moves.hidden = this.speech.hidden = Boolean(now.ended);
    this.buttons.replaceChildren();
    if (now.ended) this.ended(now);
    else if (now.waiting) this.tell(this.words.waiting);
    for (const one of this.body.querySelectorAll(".moves button, .say button")) /** @type {HTMLButtonElement} */ (one).disabled = Boolean(now.waiting);
    requestAnimationFrame(() => { this.shown = performance.now(); });
  }

  /** List what was heard. What is listed already stays, so that a screen reader reads new lines alone. @param {Reply} now */
  hear(now) {
    const lines = now.heard.length ? now.heard : [["", this.words.nothing_heard]], keys = lines.map(String);
    while (this.listed.some((key, place) => key !== keys[place])) {
      this.heard.firstChild?.remove();
      this.listed.shift();
    }
    this.heard.append(...lines.slice(this.listed.length).map((/** @type {[number, string]} */ [, line]) => make("li", {}, line)));
    this.listed = keys;
    for (const [place, item] of [...this.heard.children].entries()) item.className = !now.heard.length ? "quiet" : lines[place][0] === now.t ? "now" : "";
    this.heard.scrollTop = this.heard.scrollHeight;
  }

  /** @param {Reply} now */
  ended(now) {
    this.tell(now.success === null ? this.words.over : now.success ? this.words.success : this.words.failure, now.success === null ? "" : now.success ? "good" : "bad");
    if (now.waiting) this.buttons.replaceChildren(make("p", {}, this.words.ready));
    else {
      const button = make("button", { class: "main", onclick: () => this.onward() }, this.words.next);
      this.buttons.replaceChildren(button);
      button.focus();
    }
  }

  /** The buttons for movements, and what can be said. */
  choices() {
    const moves = [...this.actions, "none"];
    this.moves.replaceChildren(...moves.map((word) => make("button", { type: "button", "data-move": word, onclick: () => this.act(word) }, this.words[word] ?? word)));
    const first = make("option", { value: "" }, this.words.say_first);
    this.phrase = this.phrases.length <= MOST_IN_A_LIST
      ? make("select", { "aria-label": this.words.say_what }, first, ...this.phrases.map((said) => make("option", { value: said }, said)))
      : make("input", { type: "text", list: "phrases", "aria-label": this.words.say_what });
    this.together = make("input", { type: "checkbox" });
    const list = this.phrase.tagName === "INPUT" ? [make("datalist", { id: "phrases" }, ...this.phrases.map((said) => make("option", { value: said })))] : [];
    this.speech.replaceChildren(...(this.phrases.length ? [this.phrase, ...list, make("button", {}, this.words.say), make("label", {}, this.together, this.words.with)] : []));
  }

  /** Move, and say what is chosen if it is to be said with a movement. @param {string} move */
  act(move) {
    const said = this.together?.checked ? this.phrase?.value || null : null;
    this.choose(move === "none" ? null : move, said);
  }

  /** @param {Event} event */
  speak(event) {
    event.preventDefault();
    if (this.phrase?.value) this.choose(null, this.phrase.value);
  }

  /** @param {string | null} movement @param {string | null} said */
  choose(movement, said) {
    if (this.now.do !== "play" || this.now.ended || this.now.waiting || this.offline) return;
    this.send({ do: "act", on: this.now.on, movement, said, shown: this.shown, acted: performance.now() });
    if (said && this.together) {
      this.together.checked = false;
      if (this.phrase) this.phrase.value = "";
    }
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { key } = event, target = event.composedPath()[0];
    if (!this.root.isConnected || this.now.do !== "play" || event.ctrlKey || event.metaKey || event.altKey || !(target instanceof HTMLElement)) return;
    if (target.matches("select, input")) {
      if (key === "Escape") target.blur();
      return;
    }
    if (target.matches("button, a") && [" ", "Enter"].includes(key)) return;
    const move = MOVES[key.length === 1 ? key.toLowerCase() : key];
    if (key === "/") {
      event.preventDefault();
      this.phrase?.focus();
    } else if (move && (move === "none" || this.actions.includes(move))) {
      event.preventDefault();
      this.act(move);
    }
  }
}
