// @ts-check
/** The studio's editor: CodeMirror over the project's language server. Bundled into socialai_dsl/studio/static/editor.js. */
import { basicSetup } from "codemirror";
import { indentWithTab } from "@codemirror/commands";
import { HighlightStyle, syntaxHighlighting } from "@codemirror/language";
import { tags } from "@lezer/highlight";
import { yaml } from "@codemirror/lang-yaml";
import { lintGutter } from "@codemirror/lint";
import { LSPClient, hoverTooltips, jumpToDefinitionKeymap, serverCompletion, serverDiagnostics, formatKeymap } from "@codemirror/lsp-client";
import { Compartment, EditorState, RangeSetBuilder, StateEffect, StateField } from "@codemirror/state";
import { Decoration, EditorView, ViewPlugin, WidgetType, keymap } from "@codemirror/view";

const look = EditorView.theme({
  "&": { height: "100%", fontSize: "14px", backgroundColor: "var(--card)", color: "var(--ink)" },
  ".cm-scroller": { fontFamily: "ui-monospace, monospace", overflow: "auto" },
  ".cm-content": { caretColor: "var(--ink)" },
  ".cm-gutters": { backgroundColor: "var(--card)", color: "var(--quiet)", borderColor: "var(--edge)" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "color-mix(in srgb, var(--mark) 45%, transparent)" },
  ".cm-tooltip, .cm-panels": { backgroundColor: "var(--card)", color: "var(--ink)", border: "1px solid var(--edge)" },
  ".cm-tooltip-autocomplete ul li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--paper)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  "&.cm-focused .cm-selectionBackground, .cm-selectionBackground": { backgroundColor: "var(--mark) !important" },
  ".cm-verdict": { marginLeft: "1.5em", padding: "0 0.4em", borderRadius: "4px", fontFamily: "system-ui, sans-serif", fontSize: "0.85em" },
  ".cm-verdict.good": { color: "var(--good)" },
  ".cm-verdict.bad": { color: "var(--bad)", fontWeight: "600" },
  ".cm-verdict.open": { color: "var(--quiet)" },
});

/** Colours of the page, which are light or dark as the page is. */
const words = HighlightStyle.define([
  { tag: [tags.propertyName, tags.definition(tags.propertyName)], color: "var(--accent)" },
  { tag: [tags.comment, tags.lineComment], color: "var(--quiet)", fontStyle: "italic" },
  { tag: [tags.string, tags.content], color: "var(--ink)" },
  { tag: [tags.number, tags.bool, tags.keyword, tags.meta], color: "var(--good)" },
  { tag: [tags.punctuation, tags.separator, tags.squareBracket, tags.brace], color: "var(--quiet)" },
]);

/** @typedef {{line: number, text: string, kind: "good" | "bad" | "open"}} Verdict */

/** What was found of a line, behind its end. */
class VerdictWidget extends WidgetType {
  /** @param {Verdict} verdict */
  constructor(verdict) {
    super();
    this.verdict = verdict;
  }

  /** @param {VerdictWidget} other */
  eq(other) {
    return other.verdict.text === this.verdict.text && other.verdict.kind === this.verdict.kind;
  }

  toDOM() {
    const made = document.createElement("span");
    made.className = `cm-verdict ${this.verdict.kind}`;
    made.textContent = this.verdict.text;
    return made;
  }
}

/** @type {import("@codemirror/state").StateEffectType<Verdict[]>} */ const judge = StateEffect.define();

/** The verdicts of a file, which move with its lines. */
const verdicts = StateField.define({
  create: () => Decoration.none,
  update(shown, { changes, effects, newDoc }) {
    const judged = effects.find((effect) => effect.is(judge));
    if (!judged) return shown.map(changes);
    const inside = judged.value.filter(({ line }) => line >= 1 && line <= newDoc.lines);
    return Decoration.set(inside.map((one) => Decoration.widget({ widget: new VerdictWidget(one), side: 1 }).range(newDoc.line(one.line).to)), true);
  },
  provide: (field) => EditorView.decorations.from(field),
});

const DEEPEST = 40;

/** A class for each depth of indentation, as the page's policy allows no styles of single elements. */
const depths = EditorView.theme(Object.fromEntries(Array.from({ length: DEEPEST }, (_, k) =>
  [`.cm-line.cm-deep-${k + 1}`, { paddingLeft: `calc(6px + ${k + 1}ch)`, textIndent: `-${k + 1}ch` }])));

/** The further lines of a wrapped line begin below its first word. */
const hanging = ViewPlugin.fromClass(
  class {
    /** @param {EditorView} view */
    constructor(view) {
      this.decorations = indented(view);
    }

    /** @param {import("@codemirror/view").ViewUpdate} update */
    update(update) {
      if (update.docChanged || update.viewportChanged) this.decorations = indented(update.view);
    }
  },
  { decorations: (plugin) => plugin.decorations },
);

