// @ts-check
/** Makes elements, with text only: nothing from a scenario is ever read as HTML. */

/**
 * An element with attributes and children; a function as `onclick` and the like listens.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, any>} [attributes] those that are null or false are left out
 * @param {...(Node | string | null)} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  setAttributes(made, attributes);
  made.append(...children.filter((child) => child !== null));
  return made;
}

/** The same for a part of a drawing.
 * @param {string} tag @param {Record<string, any>} attributes @param {...(Node | string)} children */
export function makeSvg(tag, attributes, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  setAttributes(made, attributes);
  made.append(...children);
  return made;
}

/** @param {Element} element @param {Record<string, any>} attributes */
function setAttributes(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : String(value));
  }
}

/** A part of the page with a heading. @param {string} title @param {string} name @param {...(Node | string | null)} children */
export function panel(title, name, ...children) {
  const heading = make("h2", { id: `${name}-title` }, title);
  return make("section", { class: `panel ${name}`, "aria-labelledby": `${name}-title` }, heading, ...children);
}

/** A value as a scenario would say it. @param {any} value @returns {string} */
export function spoken(value) {
  if (value === null || value === undefined) return "nothing";
  if (Array.isArray(value)) return value.map(spoken).join(", ");
  if (typeof value === "object") return Object.entries(value).map(([key, part]) => `${key} ${spoken(part)}`).join(", ");
  return String(value);
}
