// @ts-check
/** The page of a participant: it shows what the server says, and says what was chosen; the server decides. */
import { make, panel } from "./dom.js";
import { drawPicture } from "./room.js";
import { MOVES, pictureOf } from "./seat.js";

/** @typedef {Record<string, any>} Reply */

const TRY_EVERY = 1000, BEAT_EVERY = 2000, TILE = 64, MOST_IN_A_LIST = 120;
const TAKEN = 4409, UNKNOWN = 4404, FAST = 4429;
/** @type {Record<string, string>} */ const words = JSON.parse(document.body.dataset.words ?? "{}");

/** A text of the page with its values. @param {string} name @param {Reply} values */
const say = (name, values = {}) => words[name].replace(/\{(\w+)\}/g, (_, key) => String(values[key]));

class Study {
  constructor() {
    /** @type {Reply} */ this.now = {};
    /** @type {string[]} */ this.actions = [];
    /** @type {string[]} */ this.phrases = [];
    this.shown = 0;
    this.title = make("h1", { tabindex: -1 }, words.title);
    this.state = make("output", { class: "quiet", "aria-live": "polite" });
    this.message = make("p", { class: "message", role: "status" });
    this.body = make("main");
    document.body.replaceChildren(make("div", { class: "study" }, make("header", {}, this.title, this.state), this.message, this.body));
    this.canvas = make("canvas", { role: "img", "aria-label": words.sees });
    this.seen = make("pre", { class: "seen", "aria-live": "polite" });
    this.heard = make("ol", { class: "lines", tabindex: 0, "aria-live": "polite", "aria-label": words.heard });
    this.told = make("p", { class: "quiet" });
    this.moves = make("div", { class: "moves", role: "group", "aria-label": words.movements });
    this.speech = make("form", { class: "say", onsubmit: (/** @type {Event} */ event) => this.speak(event) });
    this.onward = make("div", { class: "buttons" });
    this.keys = make("p", { class: "quiet" }, words.keys);
    addEventListener("keydown", (event) => this.key(event));
    setInterval(() => this.send({ do: "beat" }), BEAT_EVERY);
    this.connect();
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws", code = location.pathname.split("/").pop();
    this.socket = new WebSocket(`${scheme}://${location.host}/seat/${code}`);
    this.socket.onmessage = (event) => this.show(JSON.parse(event.data));
    this.socket.onclose = ({ code: why }) => {
      document.body.classList.add("offline");
      const said = { [TAKEN]: "elsewhere", [UNKNOWN]: "unknown", [FAST]: "fast" }[why];
      this.tell(words[said ?? "offline"]);
      if (!said) setTimeout(() => this.connect(), TRY_EVERY);
    };
  }

