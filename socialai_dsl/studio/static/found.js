// @ts-check
/** Lists of what was found of a text, and the pages about findings. */
import { make } from "./dom.js";

/** @typedef {{file: string | null, line: number, column: number, message: string, help: string | null, notes: string[], code: string, error: boolean}} Finding */
/**
 * What a list leads to.
 * @typedef {object} Ways
 * @property {(place: {file: string | null, line: number, column: number}) => void} goTo
 * @property {(code: string) => void} explain
 * @property {(shown: Shown) => void} show
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

/** @typedef {{room: Record<string, any>, variant: string, acts: string[] | null}} Shown */
/** @typedef {{file: string | null, line: number, column: number, claim: string, verdict: "holds" | "fails" | "undecided" | "not asked", said: string, shown: Shown | null}} Claim */
/** @typedef {{file: string | null, line: number, column: number, test: string, scenario: string, rooms: number, passes: boolean, findings: Finding[], shown: Shown | null}} TestResult */

/** @type {Record<string, {kind: "good" | "bad" | "open", text: string}>} */
const VERDICTS = {
  holds: { kind: "good", text: "✓ holds" },
  fails: { kind: "bad", text: "✗ fails" },
  undecided: { kind: "open", text: "? undecided" },
  "not asked": { kind: "open", text: "– not asked" },
  passes: { kind: "good", text: "✓ passes" },
};

/** @param {{verdict: string} | {passes: boolean}} one */
export const verdictOf = (one) => VERDICTS["verdict" in one ? one.verdict : one.passes ? "passes" : "fails"];

/** A list of claims, each with its verdict, what was found, and the room that speaks against it.
 * @param {Claim[]} claims @param {Ways} ways */
export function claimItems(claims, ways) {
  return claims.map((one) => make("li", { class: verdictOf(one).kind, onclick: besides(() => ways.goTo(one)) },
    make("p", {}, make("b", { class: "verdict" }, verdictOf(one).text), " ", placeButton(one, ways), " ", make("code", {}, one.claim)),
    make("p", { class: "help" }, ...marked(one.said)),
    ...(one.shown ? [showButton(one.shown, ways)] : [])));
}

/** A list of tests; of one that fails with what is wrong, and the room in which it is.
 * @param {TestResult[]} tests @param {Ways} ways */
export function testItems(tests, ways) {
  return tests.map((one) => make("li", { class: verdictOf(one).kind, onclick: besides(() => ways.goTo(one)) },
    make("p", {}, make("b", { class: "verdict" }, verdictOf(one).text), " ", placeButton(one, ways), " ", make("code", {}, one.test),
      make("small", { class: "quiet" }, ` ${one.scenario}${one.rooms > 1 ? `, in ${one.rooms} rooms` : ""}`)),
    ...one.findings.flatMap((finding) => [
      make("p", { class: "help" }, placeButton(finding, ways), " ", ...marked(finding.message)),
      ...(finding.notes.length ? [make("pre", {}, finding.notes.join("\n"))] : []),
    ]),
    ...(one.shown ? [showButton(one.shown, ways)] : [])));
}

/** @param {Shown} shown @param {Ways} ways */
function showButton(shown, ways) {
  const { acts } = shown;
  const what = acts === null ? "let the script play there, if there is one" : acts.length ? `then: ${acts.join(", ")}` : "before the first step";
  return make("p", { class: "help" }, make("button", { onclick: () => ways.show(shown) }, `▸ Show ${roomInWords(shown)}`), make("small", { class: "quiet" }, ` ${what}`));
}

/** @param {Shown} shown */
export function roomInWords({ room, variant }) {
  const which = room.test_episode !== undefined ? `test episode ${room.test_episode}` : `room ${room.index ?? 0} of seed ${room.seed ?? 0}`;
  return `${which}${room.layout ? ", as it is laid out" : ""}${variant ? `, ${variant}` : ""}`;
}
