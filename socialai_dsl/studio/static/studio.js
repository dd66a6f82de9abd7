// @ts-check
/** The studio: the text of a scenario on the left, its room, its game and its reasons on the right. */
import { make } from "./dom.js";
import { Editor } from "./editor.js";
import { Cast, Mind, Rules, Seats, Stage, Transcript, legend, outcomeInWords } from "./panels.js";
import { claimItems, findingItems, marked, page, roomInWords, testItems, verdictOf } from "./found.js";
import { Line, address, settings } from "./line.js";
import { Counts, Seat, Views } from "./parts.js";
import { MOVES } from "./seat.js";
import { Episode, slotsOf } from "./trace.js";
import { Writing } from "./writing.js";

/** @typedef {import("./line.js").Reply} Reply */

const DRAW_AFTER = 30, KEEP_AFTER = 500, STEP_EVERY = 450, TELL_AFTER = 1000;
const FIRST_ROOM = "drawing the room; the first one on a machine waits 20 to 70 seconds, while the engine is compiled";

class Studio {
  constructor() {
    const { root = "", open = "" } = document.body.dataset;
    this.first = open;
    this.name = "";
    /** @type {string | null} */ this.digest = null;
    this.saved = "";
    this.dirty = false;
    /** What is played: the room, and variants and parameters behind the scenario's name.
     * @type {{room: Record<string, any>, variant: string}} */
    this.place = { room: { seed: 0 }, variant: "" };
    /** @type {string[]} seats to which there are links, also after this window was loaded again */ this.invited = settings.ofWindow("invited");
    /** @type {number | null} how long those wait who have chosen */ this.seconds = 60;
    /** @type {Record<string, string>} who has the other seats in the episode that is shown */ this.casting = {};
    this.length = 0;
    /** @type {Episode | null} */ this.episode = null;
    /** The file whose room that is. */ this.placedIn = "";
    /** @type {ReturnType<typeof setTimeout> | undefined} */ this.timer = undefined;
    /** @type {Record<string, ReturnType<typeof setTimeout>>} */ this.later = {};
    this.drawing = false;
    this.again = false;
    this.gazing = false;
    /** @type {Episode | null} the episode of which it is known what a member of the cast sees */ this.gazed = null;

    const goTo = (/** @type {string} */ at) => this.editorAt(at);
    /** @type {import("./found.js").Ways} */
    this.ways = {
      goTo: ({ file, line, column }) => (file ? this.editorAt(`${file}:${line}`, column) : this.editor.goTo(line, column)),
      explain: (code) => this.explain(code),
      show: (shown) => this.reveal(shown),
    };
    this.stage = new Stage();
    this.counts = new Counts(goTo);
    this.seat = new Seat();
    this.views = new Views(() => this.show());
    const parts = { why: new Rules(goTo), said: new Transcript((step) => this.back(step)), cast: new Cast(), sight: this.views, counts: this.counts, mind: new Mind((step) => this.back(step)), seats: new Seats() };
    this.parts = [this.stage, this.seat, ...Object.values(parts)];
    this.files = make("select", { "aria-label": "scenario", onchange: () => this.openFile(this.files.value) });
    this.state = make("output", { class: "quiet", "aria-live": "polite" });
    /** @type {Reply[]} drafts that no window shows */ this.others = [];
    this.kept = make("button", { onclick: () => this.offerDrafts(), hidden: true });
    this.findings = make("ul", { class: "findings", "aria-label": "findings" });
    this.sound = make("p", { class: "quiet", hidden: true }, "Nothing is wrong in this file.");
    this.message = make("p", { class: "message", role: "status" });
    this.title = make("h1", {}, "studio");
    this.seedField = make("input", { type: "number", min: 0, value: 0, "aria-label": "seed of the room", onchange: () => this.another({ seed: Number(this.seedField.value) }) });
    this.roomField = make("input", { type: "number", min: 0, value: 0, "aria-label": "number of the room", title: "which room of the seed, as checks number them", onchange: () => this.another({ seed: Number(this.seedField.value), index: Number(this.roomField.value) }) });
    this.players = make("select", { "aria-label": "who plays", onchange: () => this.begin() });
    this.own = make("select", { "aria-label": "whose seat", onchange: () => this.begin() });
    this.companions = make("span", { class: "others", role: "group", "aria-label": "who has the other seats" });
    this.here = make("span", { class: "quiet", "aria-live": "polite" });
    /** @type {Reply} who is here, and who has chosen */ this.guests = { chosen: {}, own: false };
    this.company = make("div", { class: "controls company", hidden: true }, make("label", {}, "on the seat of ", this.own), this.companions, this.here);
    /** @type {{names: string[], rivals: string[], seats: {seat: string, script: boolean}[]}} who can play, besides me and chance */
    this.plays = { names: [], rivals: [], seats: [{ seat: "agent", script: false }] };
    this.seated = make("input", { type: "checkbox", onchange: () => this.sit() });
    this.seatedAs = make("span");
    this.watch = make("button", { onclick: () => this.toggleWatch() }, "▶ watch");
    this.count = make("output", {});
    this.thing = make("select", { "aria-label": "thing to move", onchange: () => this.moving(null) });
    this.target = make("div", { class: "target", hidden: true });
    this.stage.sheet.append(this.target);
    /** @type {[number, number] | null} where the chosen thing is about to be put */ this.aim = null;
    this.moves = make("div", { class: "moves", role: "group", "aria-label": "movements" });
    this.template = make("select", { "aria-label": "template", onchange: () => this.offerWords() });
    this.words = make("span", { class: "words" });
    this.sentences = make("datalist", { id: "sentences" });
    this.typed = make("input", { list: "sentences", placeholder: "or type: forward, How are you …", "aria-label": "what to do or say" });
    this.claims = make("div", {}, make("p", { class: "quiet" }, "Nothing was checked yet."));
    this.tests = make("div", {}, make("p", { class: "quiet" }, "No test was played yet."));
    /** @type {Record<string, import("./editor.js").Verdict[]>} what the editor shows behind lines, by tab */ this.verdicts = {};
    this.dialog = make("dialog");
    const testing = make("button", { onclick: () => this.test(), title: "play the tests of this file and of the file beside it" }, "Run the tests");
    const checking = make("button", { onclick: () => this.check(), title: "try in a hundred rooms what the scenario claims; it takes up to 20 seconds" }, "Check the claims");
    this.writing = new Writing({ Findings: make("div", {}, this.findings, this.sound), Claims: this.claims, Tests: this.tests }, checking, testing);
    this.wraps = make("input", { type: "checkbox", checked: settings.get("wraps", "yes") === "yes", onchange: () => this.wrap() });
    this.root = this.layout(parts);
    document.body.replaceChildren(this.root);
    const nonce = document.querySelector("meta[name=style-nonce]")?.getAttribute("content") ?? "";
    this.editor = new Editor(this.writing.pane, { root, language: address("language"), nonce, wraps: this.wraps.checked, changed: () => this.typedText(), save: () => this.save() });
    this.line = new Line((open, why) => this.connected(open, why), (said) => this.hear(said));
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("resize", () => this.show());
    addEventListener("pagehide", () => this.keep());
    addEventListener("beforeunload", (event) => this.dirty && event.preventDefault());
    this.dragging();
  }

