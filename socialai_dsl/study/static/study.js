// @ts-check
/** The page of a participant: it shows what the server says, and says what was chosen; the server decides. */
import { Connection } from "./connection.js";
import { make } from "./dom.js";
import { Screen } from "./screen.js";

/** @typedef {Record<string, any>} Reply */

/** @type {Record<string, string>} */ const words = JSON.parse(document.body.dataset.words ?? "{}");

class Study {
  constructor() {
    const scheme = location.protocol === "https:" ? "wss" : "ws", code = location.pathname.split("/").pop();
    /** @type {import("./screen.js").Pages} */
    const pages = { consent: (now) => this.consent(now), page: (now) => this.read(now), asked: (now) => this.asked(now), end: (now) => this.end(now) };
    /** @type {Screen} */ this.screen = new Screen(words, (what) => this.connection.send(what), pages);
    document.body.replaceChildren(this.screen.root);
    this.connection = new Connection(`${scheme}://${location.host}/seat/${code}`, (now) => this.screen.show(now), (why) => this.screen.lose(why));
  }

  /** @param {Reply} now */
  consent(now) {
    if (now.full) return [make("p", { class: "text" }, words.full)];
    return [
      text(now.html),
      make("div", { class: "buttons" },
        make("button", { class: "main", onclick: () => this.screen.go() }, words.agree),
        make("button", { onclick: () => this.connection.send({ do: "decline", on: now.on }) }, words.decline)),
    ];
  }

  /** @param {Reply} now */
  read(now) {
    this.screen.state.textContent = this.screen.say("page", now);
    return [text(now.html), make("div", { class: "buttons" }, make("button", { class: "main", onclick: () => this.screen.go() }, words.next))];
  }

  /** @param {Reply} now */
  end(now) {
    if (now.declined) return [make("p", { class: "text" }, words.declined)];
    return [
      make("p", { class: "text" }, words.thanks),
      ...(now.html ? [text(now.html)] : []),
      ...(now.paid ? [make("p", {}, this.screen.say("paid", now.paid))] : []),
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
      else this.connection.send({ do: "answers", on: now.on, answers });
    };
    return [form];
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
