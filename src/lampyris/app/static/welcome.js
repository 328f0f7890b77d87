// Welcome: for who is here for the first time, what is on the screen and what to do first.

import { brought } from "./later.js";
import { el, sentence } from "./make.js";

const KEPT = "lampyris-welcomed";

/** @param {Page} page @param {HTMLElement} element */
export function mount(page, element) {
  if (seen()) return;
  const leave = () => {
    element.hidden = true;
    keep();
  };
  const tour = el("button", { type: "button", class: "btn", onclick: async () => {
    try {
      const [steps] = await brought(page, "firststeps");
      leave();
      steps.begin(page);
    } catch (error) {
      page.say(sentence(error), "bad");
    }
  } }, "Take the tour");
  const away = el("button", { type: "button", class: "away", "aria-label": "Close the welcome", title: "Close", onclick: () => {
    leave();
    page.map.canvas.focus();
  } }, "\u00d7");
  element.classList.add("welcome", "card");
  element.append(
    el("div", { class: "row" }, el("h2", { class: "grow" }, "New here?"), away),
    el("p", {}, "The robot drives along the line from S to G, around the black walls; anything else on the map is a moving obstacle. Drag S or G, or press ",
      el("b", {}, "Play"), " under the map."),
    el("div", { class: "row" }, tour, el("span", { class: "hint" }, "five steps")),
  );
  element.hidden = false;
  // Who plays has found the way. What plays by itself at first is nobody's doing.
  let own = false;
  page.on("opening", () => (own = true));
  page.on("play", () => {
    if (own) own = !page.play.playing;
    else if (page.play.playing && !element.hidden) leave();
  });
}

function seen() {
  try {
    return localStorage.getItem(KEPT) !== null;
  } catch {
    return false;
  }
}

function keep() {
  try {
    localStorage.setItem(KEPT, "1");
  } catch {
    // It comes again then.
  }
}