  /** @param {Record<string, {root: HTMLElement}>} parts */
  layout(parts) {
    const button = (/** @type {string} */ text, /** @type {() => void} */ act, title = text) => make("button", { onclick: act, title }, text);
    const bar = make("header", {}, this.title, this.files, button("New…", () => this.offer(), "a template, or a copy of a scenario that ships or is in the cookbook"),
      button("Save", () => this.save(), "Ctrl-S"), this.state, this.kept,
      make("label", {}, this.wraps, " wrap lines"),
      make("span", { class: "filler" }),
      button("Replay", () => this.export("replay"), "save this episode as a page of its own"),
      button("◐", () => this.shade(), "light or dark"));
    const game = make("div", { class: "controls" },
      button("⟲ again", () => this.begin(), "begin the episode again (R)"),
      button("Another room", () => this.next(), "the next seed (N)"), make("label", {}, "seed ", this.seedField), make("label", {}, "room ", this.roomField),
      button("◂ step back", () => this.back(this.length - 1), "take the last step back, chance included (U)"), this.count,
      make("label", {}, "plays: ", this.players),
      make("label", { title: "hide the room, the states, the rules and the text" }, this.seated, " ", this.seatedAs), this.watch,
      button("one step", () => this.auto(), "let whoever plays do one step"));
    const say = make("form", { class: "controls say", onsubmit: (/** @type {Event} */ event) => this.submit(event) },
      this.template, this.words, make("button", { type: "button", onclick: () => this.say() }, "Say"), this.typed, this.sentences, make("button", {}, "Do"));
    const arrange = make("div", { class: "controls arrange" }, make("label", {}, "thing ", this.thing),
      button("Move it", () => this.moving(this.placeOf(this.thing.value)), "then by the arrow keys; Enter puts it down, Esc leaves it (M)"),
      button("Layout…", () => this.offerLayout(), "begin episodes in the room as it is now"),
      button("Make a test…", () => this.offerTest(), "keep what was played as a test: what was done, heard and reached"));
    const help = make("details", { class: "panel" }, make("summary", {}, "Keys and colours"),
      make("p", {}, "In the text Tab indents; Esc leaves it. Outside of it: arrows or W A D move, T toggles, P picks up, O drops, X is done, space stands still; / or Enter types a line; U or backspace takes a step back; R begins again, N draws another room, L shows letters for colours. Drag things to other cells, or choose one by M and move it by the arrow keys; that begins the episode again."), legend());
    return make("div", { class: "studio" }, bar,
      this.writing.root, this.writing.handle,
      make("main", {}, this.stage.root, this.message,
        make("div", { class: "below" }, this.seat.root, this.moves, say, game, this.company, arrange, ...[parts.seats, parts.mind, parts.why].map((one) => one.root))),
      make("aside", {}, ...[parts.sight, parts.said, parts.cast, parts.counts].map((one) => one.root), help), this.dialog);
  }

  /** @param {boolean} open @param {string} why */
  async connected(open, why) {
    document.body.classList.toggle("offline", !open);
    this.tell(open ? "looking for scenarios …" : why);
    if (!open) return;
    await this.list();
    this.tell("");
    for (const seat of this.invited) await this.line.ask("invite", { seat, seconds: this.seconds });
    if (this.name) {
      await this.keep();
      this.draw();
    } else await this.openFile(this.first || this.files.value);
  }

  async list() {
    const found = await this.line.ask("list");
    this.offered = found;
    const option = (/** @type {string} */ name) => make("option", { value: name, selected: name === this.name }, name);
    this.files.replaceChildren(...(found.files ?? []).map(option));
    this.offerPlayers();
    if (!found.files?.length) this.offer();
  }

  /** Who can play this scenario; agents that were trained on others come last, and apart. */
  offerPlayers() {
    const { rivals, seats } = this.plays, own = this.own.value || "agent", script = seats.some((one) => one.seat === own && one.script);
    this.players.replaceChildren(...this.options(this.players.value || "me", [["me", "me"], ...(script ? [["script", "script"]] : []), ["random", "random"]],
      own === "agent" ? rivals.map((name) => [`+${name}`, `rival ${name}`]) : []));
  }

