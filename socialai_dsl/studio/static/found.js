// @ts-check
/** Lists of what was found of a text, and the pages about findings. */
import { make } from "./dom.js";

/** @typedef {{file: string | null, line: number, column: number, message: string, help: string | null, notes: string[], code: string, error: boolean}} Finding */
/**
 * What a list leads to.
 * @typedef {object} Ways
 * @property {(place: {file: string | null, line: number, column: number}) => void} goTo
 * @property {(code: string) => void} explain
 */

/** A list of findings; each leads to its place and to the page about its code.
 * @param {Finding[]} findings @param {Ways} ways */
export function findingItems(findings, ways) {
  return findings.map((one) => make("li", { class: one.error ? "error" : "warning", onclick: besides(() => ways.goTo(one)) },
    make("p", {}, placeButton(one, ways), " ",
      make("button", { class: "link", title: `what ${one.code} is about, with an example`, onclick: () => ways.explain(one.code) }, one.code), " ", ...marked(one.message)),
    ...(one.help ? [make("p", { class: "help" }, "→ ", ...marked(one.help))] : []),
    ...(one.notes.length ? [make("pre", {}, one.notes.join("\n"))] : [])));
}

/** @param {{file: string | null, line: number, column: number}} place @param {Ways} ways */
export function placeButton(place, ways) {
  const { file, line, column } = place;
  return make("button", { class: "link", title: "go to the place", onclick: () => ways.goTo(place) }, `${file ? `${file}:` : ""}${line}:${column}`);
}

/** A click on an entry itself, not on a button in it nor to choose a piece of its text. @param {() => void} act */
export function besides(act) {
  return (/** @type {Event} */ event) => {
    if (event.target instanceof Element && !event.target.closest("button") && !String(getSelection())) act();
  };
}

/** A text of which what stands in backquotes is code. @param {string} text @returns {(Node | string)[]} */
export function marked(text) {
  return text.split("`").map((part, k) => (k % 2 ? make("code", {}, part) : part));
}

/** A page of Markdown as far as the pages about findings go: headings, paragraphs, code, tables as they are written.
 * @param {string} text */
export function page(text) {
  const made = make("div", { class: "page" });
  for (const [, language, code, heading, paragraph] of text.matchAll(/^```(\w*)\n([\s\S]*?)^```$|^#+ (.*)$|^((?:(?!```|#).+\n?)+)/gm)) {
    if (heading) made.append(make("h2", {}, ...marked(heading)));
    else if (paragraph) made.append(paragraph.startsWith("|") ? make("pre", {}, paragraph) : make("p", {}, ...marked(paragraph.replace(/\[([^\]]+)\]\([^)]*\)/g, "$1"))));
    else made.append(make("pre", { class: language }, code));
  }
  return made;
}
