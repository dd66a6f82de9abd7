// @ts-check
/** A participant of a study on a page of somebody else: the connection, what was played before, and what is shown. */
import { Connection } from "./connection.js";
import { make } from "./dom.js";
import { Screen } from "./screen.js";
import pages from "./pages.css";
import study from "./study.css";
import { en } from "./words.json";

/** @typedef {Record<string, any>} Reply */
/** @typedef {{ patience: number, finish: (data: Reply) => void, shown?: () => void }} Trial patience: milliseconds that
 * the server may be silent; finish takes the data; shown is told that there is something new to react to */

const HOST = ":host { color-scheme: inherit; display: block; width: min(46rem, 95vw); text-align: left; background: var(--paper); color: var(--ink); }";

export class Session {
  /** @param {string} server @param {{ id: string | null, simulated: boolean }} hello who takes part */
  constructor(server, hello) {
    this.server = server;
    this.hello = hello;
    this.words = en;
    this.key = `socialai ${server} ${hello.id ?? ""}`;
    /** What this window knows. @type {{ code: string | null, episodes: Reply[] }} */ this.known = this.remembered();
    /** Episodes that this page has gone on from. */ this.count = 0;
    /** Those that were gone on from before it was loaded. @type {number | undefined} */ this.done = undefined;
    /** @type {Reply | undefined} */ this.now = undefined;
    /** @type {Screen | undefined} */ this.screen = undefined;
    /** @type {Connection | undefined} */ this.connection = undefined;
    /** @type {Trial | undefined} */ this.present = undefined;
    /** @type {ReturnType<typeof setTimeout> | undefined} */ this.timer = undefined;
    this.host = make("div", { class: "jspsych-socialai" });
    this.shadow = this.host.attachShadow({ mode: "open" });
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(pages.replace(":root", ":host") + study + HOST);
    this.shadow.adoptedStyleSheets = [sheet];
  }

  /** The trial that is shown; one that the experiment has ended by itself is none. */
  get trial() {
    return this.host.isConnected ? this.present : undefined;
  }

  remembered() {
    try {
      return JSON.parse(sessionStorage.getItem(this.key) ?? "");
    } catch {
      return { code: null, episodes: [] };
    }
  }

  remember() {
    try {
      sessionStorage.setItem(this.key, JSON.stringify(this.known));
    } catch {} // then a page that is loaded again has what the server says alone
  }

  /** Let the participant play what comes next. @param {HTMLElement} display @param {Trial} trial */
  begin(display, trial) {
    this.place(display, trial);
    if (this.connection && this.screen?.offline) return this.wait();
    this.screen?.clear();
    if (this.connection) return this.proceed();
    this.shadow.replaceChildren(make("p", { role: "status" }, this.words.connecting));
    this.wait();
    const address = new URL("/embed", this.server);
    address.protocol = address.protocol.replace("http", "ws");
    const greeting = () => ({ do: "join", ...this.hello, code: this.known.code, consented: true });
    try {
      this.connection = new Connection(address.href, (said) => this.hear(said), (why) => this.lose(why), greeting);
    } catch (error) {
      this.fail("server", `${this.server}: ${/** @type {Error} */ (error).message}`); // such as from https to http
    }
  }

  /** @param {HTMLElement} display @param {Trial} trial */
  place(display, trial) {
    this.present = trial;
    display.replaceChildren(this.host);
  }

  /** End the trial unless the server answers in time. */
  wait() {
    const tell = () => this.fail("silent", `${this.words.silent} (${this.server})`);
    if (this.trial) this.timer ??= setTimeout(tell, this.trial.patience);
  }

  /** @param {string | undefined} why it is not opened again */
  lose(why) {
    if (why) return this.fail(why, this.words[/** @type {"unknown"} */ (why)]);
    this.screen?.lose();
    this.wait();
  }

  /** @param {Reply} said */
  hear(said) {
    clearTimeout(this.timer);
    this.timer = undefined;
    if (said.do === "refused") return this.fail(said.why, said.say);
    if (said.do === "consent") return this.fail("full_disk", this.words.full_disk); // that they agreed was not stored
    if (said.do !== "joined") {
      this.now = said;
      return this.proceed();
    }
    this.known.code = said.code;
    this.remember();
    this.done ??= said.done;
    this.words = said.words;
    this.host.lang = said.language;
    this.screen ??= new Screen(said.words, (what) => this.connection?.send(what), {}, () => this.onward());
    this.shadow.replaceChildren(this.screen.root);
  }

  /** Show what there is to see, or end the trial where there is nothing to play in it. */
  proceed() {
    const { now, screen, trial } = this, known = this.known.episodes[this.count];
    if (!now || !screen) return;
    if (trial && (known || this.count < (this.done ?? 0))) {
      this.count += 1;
      this.end({ status: "before", ...(known ?? { episode: this.count, more: true }) });
    } else if (now.record?.episode <= this.count && !now.waiting) {
      if (!trial && now.record.more) return; // the next trial begins the next episode
      screen.clear();
      screen.send({ do: "go", on: now.on });
    } else if (now.do === "end") {
      this.hangUp();
      this.end({ status: "over" });
    } else {
      screen.show(now);
      trial?.shown?.();
    }
  }

  /** Go on from an episode that has ended. */
  onward() {
    const record = this.now?.record;
    if (!this.trial || !record) return;
    this.count = record.episode;
    this.known.episodes[record.episode - 1] = record;
    this.remember();
    this.end({ status: "played", ...record });
    this.proceed();
  }

  /** End the trial. @param {Reply} data */
  end(data) {
    const { trial } = this;
    clearTimeout(this.timer);
    this.present = this.timer = undefined;
    trial?.finish(data);
  }

  hangUp() {
    clearTimeout(this.timer);
    this.connection?.close();
    this.connection = this.now = this.timer = undefined;
  }

  /** Say why there is nothing to play; the next trial tries again. @param {string} why @param {string} message */
  fail(why, message) {
    this.hangUp();
    if (why === "forgotten") {
      this.known = { code: null, episodes: [] };
      this.remember();
      [this.count, this.done] = [0, undefined];
    }
    if (!this.trial) return;
    console.error(`jspsych-socialai: ${message}`);
    const onclick = () => this.end({ status: "failed", error: why, message });
    const button = make("button", { class: "main", onclick }, this.words.next);
    this.shadow.replaceChildren(make("div", { class: "study" }, make("p", { class: "message bad", role: "alert" }, message), make("div", { class: "buttons" }, button)));
    button.focus();
    this.trial.shown?.();
  }
}