  /** Who can be chosen: these, and trained agents.
   * @param {string} chosen @param {string[][]} first value and word @param {string[][]} rivals likewise */
  options(chosen, first, rivals = []) {
    const option = (/** @type {string[]} */ [value, word]) => make("option", { value, selected: isCalled(chosen, value) }, word);
    const trained = (/** @type {Reply} */ { name, scenario }, apart = false) => option([name, apart && scenario && !name.endsWith(scenario) ? `${name} (${scenario})` : name]);
    /** @type {Reply[]} */ const agents = this.offered?.agents ?? [];
    const isOwn = (/** @type {Reply} */ one) => this.plays.names.includes(one.scenario);
    const group = (/** @type {string} */ label, /** @type {HTMLOptionElement[]} */ options) => (options.length ? [make("optgroup", { label }, ...options)] : []);
    return [...first.map(option), ...group("rivals, which lack the skill", rivals.map(option)),
      ...group("trained on it", agents.filter(isOwn).map((one) => trained(one))),
      ...group("trained on other scenarios", agents.filter((one) => !isOwn(one)).map((one) => trained(one, true)))];
  }

  /** Who has which seat, where there are several. @param {string} own @param {Record<string, string>} others */
  offerSeats(own, others) {
    const { seats } = this.plays, { episode } = this;
    this.company.hidden = seats.length === 1;
    const called = (/** @type {string} */ seat) => (episode && episode.called(seat) !== seat ? `${seat} “${episode.called(seat)}”` : seat);
    this.own.replaceChildren(...seats.map(({ seat }) => make("option", { value: seat, selected: seat === own }, called(seat))));
    this.companions.replaceChildren(...seats.filter(({ seat }) => seat !== own).map(({ seat, script }) =>
      make("span", {}, make("label", {}, `${called(seat)}: `, make("select", { "aria-label": `who plays ${seat}`, "data-seat": seat, onchange: () => this.begin() },
        ...this.options(others[seat], [...(script ? [["script", "script"]] : []), ["random", "random"], ["nobody", "nobody"]]))),
        make("button", { onclick: () => this.invite(seat), title: `a link, with which somebody plays ${seat} in a browser of their own` }, "Invite…"))));
    this.offerGuests();
  }

  /** Who is here, and who has chosen. */
  offerGuests() {
    const { chosen, own } = this.guests, here = Object.entries(chosen);
    this.here.textContent = here.map(([seat, has]) => `${this.episode?.called(seat) ?? seat} is here${own || has ? (has ? " and has chosen" : " and is choosing") : ""}`).join("; ");
  }

  /** A link to a seat. @param {string} seat */
  async invite(seat) {
    const made = await this.line.ask("invite", { seat, seconds: this.seconds });
    if (made.refused) return this.tell(made.refused);
    if (!this.invited.includes(seat)) settings.setOfWindow("invited", this.invited = [...this.invited, seat]);
    const link = make("input", { readonly: true, value: `${location.origin}/guest?code=${made.code}`, "aria-label": `link to the seat of ${seat}`, onfocus: () => link.select() });
    const waits = make("select", { "aria-label": "how long to wait", onchange: () => {
      this.seconds = Number(waits.value) || null;
      this.line.ask("invite", { seat, seconds: this.seconds });
    } }, ...[["10", "10 seconds"], ["60", "a minute"], ["300", "five minutes"], ["", "for ever"]].map(([value, word]) => make("option", { value, selected: value === String(this.seconds ?? "") }, word)));
    this.ask(`Whoever opens this link plays ${seat} in this window's game, and sees and hears what ${seat} does. A step is taken when all have chosen. Whoever chooses too late or leaves is stood in for by “${this.casting[seat] ?? "script"}”.${["127.0.0.1", "localhost", "[::1]"].includes(location.hostname) ? " The link is good on this machine; for others start the studio with --host." : ""}`,
      [["Close", () => {}]], make("label", {}, "Link ", link), make("label", {}, "Wait for those who have not chosen ", waits));
    link.select();
  }

  /** What the server says without being asked. @param {Reply} said */
  hear(said) {
    if (said.refused) this.tell(said.refused);
    else if (said.do === "guests") {
      this.guests = said;
      this.offerGuests();
    } else if (said.do === "act") this.went(said);
  }

  /** Who plays where, and what is played: a rival is a variant of the scenario, with a script. */
  chosen() {
    const { value } = this.players, { variant } = this.place, seat = this.own.value || "agent";
    const selects = /** @type {HTMLSelectElement[]} */ ([...this.companions.querySelectorAll("select")]).filter(({ dataset }) => dataset.seat !== seat);
    const others = Object.fromEntries(selects.map(({ dataset, value: who }) => [dataset.seat, who]));
    if (value.startsWith("+")) return { player: "script", variant: seat === "agent" ? value : "", seat, others };
    return { player: value || "me", variant: this.isRival(variant) ? "" : variant, seat, others };
  }

  /** Whether a variant is a rival. @param {string} variant */
  isRival(variant) {
    return this.plays.rivals.includes(variant.slice(1));
  }

  // -- the text --------------------------------------------------------------------------------------------------

