// Making elements: text is only ever text, and styles are classes.

/** @typedef {string | Node | null | undefined | false} Part */

/**
 * An element with attributes and what is in it. `on...` are listeners, `class` and the like attributes; true is
 * an empty attribute, false and null none.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag @param {Record<string, any> | null} [set] @param {...Part} parts
 * @returns {HTMLElementTagNameMap[K]}
 */
export function el(tag, set, ...parts) {
  const made = document.createElement(tag);
  dress(made, set ?? {});
  made.append(...parts.filter(real));
  return made;
}

/** The same for pictures. @param {string} tag @param {Record<string, any>} set @param {...Part} parts */
export function svg(tag, set, ...parts) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  dress(made, set);
  made.append(...parts.filter(real));
  return made;
}

/** A line that says how something goes. @param {HTMLElement | undefined} line @param {string} words @param {boolean} [bad] */
export function tell(line, words, bad = false) {
  if (!line) return;
  line.textContent = words;
  line.classList.toggle("bad", bad);
}

/** Whether this is a screen that is touched; without a screen, as under Node.js, it is not. */
export const TOUCH = { matches: false };
// Reading a media query makes the browser recompute the styles of the page, which is too slow for each move of a drag.
const coarse = globalThis.matchMedia?.("(pointer: coarse)");
if (coarse) {
  TOUCH.matches = coarse.matches;
  coarse.addEventListener("change", () => { TOUCH.matches = coarse.matches; });
}

/** A hint in the words of the screen: a finger taps where a mouse clicks. @param {string} text */
export function tapped(text) {
  return TOUCH.matches ? text.replaceAll("click", "tap").replaceAll("Click", "Tap") : text;
}

/** A line drawing of 20 by 20. @param {string} path */
export function icon(path) {
  return svg("svg", { viewBox: "0 0 20 20", "aria-hidden": "true" }, svg("path", { d: path }));
}

/** @param {Part} part @returns {part is string | Node} */
function real(part) {
  return part !== null && part !== undefined && part !== false;
}

/** @param {Element} made @param {Record<string, any>} set */
function dress(made, set) {
  for (const [key, value] of Object.entries(set)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") made.addEventListener(key.slice(2), value);
    else made.setAttribute(key, value === true ? "" : String(value));
  }
}

/** @param {string} text @param {() => void} act @param {Record<string, any>} [set] */
export function button(text, act, set) {
  return el("button", { type: "button", class: "btn", onclick: act, ...set }, text);
}

/** A button that is a picture. @param {string} label @param {string} path @param {() => void} act @param {Record<string, any>} [set] */
export function iconButton(label, path, act, set) {
  return el("button", { type: "button", class: "btn quiet icon", title: label, "aria-label": label, onclick: act, ...set }, path && icon(path));
}

/** Words that only screen readers say. @param {string} text */
export function spoken(text) {
  return el("span", { class: "unseen" }, text);
}

/** Put other contents into an element. @param {Element} into @param {...Part} parts */
export function fill(into, ...parts) {
  into.replaceChildren(...parts.filter(real));
}

/** What is called by a name, for lists: its title, and the line by which it explains itself. @param {{name: string, title?: string, summary?: string}} row */
export function explained(row) {
  const { name, title = name, summary } = row;
  return summary ? `${title} \u2013 ${aboutOf(row)}` : title;
}

/** The explanation alone, with the name of a command line or a file where the title is another. @param {{name: string, title?: string, summary?: string}} row */
export function aboutOf({ name, title = name, summary = "" }) {
  const words = (summary.startsWith(`${title}: `) ? summary.slice(title.length + 2) : summary).replace(/\.$/, "");
  return title === name ? words : `${words} (${name})`;
}

/** A number with no more digits than it needs. @param {number | null | undefined} value @param {number} [digits] */
export function formatted(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (Number.isInteger(value)) return value.toLocaleString("en");
  const size = Math.abs(value);
  const places = size >= 1000 ? 0 : size >= 100 ? Math.min(digits, 1) : size >= 10 ? Math.min(digits, 2) : digits;
  return value.toLocaleString("en", { maximumFractionDigits: size < 0.01 ? 5 : places });
}

/** @param {ArrayLike<number>} cell */
export function spelled(cell) {
  return `(${cell[0]},${cell[1]})`;
}

/** A part of a section, made once for each page. @param {Element} into @param {string} name @param {string} title */
export function block(into, name, title) {
  const old = into.querySelector(`:scope > .${name}`);
  if (old) return null;
  const made = el("div", { class: `block ${name}`, role: "group", "aria-label": title }, el("h2", null, title));
  into.append(made);
  return made;
}

/** What went wrong, as a sentence. @param {unknown} error */
export function sentence(error) {
  return error instanceof Error ? error.message : String(error);
}