  /** @param {Reply} what */
  send(what) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(what));
  }

  /** @param {string} text @param {string} kind */
  tell(text, kind = "") {
    this.message.textContent = text;
    this.message.className = `message ${kind}`;
  }

  /** @param {Reply} now */
  show(now) {
    const before = this.now;
    this.now = now;
    document.body.classList.remove("offline");
    document.body.dataset.screen = now.on;
    if (now.actions) [this.actions, this.phrases] = [now.actions, now.phrases];
    this.tell(now.notice ? words[now.notice] : "");
    const same = before.do === now.do && (now.do === "play" || before.on === now.on);
    if (now.do === "play") this.play(now, same);
    else if (!same || now.do === "room" || now.do === "consent") this.page(now);
    if (!same) this.title.focus();
  }

  // -- pages ------------------------------------------------------------------------------------------------

  /** @param {Reply} now */
  page(now) {
    clearInterval(this.counting);
    this.title.textContent = words.title;
    this.state.textContent = "";
    const fill = { consent: () => this.consent(now), page: () => this.read(now), asked: () => this.asked(now), room: () => this.room(now), end: () => this.end(now) }[/** @type {"end"} */ (now.do)];
    this.body.replaceChildren(...fill());
  }

  /** @param {Reply} now */
  consent(now) {
    if (now.full) return [make("p", { class: "text" }, words.full)];
    return [
      text(now.html),
      make("div", { class: "buttons" },
        make("button", { class: "main", onclick: () => this.go() }, words.agree),
        make("button", { onclick: () => this.send({ do: "decline", on: this.now.on }) }, words.decline)),
    ];
  }

  /** @param {Reply} now */
  read(now) {
    this.state.textContent = say("page", now);
    return [text(now.html), make("div", { class: "buttons" }, make("button", { class: "main", onclick: () => this.go() }, words.next))];
  }

  /** @param {Reply} now */
  room(now) {
    const until = performance.now() + now.seconds * 1000, left = make("output");
    const count = () => { left.textContent = say("room_left", { number: Math.max(0, Math.ceil((until - performance.now()) / 1000)) }); };
    count();
    this.counting = setInterval(count, 1000);
    return [make("p", { class: "text" }, words.room), left];
  }

  /** @param {Reply} now */
  end(now) {
    if (now.declined) return [make("p", { class: "text" }, words.declined)];
    return [
      make("p", { class: "text" }, words.thanks),
      ...(now.html ? [text(now.html)] : []),
      ...(now.paid ? [make("p", {}, say("paid", now.paid))] : []),
      ...(now.code ? [make("p", {}, words.code), make("p", { class: "code" }, now.code)] : []),
      ...(now.link ? [make("p", {}, make("a", { href: now.link, rel: "noreferrer" }, words.go))] : []),
    ];
  }

  /** @param {Reply} now */
  asked(now) {
    const form = make("form", {}, ...now.questions.map((/** @type {Reply} */ one) => question(one)),
      make("div", { class: "buttons" }, make("button", { class: "main" }, words.next)));
    form.noValidate = true;
    form.onsubmit = (event) => {
      event.preventDefault();
      const given = new FormData(form);
      /** @type {Reply} */ const answers = {};
      let wrong = null;
      for (const one of now.questions) {
        const value = String(given.get(one.id) ?? "").trim(), field = /** @type {HTMLElement} */ (form.querySelector(`[data-id="${one.id}"]`));
        const lacks = !value && !one.optional;
        /** @type {HTMLElement} */ (field.querySelector(".wrong")).textContent = lacks ? words.answer : "";
        if (lacks) wrong ??= field;
        if (value) answers[one.id] = one.kind === "scale" ? Number(value) : value;
      }
      if (wrong) /** @type {HTMLElement} */ (wrong.querySelector("input, textarea, select")).focus();
      else this.send({ do: "answers", on: this.now.on, answers });
    };
    return [form];
  }

  go() {
    this.send({ do: "go", on: this.now.on });
  }

  // -- rooms ------------------------------------------------------------------------------------------------

  /** @param {Reply} now @param {boolean} same */
  play(now, same) {
    const numbers = { number: now.episode, of: now.episodes };
    this.title.textContent = say(now.practice ? "practice" : "episode", numbers);
    this.state.textContent = say("step", { number: now.t });
    this.told.textContent = now.told;
    if (!same || now.actions) {
      this.body.replaceChildren(this.told, this.canvas, this.moves, this.speech, this.onward, panel(words.heard, "transcript", this.heard), this.seen, this.keys);
      this.choices();
    }
    this.canvas.hidden = !now.view;
    this.seen.hidden = !now.seen;
    if (now.view) drawPicture(this.canvas, pictureOf(now.view), { tile: TILE });
    this.seen.textContent = now.seen ?? "";
    const lines = now.heard.map((/** @type {[number, string]} */ [step, line]) => make("li", { class: step === now.t ? "now" : "" }, line));
    this.heard.replaceChildren(...(lines.length ? lines : [make("li", { class: "quiet" }, words.nothing_heard)]));
    this.heard.scrollTop = this.heard.scrollHeight;
    this.moves.hidden = this.speech.hidden = Boolean(now.ended);
    this.onward.replaceChildren();
    if (now.ended) this.ended(now);
    else if (now.waiting) this.tell(words.waiting);
    for (const one of this.body.querySelectorAll(".moves button, .say button")) /** @type {HTMLButtonElement} */ (one).disabled = Boolean(now.waiting);
    requestAnimationFrame(() => { this.shown = performance.now(); });
  }

  /** @param {Reply} now */
  ended(now) {
    this.tell(now.success === null ? words.over : now.success ? words.success : words.failure, now.success === null ? "" : now.success ? "good" : "bad");
    if (now.waiting) this.onward.replaceChildren(make("p", {}, words.ready));
    else {
      const button = make("button", { class: "main", onclick: () => this.go() }, words.next);
      this.onward.replaceChildren(button);
      button.focus();
    }
  }

  /** The buttons for movements, and what can be said. */
  choices() {
    const moves = [...this.actions, "none"];
    this.moves.replaceChildren(...moves.map((word) => make("button", { type: "button", "data-move": word, onclick: () => this.act(word) }, words[word] ?? word)));
    const first = make("option", { value: "" }, words.say_first);
    this.phrase = this.phrases.length <= MOST_IN_A_LIST
      ? make("select", { "aria-label": words.say_what }, first, ...this.phrases.map((said) => make("option", { value: said }, said)))
      : make("input", { type: "text", list: "phrases", "aria-label": words.say_what });
    this.together = make("input", { type: "checkbox" });
    const list = this.phrase.tagName === "INPUT" ? [make("datalist", { id: "phrases" }, ...this.phrases.map((said) => make("option", { value: said })))] : [];
    this.speech.replaceChildren(...(this.phrases.length ? [this.phrase, ...list, make("button", {}, words.say), make("label", {}, this.together, words.with)] : []));
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
    if (this.now.do !== "play" || this.now.ended || this.now.waiting || document.body.classList.contains("offline")) return;
    this.send({ do: "act", on: this.now.on, movement, said, shown: this.shown, acted: performance.now() });
    if (said && this.together) {
      this.together.checked = false;
      if (this.phrase) this.phrase.value = "";
    }
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { target, key } = event;
    if (this.now.do !== "play" || event.ctrlKey || event.metaKey || event.altKey || !(target instanceof HTMLElement)) return;
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

/** A text that the server has made of Markdown, in which tags are shown as they are written. @param {string} html */
function text(html) {
  const shown = make("div", { class: "text" });
  shown.innerHTML = html;
  for (const link of shown.querySelectorAll("a")) [link.target, link.rel] = ["_blank", "noreferrer"];
  return shown;
}

/** A question with what it is answered in. @param {Reply} one */
function question(one) {
  const wrong = make("p", { class: "wrong", role: "alert" });
  const radio = (/** @type {string} */ value) => make("label", {}, make("input", { type: "radio", name: one.id, value }), value);
  let field;
  if (one.kind === "scale") {
    const numbers = Array.from({ length: one.to - one.from + 1 }, (_, place) => String(one.from + place)), [low, high] = one.ends ?? ["", ""];
    field = make("div", { class: "scale" }, make("span", {}, low), ...numbers.map(radio), make("span", {}, high));
  } else if (one.kind === "choice") field = make("div", { class: "options" }, ...one.options.map(radio));
  else field = make("textarea", { name: one.id, rows: 4, maxlength: 10000, "aria-label": one.ask });
  return make("fieldset", { "data-id": one.id }, make("legend", {}, one.ask), field, wrong);
}

new Study();