  /** @param {string} name */
  async openFile(name) {
    if (!name) return;
    const stay = (/** @type {string} */ said) => {
      this.tell(said);
      this.files.value = this.name;
    };
    if (this.name && name !== this.name) {
      const kept = await this.keep();
      if (kept.refused && this.dirty) return stay(`what you have typed cannot be kept: ${kept.refused}`);
    }
    const found = await this.line.ask("read", { name });
    if (found.refused) return stay(found.refused);
    const same = name === this.name, back = found.draft !== null;
    if (!same) this.keep(); // what was typed while the file was read, too
    // A draft is saved against the file that it was begun with, so that what was saved since is not written over unseen.
    Object.assign(this, { name, digest: back ? found.base : found.digest, saved: found.text, place: same ? this.place : { room: { seed: 0 }, variant: "" } });
    if (!same) this.forget();
    this.files.value = name;
    document.title = this.title.textContent = name;
    this.players.value = "me";
    this.editor.open(name, found.text);
    const before = this.editor.text, shown = back ? found.draft : found.text;
    if (before !== shown) this.editor.replace(shown);
    this.mark();
    if (this.dirty) this.state.textContent = "not saved; a draft is kept";
    this.showOthers(found.others);
    await this.draw();
    const since = back && found.base !== found.digest ? ", and the file was changed elsewhere since: saving asks first" : "";
    if (back && before !== shown) this.tell(`what you had typed and not saved is here again${since}; Ctrl-Z takes it back`);
    else if (found.elsewhere) this.tell("another window has typed into this file and not saved; each window keeps its own draft");
  }

  typedText() {
    if (!this.name) return;
    this.mark();
    this.outdate();
    clearTimeout(this.later.draw);
    this.later.draw = setTimeout(() => this.draw(), DRAW_AFTER);
    clearTimeout(this.later.keep);
    this.later.keep = setTimeout(() => this.keep(), KEEP_AFTER);
  }

  /** Say whether the file holds what is written. */
  mark() {
    this.dirty = this.editor.text !== this.saved;
    this.state.textContent = this.dirty ? "not saved" : "saved";
  }

  /** Keep what was typed as this window's draft. */
  async keep() {
    clearTimeout(this.later.keep);
    const { name, digest, dirty } = this, { text } = this.editor;
    if (!name) return {};
    const done = await this.line.ask("draft", { name, text: dirty ? text : null, base: digest });
    if (name === this.name && text === this.editor.text && this.dirty) this.state.textContent = done.refused ? `not saved; ${done.refused}` : "not saved; a draft is kept";
    return done;
  }

  async save(over = false) {
    clearTimeout(this.later.keep);
    const { name, digest } = this, { text } = this.editor, done = await this.line.ask("save", { name, text, digest, over });
    if (done.conflict) this.conflict(done.refused);
    else if (done.refused) this.tell(done.refused);
    else if (name === this.name) {
      Object.assign(this, { digest: done.digest, saved: text });
      this.mark();
      if (this.dirty) this.keep();
    }
    return !done.refused;
  }

  /** @param {string} said */
  conflict(said) {
    this.ask(`${said}. Nothing is lost: what you write over is kept as a draft, and Ctrl-Z brings back what you give up.`, [
      ["Keep mine, and write over it", async () => (await this.save(true)) && this.look()],
      ["Open theirs", async () => {
        const found = await this.line.ask("read", { name: this.name, adopt: false });
        if (found.refused) return this.tell(found.refused);
        Object.assign(this, { digest: found.digest, saved: found.text });
        this.editor.replace(found.text);
        this.mark();
        this.draw();
      }],
      ["Neither, for now", () => {}],
    ]);
  }

  /** Look which drafts there are besides this window's. */
  async look() {
    const found = await this.line.ask("read", { name: this.name, adopt: false });
    if (!found.refused) this.showOthers(found.others);
  }

  /** @param {Reply[]} others */
  showOthers(others) {
    this.others = others;
    this.kept.hidden = !others.length;
    this.kept.textContent = others.length === 1 ? "Another draft…" : `${others.length} other drafts…`;
  }

  /** Drafts of windows that were closed, and what was written over. */
  offerDrafts() {
    const { name } = this;
    /** @type {[string, () => void][]} */ const answers = [];
    for (const { draft, time, lines } of this.others) {
      const which = `the draft of ${new Date(1000 * time).toLocaleString()}, ${lines} lines`;
      answers.push([`Open ${which}`, async () => {
        await this.keep();
        const taken = await this.line.ask("take", { name, draft });
        if (taken.refused) return this.tell(taken.refused);
        this.digest = taken.base;
        this.editor.replace(taken.text);
        this.mark();
        await this.keep();
        await this.look();
      }]);
      answers.push([`Delete ${which}`, async () => {
        const done = await this.line.ask("discard", { name, draft });
        if (done.refused) this.tell(done.refused);
        await this.look();
      }]);
    }
    this.ask(`What was typed into ${name} in windows that are closed, or was written over, is kept until you delete it. Opening a draft keeps what you have typed here as another one.`, [...answers, ["Close", () => {}]]);
  }

  /** @param {string} text @param {[string, () => void][]} answers @param {...Node} more */
  ask(text, answers, ...more) {
    const close = (/** @type {() => void} */ act) => () => {
      this.dialog.close();
      act();
    };
    this.dialog.replaceChildren(text ? make("p", {}, text) : "", ...more, make("div", { class: "controls" }, ...answers.map(([word, act]) => make("button", { onclick: close(act) }, word))));
    if (!this.dialog.open) this.dialog.showModal();
  }

  /** New scenarios: templates, and copies of shipped ones. */
  offer() {
    /** @type {{heading: string, names: Record<string, string>}[]} */ const starts = this.offered?.starts ?? [];
    const [templates, ...copies] = starts;
    const option = ([name, about] = ["", ""]) => make("option", { value: name }, about ? `${name}: ${about}` : name);
    const template = make("select", { "aria-label": "template" }, ...Object.entries(templates?.names ?? {}).map(option));
    const called = make("input", { value: "my_scenario", "aria-label": "name" });
    const copy = make("select", { "aria-label": "scenario to copy" }, ...copies.map(({ heading, names }) => make("optgroup", { label: heading }, ...Object.entries(names).map(option))));
    const opened = async (/** @type {Reply} */ done) => {
      if (done.refused) return this.tell(done.refused);
      await this.list();
      await this.openFile(done.name);
    };
    this.ask("Begin with a template, or with a copy of a scenario, its script and its tests. Both become files of this folder.", [
      ["Begin with the template", async () => opened(await this.line.ask("create", { template: template.value, called: called.value.trim() }))],
      ["Open a copy", async () => opened(await this.line.ask("copy", { shipped: copy.value }))],
      ["Close", () => {}],
    ], make("label", {}, "Template ", template), make("label", {}, "Name ", called), make("label", {}, "Scenario ", copy));
  }

