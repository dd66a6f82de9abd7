// @ts-check
/** The page of a person who was invited to a seat of a game that goes on in somebody else's window. */
import { make, panel } from "./dom.js";
import { drawPicture } from "./room.js";
import { MOVES, observed, pictureOf } from "./seat.js";

/** @typedef {Record<string, any>} Reply */

const TRY_EVERY = 1000, TILE = 64;
const LOST = "the connection was lost; this page goes on when it is there again";

class Guest {
  constructor() {
    this.number = 0;
    /** @type {Reply | null} what is seen now */ this.now = null;
    this.title = make("h1", {}, "…");
    this.told = make("p");
    this.canvas = make("canvas", { role: "img" });
    this.seen = make("pre", { "aria-live": "polite" });
    this.moves = make("div", { class: "moves", role: "group", "aria-label": "movements" });
    this.sentences = make("datalist", { id: "sentences" });
    this.typed = make("input", { list: "sentences", placeholder: "type what to do and say", "aria-label": "what to do or say" });
    this.message = make("p", { class: "message", role: "status" });
    this.state = make("output", { class: "quiet", "aria-live": "polite" });
    this.heard = make("ol", { class: "lines", tabindex: 0, "aria-label": "what was heard" });
    const say = make("form", { class: "controls say", onsubmit: (/** @type {Event} */ event) => this.submit(event) }, this.typed, this.sentences, make("button", {}, "Do"));
    const keys = make("p", { class: "quiet" }, "Arrows or W A D move, T toggles, P picks up, O drops, X is done, space stands still; / or Enter types a line. A step is taken when everybody has chosen.");
    this.seat = panel("", "seat", this.told, this.canvas, this.seen);
    document.body.replaceChildren(make("div", { class: "guest" }, make("header", {}, this.title, this.state), this.seat, this.message, this.moves, say, panel("Heard", "transcript", this.heard), keys));
    addEventListener("keydown", (event) => this.key(event));
    this.connect();
  }

  connect() {
    const code = new URLSearchParams(location.search).get("code") ?? "";
    this.socket = new WebSocket(`ws://${location.host}/seat?code=${encodeURIComponent(code)}`);
    this.socket.onmessage = (event) => this.hear(JSON.parse(event.data));
    this.socket.onclose = (event) => {
      document.body.classList.add("offline");
      this.state.textContent = "";
      this.tell(event.reason || LOST);
      setTimeout(() => this.connect(), TRY_EVERY);
    };
  }

  /** @param {Reply} said */
  hear(said) {
    if (said.refused) this.tell(said.refused);
    else if (said.do === "glance") this.show(said);
    else if (said.do === "choose") this.tell("");
    else if (said.do === "guests") this.who = said;
    this.wait();
  }

  /** Say who is waited for. */
  wait() {
    const { who, now } = this;
    if (!now || !who) return;
    const others = who.own || Object.values(who.chosen).some(Boolean);
    this.state.textContent = now.success !== null ? "" : who.chosen[now.seat] ? "you have chosen; waiting for the others" : others ? "the others wait for you" : "choose what to do";
  }

  /** @param {Reply} now */
  show(now) {
    document.body.classList.remove("offline");
    this.now = now;
    document.title = this.title.textContent = `You are ${now.name}`;
    /** @type {HTMLElement} */ (this.seat.firstElementChild).textContent = `Step ${now.t}`;
    this.told.textContent = now.told;
    this.seen.textContent = now.seen;
    drawPicture(this.canvas, observed(pictureOf(now.view), now.facing, now.compass), { tile: TILE });
    this.canvas.setAttribute("aria-label", `what ${now.name} sees, 7 by 7 cells; who sees it looks up`);
    this.tell(now.success === null ? "" : now.success ? "✓ success" : "✗ no success");
    this.message.className = `message ${now.success === null ? "" : now.success ? "good" : "bad"}`;
    const moves = [...now.actions, "none"];
    if (moves.join() !== [...this.moves.children].map((one) => one.textContent).join()) // buttons that stay keep the focus
      this.moves.replaceChildren(...moves.map((word) => make("button", { onclick: () => this.choose({ movement: word === "none" ? null : word }) }, word)));
    this.sentences.replaceChildren(...now.phrases.map((/** @type {string} */ said) => make("option", { value: said })));
    this.heard.replaceChildren(...now.heard.map((/** @type {string} */ line) => make("li", {}, line)));
  }

  /** @param {Reply} what */
  choose(what) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ id: ++this.number, do: "choose", ...what }));
  }

  /** @param {Event} event */
  submit(event) {
    event.preventDefault();
    if (this.typed.value.trim()) this.choose({ line: this.typed.value });
    this.typed.value = "";
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { target, key } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || !(target instanceof HTMLElement)) return;
    if (target === this.typed || (target instanceof HTMLButtonElement && [" ", "Enter"].includes(key))) {
      if (key === "Escape") target.blur();
      return;
    }
    const move = MOVES[key.length === 1 ? key.toLowerCase() : key];
    if (!move && key !== "/" && key !== "Enter") return;
    event.preventDefault();
    if (move) this.choose({ movement: move === "none" ? null : move });
    else this.typed.focus();
  }

  /** @param {string} text */
  tell(text) {
    this.message.textContent = text;
  }
}

new Guest();
