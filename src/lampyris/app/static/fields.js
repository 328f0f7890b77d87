// Fields: one setting as a control, made from what the server says of it. A value that is not allowed is never
// passed on; the control says what is.

import { el } from "./make.js";

/**
 * A setting. `none`: what null is called, where null is allowed. `list`: numbers with commas between them.
 * @typedef {{
 *   name: string, title?: string, type: string, default: unknown, choices: string[] | null, least: number | null,
 *   most: number | null, about: string, allowed: string, none?: string, unit?: string,
 * }} Setting
 */

/**
 * A control: `put` shows a value, unless it is being typed.
 * @typedef {{row: HTMLElement, put: (value: unknown) => void}} Field
 */

let made = 0;

/** What null means where a setting may be null; empty: it may not. @param {Setting} setting */
function noneOf(setting) {
  return setting.none ?? (setting.default === null ? "none" : "");
}

/**
 * The field of a setting.
 * @param {Setting} setting
 * @param {(value: any, settled: boolean) => void} give called with each allowed value
 * @returns {Field}
 */
export function field(setting, give) {
  const id = `field-${++made}`;
  const switched = setting.choices?.join() === "on,off";
  /** @type {Field & {control: HTMLElement}} */
  const one = setting.type === "flag" || switched ? flag(setting, id, switched, give)
    : setting.choices ? choice(setting, id, give) : typed(setting, id, give);
  one.control.id = id;
  const about = setting.about;
  const known = setting.title && setting.allowed && setting.title !== setting.name ? ` (${setting.name})` : "";
  const words = `${(about && about !== setting.allowed ? about : setting.allowed) || ""}${known}`;
  if (words) {
    const hint = el("p", { class: "hint about", id: `${id}-about`, hidden: true }, words);
    one.control.setAttribute("aria-describedby", hint.id);
    one.row.append(hint);
    // The words appear where somebody looks: all of them at once would bury the controls.
    one.row.addEventListener("focusin", () => (hint.hidden = false));
    one.row.addEventListener("focusout", () => (hint.hidden = true));
    one.row.title = words;
  }
  return one;
}

/** @param {Setting} setting @param {string} id */
function label(setting, id) {
  const name = (setting.title ?? setting.name.replace(/^.*\./, "").replaceAll("_", " "));
  return el("label", { for: id }, name, setting.unit ? el("span", { class: "unit" }, ` ${setting.unit.replace(/2$/, "²").replace(/3$/, "³")}`) : null);
}

/** @param {HTMLElement} row @param {Setting} setting @param {unknown} value */
function changed(row, setting, value) {
  row.classList.toggle("changed", JSON.stringify(value) !== JSON.stringify(setting.default));
}

/** @param {Setting} setting @param {string} id @param {boolean} switched @param {(value: any, settled: boolean) => void} give */
function flag(setting, id, switched, give) {
  const control = el("input", { type: "checkbox" });
  const row = el("div", { class: "field flag" }, label(setting, id), control);
  control.addEventListener("change", () => {
    const value = switched ? (control.checked ? "on" : setting.default === null ? null : "off") : control.checked;
    changed(row, setting, value);
    give(value, true);
  });
  return { row, control, put: (/** @type {unknown} */ value) => {
    control.checked = value === true || value === "on";
    changed(row, setting, value);
  } };
}

/** @param {Setting} setting @param {string} id @param {(value: any, settled: boolean) => void} give */
function choice(setting, id, give) {
  const none = noneOf(setting);
  const control = el("select", null, none ? el("option", { value: "" }, none) : null,
    ...(setting.choices ?? []).map((word) => el("option", { value: word }, word)));
  const row = el("div", { class: "field" }, label(setting, id), control);
  control.addEventListener("change", () => {
    const value = control.value || null;
    changed(row, setting, value);
    give(value, true);
  });
  return { row, control, put: (/** @type {unknown} */ value) => {
    control.value = String(value ?? "");
    changed(row, setting, value);
  } };
}

/** A number, a whole one, or a list of numbers. @param {Setting} setting @param {string} id @param {(value: any, settled: boolean) => void} give */
function typed(setting, id, give) {
  const none = noneOf(setting);
  const list = Array.isArray(setting.default);
  const control = el("input", {
    type: "text", inputmode: list ? null : setting.type === "whole" ? "numeric" : "decimal", autocomplete: "off",
    spellcheck: "false", placeholder: none || null,
  });
  const row = el("div", { class: "field" }, label(setting, id), control);
  const wrong = el("p", { class: "hint bad", role: "alert", hidden: true });
  row.append(wrong);
  const read = (/** @type {boolean} */ settled) => {
    const found = valueOf(setting, control.value.trim(), none);
    const bad = found === undefined;
    control.setAttribute("aria-invalid", String(bad));
    // What is half typed is not called wrong: -, 0. and the like are on their way.
    wrong.hidden = !bad || !settled;
    wrong.textContent = bad ? `Allowed: ${allowed(setting, none)}.` : "";
    if (bad) return;
    changed(row, setting, found);
    give(found, settled);
  };
  control.addEventListener("input", () => read(false));
  control.addEventListener("change", () => read(true));
  control.addEventListener("keydown", (event) => {
    const up = event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0;
    if (!up || list || control.value.trim() === "") return;
    event.preventDefault();
    control.value = String(stepped(setting, Number(control.value), up * (event.shiftKey ? 10 : 1)));
    read(false);
  });
  return { row, control, put: (/** @type {unknown} */ value) => {
    if (document.activeElement === control && valueOf(setting, control.value.trim(), none) === value) return;
    control.value = value === null || value === undefined ? "" : list ? /** @type {any} */ (value).join(", ") : String(value);
    control.setAttribute("aria-invalid", "false");
    wrong.hidden = true;
    changed(row, setting, value);
  } };
}

/** What a text says; undefined: nothing that is allowed. @param {Setting} setting @param {string} text @param {string} none */
function valueOf(setting, text, none) {
  if (text === "") return none ? null : undefined;
  if (Array.isArray(setting.default)) {
    const some = text.split(",").map((part) => Number(part));
    return some.some((v) => !Number.isFinite(v)) || text.endsWith(",") ? undefined : some;
  }
  const value = Number(text);
  if (!Number.isFinite(value) || (setting.type === "whole" && !Number.isSafeInteger(value))) return undefined;
  if (setting.least !== null && value < setting.least) return undefined;
  return setting.most !== null && value > setting.most ? undefined : value;
}

/** @param {Setting} setting @param {string} none */
function allowed(setting, none) {
  const or = none ? `, or empty: ${none}` : "";
  if (Array.isArray(setting.default)) return `${setting.default.length} numbers with commas${or}`;
  const kind = setting.type === "whole" ? "a whole number" : "a number";
  const { least, most } = setting;
  if (least !== null && most !== null) return `${kind}, ${least} to ${most}${or}`;
  return `${setting.allowed || kind}${or}`;
}

/** The next value up or down: 1 for whole numbers, else one in the second digit. @param {Setting} setting @param {number} value @param {number} by */
function stepped(setting, value, by) {
  const step = setting.type === "whole" ? 1 : 10 ** Math.floor(Math.log10(Math.abs(value) || 1) - 1 + 1e-9);
  const next = Number((value + by * step).toPrecision(12));
  return Math.min(Math.max(next, setting.least ?? -Infinity), setting.most ?? Infinity);
}