  /** Show the page about a code of findings. @param {string} code */
  async explain(code) {
    const found = await this.line.ask("explain", { code });
    if (found.refused) return this.tell(found.refused);
    this.ask("", [["Close", () => {}]], page(found.page));
  }

  wrap() {
    settings.set("wraps", this.wraps.checked ? "yes" : "no");
    this.editor.wrap(this.wraps.checked);
  }

  /** @param {string} at file:line @param {number} [column] */
  async editorAt(at, column = 1) {
    const [, file, line] = /^(.*):(\d+)$/.exec(at) ?? ["", "", "1"];
    const name = /** @type {string[]} */ (this.offered?.files ?? []).find((one) => one === file || file.endsWith(`/${one}`));
    if (!name) return this.tell(`${at} is not a file of this folder`);
    if (name !== this.name) await this.openFile(name);
    this.editor.goTo(Number(line), column);
  }

  // -- the game --------------------------------------------------------------------------------------------------

  /** Draw the room of what is written; of several changes while one is drawn, the last. */
  async draw() {
    if (this.drawing) {
      this.again = true;
      return;
    }
    this.drawing = true;
    this.pause();
    const slow = setTimeout(() => this.episode || this.tell(FIRST_ROOM), TELL_AFTER);
    const text = this.editor.text, drawn = await this.line.ask("draw", { path: this.name, text, room: this.place.room });
    clearTimeout(slow);
    this.drawing = false;
    if (this.again) {
      this.again = false;
      await this.draw();
      return;
    }
    const findings = drawn.findings ?? [];
    this.findings.replaceChildren(...findingItems(findings, this.ways));
    this.sound.hidden = findings.length > 0;
    this.writing.count("Findings", findings.length ? String(findings.length) : "", findings.some((/** @type {Reply} */ one) => one.error) ? "bad" : "open");
    if (findings.some((/** @type {Reply} */ one) => one.error)) this.writing.choose("Findings");
    this.stage.root.classList.toggle("stale", !drawn.episode);
    if (drawn.plays) this.plays = drawn.plays;
    if (drawn.episode) {
      this.counts.forget();
      this.episode = null;
      this.tell("");
      this.take(drawn.episode);
    } else {
      if (this.placedIn !== this.name) this.leave();
      this.tell(drawn.refused ?? (this.episode ? "the last good room is shown until the mistakes are mended" : "the room is shown when the mistakes are mended"));
    }
  }

  /** Show no room, since the last one was that of another file. */
  leave() {
    this.episode = null;
    this.length = 0;
    this.root.classList.add("roomless");
  }

  /** @param {Reply} begun */
  take(begun) {
    if (this.episode) this.counts.keep(this.episode);
    this.episode = new Episode(begun.trace);
    this.placedIn = this.name;
    this.root.classList.remove("roomless");
    this.seat.moments = begun.seats;
    this.counts.names = begun.rules;
    this.length = this.episode.length;
    this.casting = begun.others;
    this.offerSeats(this.episode.own, begun.others);
    this.offerPlayers();
    this.players.value = begun.player === "script" && this.isRival(begun.variant) ? begun.variant : ([...this.players.options].find(({ value }) => isCalled(begun.player, value))?.value ?? "me");
    this.seatedAs.textContent = `as ${this.plays.seats.length > 1 ? this.episode.called(this.episode.own) : "the agent"} sees it`;
    this.place = { room: begun.room, variant: begun.variant };
    this.numberRoom();
    document.body.dataset.rooms = String(Number(document.body.dataset.rooms ?? 0) + 1);
    const { actions, templates } = this.episode.trace;
    const options = (/** @type {HTMLSelectElement} */ select, /** @type {string[]} */ words) => {
      const chosen = select.value;
      select.replaceChildren(...words.map((word) => make("option", { selected: word === chosen }, word)));
    };
    options(this.thing, Object.keys(this.episode.scenes[0].state).filter((key) => key.endsWith(".at") && this.placeOf(key.slice(0, -3))).map((key) => key.slice(0, -3)));
    this.moving(null);
    options(this.template, templates);
    const known = new Map([...this.words.children].map((select) => [select.getAttribute("aria-label"), select]));
    this.words.replaceChildren(...slotsOf(this.episode.trace).map(([name, words]) => {
      const select = /** @type {HTMLSelectElement} */ (known.get(name) ?? make("select", { "aria-label": name }));
      options(select, words);
      return select;
    }));
    this.offerWords();
    this.sentences.replaceChildren(...begun.phrases.map((/** @type {string} */ said) => make("option", { value: said })));
    this.moves.replaceChildren(...[...actions, "none"].map((word) => make("button", { onclick: () => this.act({ movement: word === "none" ? null : word }) }, word)));
    this.show();
  }

  /** Begin an episode where the last one was, or elsewhere. */
  async begin(room = this.place.room, casting = this.chosen()) {
    this.pause();
    const begun = await this.line.ask("begin", { room, ...casting });
    if (begun.refused) {
      this.tell(begun.refused);
      if (!begun.lost) this.restore();
      if (begun.lost) this.draw();
      return;
    }
    this.tell("");
    this.take(begun.episode);
  }