/** @param {EditorView} view */
function indented(view) {
  /** @type {RangeSetBuilder<Decoration>} */ const lines = new RangeSetBuilder();
  for (const { from, to } of view.visibleRanges) {
    for (let at = from; at <= to; ) {
      const line = view.state.doc.lineAt(at), deep = /^[ -]*/.exec(line.text)?.[0].length ?? 0;
      if (deep) lines.add(line.from, line.from, Decoration.line({ class: `cm-deep-${Math.min(deep, DEEPEST)}` }));
      at = line.to + 1;
    }
  }
  return lines.finish();
}

/** An editor for one file after another; each file keeps its history of changes while the window is open. */
export class Editor {
  /**
   * @param {HTMLElement} parent
   * @param {{root: string, language: string, nonce: string, wraps: boolean, changed: (text: string) => void, save: () => void}} options
   *   root: folder of the files; language: address of the language server; nonce: that the page's policy names for
   *   styles; wraps: whether long lines are wrapped; changed: told the text after each change; save: asked for by Ctrl-S
   */
  constructor(parent, options) {
    this.options = options;
    /** @type {Map<string, EditorState>} */ this.states = new Map();
    this.name = "";
    this.wraps = options.wraps;
    this.wrapping = new Compartment();
    this.client = new LSPClient({ rootUri: uri(options.root), extensions: [serverDiagnostics(), serverCompletion(), hoverTooltips()], timeout: 60000 });
    this.view = new EditorView({ parent, extensions: EditorView.cspNonce.of(options.nonce) });
    this.connect();
  }

  /** Connect to a language server; after a connection is lost, to another one, which is told of all files again. */
  connect() {
    const socket = new WebSocket(this.options.language);
    /** @type {Set<(message: string) => void>} */ const handlers = new Set();
    socket.onmessage = (event) => handlers.forEach((handler) => handler(event.data));
    socket.onopen = () =>
      this.client.connect({
        send: (message) => socket.send(message),
        subscribe: (handler) => void handlers.add(handler),
        unsubscribe: (handler) => void handlers.delete(handler),
      });
    socket.onclose = () => {
      this.client.disconnect();
      setTimeout(() => this.connect(), 1000);
    };
  }

  /** Show a file from its beginning; with this text where it was not shown before.
   * @param {string} name @param {string} text */
  open(name, text) {
    if (this.name) this.states.set(this.name, this.view.state);
    this.name = name;
    this.view.setState(this.states.get(name) ?? EditorState.create({ doc: text, extensions: this.extensions(name) }));
    this.wrap(this.wraps);
    this.view.scrollDOM.scrollTo(0, 0);
  }

  /** Wrap long lines, or let them run on. @param {boolean} wraps */
  wrap(wraps) {
    this.wraps = wraps;
    this.view.dispatch({ effects: this.wrapping.reconfigure(wraps ? [EditorView.lineWrapping, hanging, depths] : []) });
  }

  /** Show behind lines what was found of them. @param {Verdict[]} found */
  judge(found) {
    this.view.dispatch({ effects: judge.of(found) });
  }

  /** @param {string} name */
  extensions(name) {
    const { changed, save, nonce, root } = this.options;
    return [
      EditorView.cspNonce.of(nonce),
      keymap.of([
        { key: "Mod-s", preventDefault: true, run: () => (save(), true) },
        { key: "Escape", run: (view) => (view.contentDOM.blur(), true) },
        indentWithTab,
        ...jumpToDefinitionKeymap,
        ...formatKeymap,
      ]),
      basicSetup,
      yaml(),
      syntaxHighlighting(words),
      lintGutter(),
      EditorView.contentAttributes.of({ "aria-label": `text of ${name}`, tabindex: "0" }),
      EditorView.updateListener.of((update) => update.docChanged && changed(update.state.doc.toString())),
      look,
      verdicts,
      this.wrapping.of([]),
      this.client.plugin(uri(`${root}/${name}`), "yaml"),
    ];
  }

  get text() {
    return this.view.state.doc.toString();
  }

  /** Put another text in, as a change that can be undone, of what differs alone. @param {string} text */
  replace(text) {
    const now = this.text, most = Math.min(now.length, text.length);
    let from = 0, behind = 0;
    while (from < most && now[from] === text[from]) from++;
    while (behind < most - from && now[now.length - 1 - behind] === text[text.length - 1 - behind]) behind++;
    this.view.dispatch({
      changes: { from, to: now.length - behind, insert: text.slice(from, text.length - behind) },
      selection: { anchor: from },
      scrollIntoView: true,
    });
  }

  /** Go to a place. @param {number} number of the line, from 1 @param {number} column from 1 */
  goTo(number, column = 1) {
    const { doc } = this.view.state, line = doc.line(Math.max(1, Math.min(number, doc.lines)));
    const place = Math.min(line.to, line.from + Math.max(0, column - 1));
    this.view.dispatch({ selection: { anchor: place }, effects: EditorView.scrollIntoView(place, { y: "center" }) });
    this.view.focus();
  }
}

/** @param {string} path */
const uri = (path) => `file://${path.split("/").map(encodeURIComponent).join("/")}`;
