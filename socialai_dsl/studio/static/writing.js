// @ts-check
/** The column of the text: the editor, below it what was found of the text, and the handle that makes it wider. */
import { make } from "./dom.js";
import { settings } from "./line.js";

const USUAL = 44, LEAST = 20, MOST = 80, STEP = 2;

/** The column. Its parts below the text are tabs: each has a name, and an element. */
export class Writing {
  /**
   * @param {Record<string, HTMLElement>} tabs by their words
   * @param {...HTMLElement} controls that stand beside the tabs
   */
  constructor(tabs, ...controls) {
    this.pane = make("div", { class: "text" });
    /** @type {Map<string, {tab: HTMLButtonElement, panel: HTMLElement}>} */ this.tabs = new Map();
    for (const [word, content] of Object.entries(tabs)) {
      const id = word.toLowerCase();
      const tab = make("button", { role: "tab", id: `${id}-tab`, "aria-controls": `${id}-panel`, onclick: () => this.choose(word) }, word);
      const panel = make("div", { role: "tabpanel", id: `${id}-panel`, "aria-labelledby": `${id}-tab`, class: "found", tabindex: 0 }, content);
      this.tabs.set(word, { tab, panel });
    }
    const all = [...this.tabs.values()];
    const list = make("div", { role: "tablist", "aria-label": "what was found of the text", onkeydown: (/** @type {KeyboardEvent} */ event) => this.move(event) }, ...all.map(({ tab }) => tab));
    this.root = make("section", { class: "writing", "aria-label": "scenario" }, this.pane,
      make("div", { class: "drawer" }, make("div", { class: "drawer-bar" }, list, ...controls), ...all.map(({ panel }) => panel)));
    this.handle = make("div", { class: "handle", role: "separator", tabindex: 0, "aria-orientation": "vertical", "aria-label": "width of the text",
      "aria-valuemin": LEAST, "aria-valuemax": MOST, title: "drag, or press the left and right arrow keys, to make the text wider or narrower; twice for the usual width" });
    this.chosen = "";
    this.choose([...this.tabs.keys()][0]);
    this.widen(Number(settings.get("width", String(USUAL))) || USUAL);
    this.listen();
  }

  /** Show a tab. @param {string} word */
  choose(word) {
    this.chosen = word;
    for (const [name, { tab, panel }] of this.tabs) {
      tab.setAttribute("aria-selected", String(name === word));
      tab.tabIndex = name === word ? 0 : -1;
      panel.hidden = name !== word;
    }
  }

  /** Say beside a tab's word how it stands. @param {string} word @param {string} said @param {string} [look] */
  count(word, said, look = "") {
    const { tab } = /** @type {{tab: HTMLButtonElement}} */ (this.tabs.get(word));
    tab.replaceChildren(word, said ? make("small", { class: look }, ` ${said}`) : "");
  }

  /** The arrow keys lead from tab to tab. @param {KeyboardEvent} event */
  move(event) {
    const words = [...this.tabs.keys()], at = words.indexOf(this.chosen);
    const next = { ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: words.length - 1 }[event.key];
    if (next === undefined) return;
    event.preventDefault();
    this.choose(words[(next + words.length) % words.length]);
    this.tabs.get(this.chosen)?.tab.focus();
  }

  /** Give the text this share of the window. @param {number} share in per cent */
  widen(share) {
    this.share = Math.round(10 * Math.max(LEAST, Math.min(MOST, share))) / 10;
    document.documentElement.style.setProperty("--text", `${this.share}vw`);
    this.handle.setAttribute("aria-valuenow", String(Math.round(this.share)));
    settings.set("width", String(this.share));
    dispatchEvent(new Event("resize"));
  }

  listen() {
    const { handle } = this;
    /** Where the column really ends, which is not where it was to end if the rest of the page needs the room. */
    const shown = () => (100 * this.root.getBoundingClientRect().width) / innerWidth;
    handle.addEventListener("keydown", (event) => {
      const share = { ArrowLeft: shown() - STEP, ArrowRight: shown() + STEP, Home: LEAST, End: MOST, Enter: USUAL }[event.key];
      if (share === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.widen(share);
    });
    handle.addEventListener("dblclick", () => this.widen(USUAL));
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      event.preventDefault();
      handle.focus();
    });
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      this.widen((100 * (event.clientX - this.root.getBoundingClientRect().left)) / innerWidth);
    });
  }
}