  /** Let the choices be those of the episode that is shown, played by me. */
  restore() {
    if (!this.episode) return;
    this.offerSeats(this.episode.own, this.casting);
    this.offerPlayers();
    this.players.value = "me";
    this.numberRoom();
  }

  /** Let the fields have the numbers of the room that is shown. */
  numberRoom() {
    this.seedField.value = String(this.place.room.seed);
    this.roomField.value = String(this.place.room.index ?? 0);
  }

  /** Begin in another room, without what was known of the last one. @param {Record<string, any>} room */
  another(room) {
    const casting = this.chosen(), { player, variant } = casting;
    this.begin(room, { ...casting, variant: player === "script" && this.isRival(variant) ? variant : "" });
  }

  /** The next seed. */
  next() {
    this.another({ seed: (this.place.room.seed ?? 0) + 1 });
  }

  /** Show what was found in a room, at its step. @param {import("./found.js").Shown} shown */
  async reveal(shown) {
    this.pause();
    this.tell("playing …");
    const begun = await this.line.ask("show", { shown });
    if (begun.refused) {
      this.tell(begun.refused);
      if (begun.lost) this.draw();
      return;
    }
    this.tell(roomInWords(shown));
    this.take(begun.episode);
    this.stage.root.scrollIntoView({ block: "nearest" });
  }

  /** @param {Reply} what */
  async act(what, name = "act") {
    if (Object.keys(this.guests.chosen).length) this.tell("waiting for the others …");
    const done = await this.line.ask(name, what);
    if (done.refused) {
      this.tell(done.refused);
      this.pause();
      if (done.lost) this.draw();
      return false;
    }
    this.went(done);
    return true;
  }

  /** A step was taken. @param {Reply} done */
  went(done) {
    this.tell("");
    this.episode?.add(done.more);
    this.seat.moments.push(done.seat);
    this.length = this.episode?.length ?? 0;
    this.show();
  }

  /** @param {number} step */
  async back(step) {
    if (step < 0 || step >= this.length) return;
    this.pause();
    const done = await this.line.ask("back", { to: step });
    if (done.refused) return this.tell(done.refused);
    this.episode?.cut(step);
    this.seat.moments.length = step + 1;
    this.length = step;
    this.tell("");
    this.show();
  }

  say() {
    const selects = /** @type {HTMLSelectElement[]} */ ([...this.words.children]);
    this.act({ sentence: selects.reduce((said, words) => said.replace(`<${words.getAttribute("aria-label")}>`, words.value), this.template.value) });
  }

  /** Words are offered for the slots that the template has. */
  offerWords() {
    for (const words of /** @type {HTMLSelectElement[]} */ ([...this.words.children]))
      words.hidden = !this.template.value.includes(`<${words.getAttribute("aria-label")}>`);
  }

  /** @param {Event} event */
  async submit(event) {
    event.preventDefault();
    if (this.typed.value.trim() && (await this.act({ line: this.typed.value }))) this.typed.value = "";
  }

  async auto() {
    if (this.players.value === "me") {
      this.tell("choose who plays: the script, a random player, or a run of this folder");
      return false;
    }
    return this.act({}, "auto");
  }

  toggleWatch() {
    if (this.timer !== undefined) return this.pause();
    const play = async () => {
      const goesOn = !this.episode?.ended && (await this.auto());
      if (!goesOn) this.pause();
      else if (this.timer !== undefined) this.timer = setTimeout(play, STEP_EVERY);
    };
    this.timer = setTimeout(play);
    this.watch.textContent = "⏸ pause";
  }

  pause() {
    clearTimeout(this.timer);
    this.timer = undefined;
    this.watch.textContent = "▶ watch";
  }

  /** Where a thing is now. @param {string} who @returns {[number, number] | null} */
  placeOf(who) {
    return this.episode?.scenes[this.length].state[`${who}.at`] ?? null;
  }

  /** Show where the chosen thing is about to be put; null: it is not moved any more.
   * @param {[number, number] | null} aim */
  moving(aim) {
    const room = this.episode?.scenes[this.length].room;
    this.aim = aim && room ? [Math.max(0, Math.min(aim[0], room.width - 1)), Math.max(0, Math.min(aim[1], room.height - 1))] : null;
    this.target.hidden = !this.aim;
    if (!this.aim || !room) return;
    const [x, y] = this.aim, share = (/** @type {number} */ part, /** @type {number} */ whole) => `${(100 * part) / whole}%`;
    Object.assign(this.target.style, { left: share(x, room.width), top: share(y, room.height), width: share(1, room.width), height: share(1, room.height) });
    this.tell(`${this.thing.value} to ${x}, ${y}: Enter puts it there, Esc leaves it`);
  }

  /** Put the chosen thing where it is aimed at; the episode begins again. */
  async put() {
    const who = this.thing.value, at = this.aim, from = this.placeOf(who);
    this.moving(null);
    this.tell("");
    if (!at || !from || (from[0] === at[0] && from[1] === at[1])) return;
    if (this.length) await this.back(0);
    const done = await this.line.ask("place", { who, at });
    if (done.refused) return this.tell(done.refused);
    this.take(done.episode);
    this.tell(`${who} was put at ${at.join(", ")}; “Layout…” begins episodes so`);
  }

