// @ts-check
/** The studio's editor: CodeMirror over the project's language server. Bundled into socialai_dsl/studio/static/editor.js. */
import { basicSetup } from "codemirror";
import { indentWithTab } from "@codemirror/commands";
import { HighlightStyle, syntaxHighlighting } from "@codemirror/language";
import { tags } from "@lezer/highlight";
import { yaml } from "@codemirror/lang-yaml";
import { lintGutter } from "@codemirror/lint";
import { LSPClient, hoverTooltips, jumpToDefinitionKeymap, serverCompletion, serverDiagnostics, formatKeymap } from "@codemirror/lsp-client";
import { EditorState } from "@codemirror/state";
import { EditorView, keymap } from "@codemirror/view";

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
});

/** Colours of the page, which are light or dark as the page is. */
const words = HighlightStyle.define([
  { tag: [tags.propertyName, tags.definition(tags.propertyName)], color: "var(--accent)" },
  { tag: [tags.comment, tags.lineComment], color: "var(--quiet)", fontStyle: "italic" },
  { tag: [tags.string, tags.content], color: "var(--ink)" },
  { tag: [tags.number, tags.bool, tags.keyword, tags.meta], color: "var(--good)" },
  { tag: [tags.punctuation, tags.separator, tags.squareBracket, tags.brace], color: "var(--quiet)" },
]);

/** An editor for one file after another; each file keeps its history of changes while the window is open. */
export class Editor {
  /**
   * @param {HTMLElement} parent
   * @param {{root: string, language: string, nonce: string, changed: (text: string) => void, save: () => void}} options
   *   root: folder of the files; language: address of the language server; nonce: that the page's policy names for
   *   styles; changed: told the text after each change; save: asked for by Ctrl-S
   */
  constructor(parent, options) {
    this.options = options;
    /** @type {Map<string, EditorState>} */ this.states = new Map();
    this.name = "";
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

  /** Show a file; with this text where it was not shown before.
   * @param {string} name @param {string} text */
  open(name, text) {
    if (this.name) this.states.set(this.name, this.view.state);
    this.name = name;
    this.view.setState(this.states.get(name) ?? EditorState.create({ doc: text, extensions: this.extensions(name) }));
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
      EditorView.contentAttributes.of({ "aria-label": `text of ${name}` }),
      EditorView.updateListener.of((update) => update.docChanged && changed(update.state.doc.toString())),
      look,
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

  /** Go to a line. @param {number} line from 1 */
  goTo(line) {
    const { doc } = this.view.state, place = doc.line(Math.max(1, Math.min(line, doc.lines))).from;
    this.view.dispatch({ selection: { anchor: place }, effects: EditorView.scrollIntoView(place, { y: "center" }) });
    this.view.focus();
  }
}

/** @param {string} path */
const uri = (path) => `file://${path.split("/").map(encodeURIComponent).join("/")}`;
