// Drives: how a robot drives in continuous time, by which controller, and which others are compared with it.

import { driver } from "./driven.js";
import { field } from "./fields.js";
import { block, button, el, fill } from "./make.js";
import { Form } from "./settings.js";
import { plansPoses, plansTimes } from "./shape.js";

/** @typedef {import("./fields.js").Setting} Setting */

const EXACT = "exact";
const ABOUT_EXACT = "The path is followed exactly; only the speed is decided.";

/** @param {Page} page @param {HTMLElement} into */
export function mount(page, into) {
  const made = block(into, "drives", "Drive");
  if (!made) return;
  into.querySelector(":scope > .planner")?.after(made);
  page.driver = driver;
  const { store } = page;
  const now = () => store.scenario.drive ?? {};
  /** Settings of controllers that were left, so that going back finds them. @type {Map<string, Record<string, unknown>>} */
  const left = new Map();
  const settingsOf = (/** @type {string} */ name) => left.get(name) ?? store.scenario.controllers?.find((one) => one.name === name)?.settings ?? {};

  const timed = field({
    name: "continuous time", type: "flag", default: false, choices: null, least: null, most: null, allowed: "",
    about: "Drive in continuous time, with bounded accelerations, instead of a simulation in ticks.",
  }, (value) => store.set({ drive: value ? {} : undefined }));
  const pick = el("select", { "aria-label": "Controller" }, ...[EXACT, ...page.hello.controllers.map((/** @type {any} */ row) => row.name)]
    .map((name) => el("option", { value: name }, name)));
  pick.addEventListener("change", () => {
    const { controller = EXACT, controller_settings = {}, ...rest } = now();
    left.set(controller, controller_settings);
    const settings = settingsOf(pick.value);
    const chosen = pick.value === EXACT ? {} : { controller: pick.value, ...(Object.keys(settings).length ? { controller_settings: settings } : {}) };
    store.set({ drive: { ...rest, ...chosen }, controllers: (store.scenario.controllers ?? []).filter(({ name }) => name !== pick.value) });
  });
  const about = el("p");
  const own = new Form(page, (settings) => {
    const { controller_settings, ...rest } = now();
    return { drive: { ...rest, ...(Object.keys(settings).length ? { controller_settings: settings } : {}) } };
  }, "controller");
  const rivals = el("div", { class: "row rivals" });
  const others = el("fieldset", { class: "stack plain" }, el("legend", null, "Compare with, in the same scene"), rivals);
  const form = new Form(page, (settings) => {
    const { controller, controller_settings } = now();
    return { drive: { ...(controller ? { controller } : {}), ...(controller_settings ? { controller_settings } : {}), ...settings } };
  }, "drive");
  const go = button("Drive", () => void page.simulate({ tick: 0, play: true }), { class: "btn primary" });
  const stop = button("Stop", () => page.stop(), { hidden: true });
  const said = el("p", { class: "hint", role: "status" });
  const controllers = el("div", { class: "stack" }, pick, about, own.root, others);
  // The buttons come first: what a field says of itself goes when it is left, and would move them away under a press.
  made.append(el("div", { class: "row" }, go, stop), said, timed.row, controllers, form.root);

  const show = () => {
    const poses = plansPoses(page);
    const drives = page.drives();
    const { controller = EXACT, controller_settings = {}, ...rest } = now();
    timed.row.hidden = poses;
    timed.put(drives);
    controllers.hidden = !poses || plansTimes(page);
    form.root.hidden = go.hidden = said.hidden = !drives;
    pick.value = controller;
    const row = page.hello.controllers.find((/** @type {any} */ one) => one.name === controller);
    about.textContent = row ? `${row.summary[0].toUpperCase()}${row.summary.slice(1)} (${row.source}).` : ABOUT_EXACT;
    own.show(controller, row?.settings ?? [], controller_settings);
    if (drives) form.show("drive", page.hello.drive, rest);
    const some = store.scenario.controllers ?? [];
    const names = [EXACT, ...page.hello.controllers.map((/** @type {any} */ one) => one.name)].filter((name) => name !== controller);
    const held = document.activeElement instanceof HTMLInputElement && rivals.contains(document.activeElement) ? document.activeElement.value : null;
    fill(rivals, ...names.map((name) => {
      const box = el("input", { type: "checkbox", value: name, onchange: () => store.set({
        controllers: names.flatMap((one) => {
          const old = some.find((rival) => rival.name === one);
          return (one === name ? box.checked : old) ? [old ?? { name: one, settings: settingsOf(one) }] : [];
        }),
      }) });
      box.checked = some.some((one) => one.name === name);
      return el("label", { class: "check" }, box, name);
    }));
    if (held) /** @type {HTMLElement | null} */ (rivals.querySelector(`[value="${held}"]`))?.focus();
  };
  const progress = () => {
    stop.hidden = !page.driving;
    said.textContent = page.driving;
  };
  store.listen(show);
  page.on("progress", progress);
  show();
  progress();
}