  /** Things are dragged to other cells. */
  dragging() {
    const { canvas } = this.stage;
    const cell = (/** @type {PointerEvent} */ event) => {
      const box = canvas.getBoundingClientRect(), { width, height } = this.episode?.scenes[this.length].room ?? { width: 1, height: 1 };
      return /** @type {[number, number]} */ ([Math.floor(((event.clientX - box.left) / box.width) * width), Math.floor(((event.clientY - box.top) / box.height) * height)]);
    };
    canvas.addEventListener("pointerdown", (event) => {
      const [x, y] = cell(event);
      const held = [...this.thing.options].map((one) => one.value).find((who) => this.placeOf(who)?.[0] === x && this.placeOf(who)?.[1] === y);
      if (!held) return;
      this.thing.value = held;
      this.moving([x, y]);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => this.aim && event.buttons && this.moving(cell(event)));
    canvas.addEventListener("pointerup", () => this.put());
    canvas.addEventListener("pointercancel", () => this.moving(null));
  }

  /** The room as it is now, as a layout: in the text, in a new suite, or as a file. */
  async offerLayout() {
    const written = await this.line.ask("write_layout", { text: this.editor.text });
    /** @type {[string, () => void]} */
    const toFile = ["Save a file for --layout", () => this.export("layout")];
    const here = () => {
      this.editor.replace(written.text);
      this.tell("the layout was written into the text; Ctrl-Z takes it back");
    };
    const anew = async () => {
      const added = await this.line.ask("add", { name: written.name, text: written.suite });
      if (added.refused) return this.tell(added.refused);
      await this.list();
      await this.openFile(added.name);
    };
    /** @type {[string, () => void][]} */
    const own = written.text ? [["Write it into the text", here]] : written.suite ? [[`Begin so in a new suite, ${written.name}`, anew]] : [];
    this.ask(`Every episode can begin in the room as it is now. What a layout leaves out is drawn. ${written.refused ?? ""}`, [...own, toFile, ["Close", () => {}]]);
  }

  /** Try what the text claims. */
  async check() {
    const done = await this.find("Claims", this.claims, "check", "checking, which takes up to 20 seconds …");
    if (!done) return;
    /** @type {import("./found.js").Claim[]} */ const claims = done.claims, open = claims.filter((one) => one.verdict !== "holds");
    open.sort((a, b) => Number(b.verdict === "fails") - Number(a.verdict === "fails"));
    this.claims.replaceChildren(
      make("ul", { "aria-label": "claims" }, ...claimItems([...open, ...claims.filter((one) => one.verdict === "holds")], this.ways), ...findingItems(done.findings, this.ways)),
      ...done.lines.map((/** @type {string} */ line) => make("p", { class: "quiet" }, ...marked(line))));
    this.judge("Claims", claims, open);
  }

  /** Play the tests of the text. */
  async test() {
    const done = await this.find("Tests", this.tests, "test", "playing the tests …");
    if (!done) return;
    const failed = done.tests.filter((/** @type {import("./found.js").TestResult} */ one) => !one.passes);
    this.tests.replaceChildren(make("ul", { "aria-label": "tests" }, ...testItems([...failed, ...done.tests.filter((/** @type {Reply} */ one) => one.passes)], this.ways), ...findingItems(done.findings, this.ways)));
    this.judge("Tests", done.tests, failed);
  }

  /** Ask what is found of the text, and show in a tab that it is looked for.
   * @param {string} tab @param {HTMLElement} panel @param {"check" | "test"} question @param {string} meanwhile */
  async find(tab, panel, question, meanwhile) {
    const { name } = this, { text } = this.editor;
    this.writing.choose(tab);
    panel.classList.remove("outdated");
    panel.replaceChildren(make("p", { class: "quiet", role: "status" }, meanwhile));
    const done = await this.line.ask(question, { path: name, text });
    if (name !== this.name) return null;
    if (done.refused) panel.replaceChildren(make("p", { class: "quiet", role: "status" }, done.refused));
    if (text !== this.editor.text) panel.classList.add("outdated");
    return done.refused ? null : done;
  }

  /** Show verdicts behind the lines that they are about, and on the tab how many are not as they should be.
   * @param {string} tab
   * @typedef {(import("./found.js").Claim | import("./found.js").TestResult)[]} Judged
   * @param {Judged} found @param {Judged} open those that are not as they should be */
  judge(tab, found, open) {
    this.verdicts[tab] = found.filter((one) => !one.file).map((one) => ({ line: one.line, ...verdictOf(one) }));
    this.editor.judge(Object.values(this.verdicts).flat());
    const look = open.some((one) => verdictOf(one).kind === "bad") ? "bad" : open.length ? "open" : "good";
    this.writing.count(tab, found.length ? (open.length ? `${open.length} of ${found.length}` : "✓") : "", look);
  }

  /** Verdicts are about the text before a change. */
  outdate() {
    if (Object.keys(this.verdicts).length) this.editor.judge([]);
    this.verdicts = {};
    for (const panel of [this.claims, this.tests]) if (panel.querySelector("li")) panel.classList.add("outdated");
    for (const tab of ["Claims", "Tests"]) this.writing.count(tab, "");
  }

  /** Nothing was found of another file. */
  forget() {
    this.verdicts = {};
    for (const panel of [this.claims, this.tests]) panel.classList.remove("outdated");
    this.claims.replaceChildren(make("p", { class: "quiet" }, "Nothing was checked yet."));
    this.tests.replaceChildren(make("p", { class: "quiet" }, "No test was played yet."));
    for (const tab of ["Claims", "Tests"]) this.writing.count(tab, "");
  }

  /** What was played becomes a test, which is shown first, and then put into the text of the file beside. */
  async offerTest() {
    const made = await this.line.ask("write_test", { name: "my_test" });
    if (made.refused) return this.tell(made.refused);
    const folder = this.name.replace(/[^/]*$/, ""), beside = made.beside === null ? null : `${folder}${made.beside}`;
    const isThere = (this.offered?.files ?? []).includes(beside);
    const where = isThere ? `It is put into the text of ${beside}, where you save it or take it back.` : `${beside} is made, with it alone.`;
    const called = make("input", { value: "my_test", "aria-label": "name of the test", oninput: () => (text.textContent = made.entry.replace("my_test", called.value.trim())) });
    const text = make("pre", { tabindex: 0, "aria-label": "the test" }, made.entry);
    /** @type {[string, () => void][]} */
    const own = beside ? [[`Put it into ${beside}`, () => this.putTest(called.value.trim(), beside)]] : [];
    this.ask(`A test of what was played. ${beside ? where : ""}`,
      [...own, ["Close", () => {}]], make("label", {}, "Name ", called), text);
  }

  /** @param {string} name of the test @param {string} beside the file */
  async putTest(name, beside) {
    const isThere = (this.offered?.files ?? []).includes(beside), open = beside === this.name;
    const found = isThere && !open ? await this.line.ask("read", { name: beside }) : {};
    if (found.refused) return this.tell(found.refused);
    const former = open ? this.editor.text : isThere ? (found.draft ?? found.text) : null;
    const made = await this.line.ask("write_test", { name, former });
    if (made.refused) return this.tell(made.refused);
    if (!isThere) {
      const added = await this.line.ask("add", { name: beside, text: made.text });
      if (added.refused) return this.tell(added.refused);
      await this.list();
      await this.openFile(added.name);
      return this.tell(`${added.name} was made, with the test`);
    }
    if (!open) await this.openFile(beside);
    this.editor.replace(made.text);
    this.tell(`the test was put into the text; save it, or take it back by Ctrl-Z`);
  }

  /** @param {"replay" | "layout"} what */
  async export(what) {
    const done = await this.line.ask(what);
    if (done.refused) return this.tell(done.refused);
    const stem = this.name.replace(/.*\//, "").replace(/\.ya?ml$/, "");
    const [text, name] = what === "replay" ? [done.page, `${stem}.html`] : [JSON.stringify(done.layout, null, 2), `${stem}.layout.json`];
    const link = make("a", { href: URL.createObjectURL(new Blob([text])), download: name });
    link.click();
    URL.revokeObjectURL(link.href);
  }

  /** Show what the agent sees, or all again; keys play on. */
  sit() {
    this.seated.blur();
    this.moving(null);
    this.tell("");
    this.show();
  }

  shade() {
    const root = document.documentElement, dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const now = root.style.colorScheme || (dark ? "dark" : "light");
    root.style.colorScheme = now === "dark" ? "light" : "dark";
    this.show();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { target, key } = event;
    if ((event.ctrlKey || event.metaKey) && key === "s" && !event.defaultPrevented) {
      event.preventDefault();
      this.save();
    }
    const aside = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
    if (this.aim && (aside || key === "Enter" || key === "Escape")) {
      event.preventDefault();
      if (aside) this.moving([this.aim[0] + aside[0], this.aim[1] + aside[1]]);
      else if (key === "Enter") this.put();
      else {
        this.moving(null);
        this.tell("");
      }
      return;
    }
    if (event.ctrlKey || event.metaKey || event.altKey || this.dialog.open || !(target instanceof HTMLElement)) return;
    if (target.closest("input, select, textarea, .text, [role=tablist]") || (target instanceof HTMLButtonElement && [" ", "Enter"].includes(key))) {
      if (key === "Escape") target.blur();
      return;
    }
    const name = key.length === 1 ? key.toLowerCase() : key;
    const move = MOVES[name];
    /** @type {Record<string, () => void>} */
    const others = {
      "/": () => this.typed.focus(),
      Enter: () => this.typed.focus(),
      m: () => this.thing.focus(),
      u: () => this.back(this.length - 1),
      Backspace: () => this.back(this.length - 1),
      r: () => this.begin(),
      n: () => this.next(),
      l: () => {
        this.stage.letters = !this.stage.letters;
        this.show();
      },
    };
    const act = move ? () => this.act({ movement: move === "none" ? null : move }) : others[name];
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** @param {string} text */
  tell(text) {
    this.message.textContent = text;
  }

  show() {
    const { episode, length } = this;
    if (!episode) return;
    const { ended } = episode, own = this.players.value === "me";
    this.seated.disabled = !own;
    const seated = own && this.seated.checked;
    this.root.classList.toggle("seated", seated);
    this.count.textContent = `step ${length}${seated ? "" : ` · reward ${episode.part(episode.scenes[length]).reward.toFixed(3)}`}`;
    if (ended) this.tell(`${ended.success ? "✓" : "✗"} ${seated ? (ended.success ? "success" : "no success") : outcomeInWords(ended)}`);
    this.message.className = `message ${ended ? (ended.success ? "good" : "bad") : ""}`;
    this.views.choose(episode, length);
    if (seated) episode.viewer = episode.own;
    if (!this.views.member) this.stage.seen = undefined;
    for (const part of this.parts) part.show(episode, length);
    this.gaze();
  }

  /** Ask what the member of the cast sees whose view is to be shown, unless that is known. @returns {Promise<void>} */
  async gaze() {
    const { episode, length, views } = this, { member } = views;
    if (!member || this.gazing || (views.looked?.who === member && views.looked.step === length && this.gazed === episode)) return;
    this.gazing = true;
    const found = await this.line.ask("look", { who: member });
    this.gazing = false;
    if (episode !== this.episode || length !== this.length || member !== views.member) return this.gaze();
    if (found.refused) return this.tell(found.refused);
    this.gazed = episode;
    views.looked = /** @type {import("./parts.js").Looked} */ (found);
    this.stage.seen = new Set(found.cells);
    if (episode) for (const part of [this.stage, views]) part.show(episode, length);
  }
}

/** Whether a player of an episode is the one that is offered by this name: runs are offered as seen from the folder.
 * @param {string} player @param {string} name */
function isCalled(player, name) {
  return player === name || player?.endsWith(`/${name}`);
}

new Studio();
