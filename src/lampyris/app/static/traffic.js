// Traffic: what was drawn on the map, in words, below the numbers of the settings.

import { el } from "./make.js";

/** @param {Page} page @param {HTMLElement} pane */
export function mount(page, pane) {
  const { store } = page;
  const draw = el("button", { type: "button", class: "btn", "aria-pressed": String(page.tool === "patrol"), onclick: () => page.use("patrol") }, "Draw a patrol on the map");
  pane.append(draw);
  const list = el("ul", { class: "plain" });
  const none = el("p", { class: "hint" }, "None. Paint with the brush (B); while a run is shown, the wall comes at that moment and the run is made again from there.");
  const box = el("div", { class: "walls" }, el("h2", {}, "Painted walls"), none, list);
  pane.append(box);

  const show = () => {
    const { edits } = store.scenario;
    none.hidden = edits.length > 0;
    list.replaceChildren(...edits.map((edit) => {
      const when = edit.tick ? `at tick ${edit.tick}` : "before the start";
      const parts = [];
      if (edit.blocked.length) parts.push(`${edit.blocked.length.toLocaleString("en")} walls`);
      if (edit.freed.length) parts.push(`${edit.freed.length.toLocaleString("en")} freed`);
      const gone = el("button", { type: "button", class: "btn quiet icon", "aria-label": `Take back what was painted ${when}`, title: "Take back",
        onclick: () => store.set({ edits: store.scenario.edits.filter((one) => one !== edit) }) }, "\u00d7");
      const to = el("button", { type: "button", class: "btn quiet grow", disabled: !page.run || !edit.tick, onclick: () => page.play.seek(edit.tick) }, `${when}: ${parts.join(", ")}`);
      return el("li", { class: "row" }, to, gone);
    }));
  };
  store.listen(show);
  page.on("run", show);
  page.on("tool", (tool) => draw.setAttribute("aria-pressed", String(tool === "patrol")));
  show();
}
