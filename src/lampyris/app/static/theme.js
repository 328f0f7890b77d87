// The bar at the top: which scenario, undo and redo, the link, light and dark.

import { el, icon, iconButton } from "./make.js";
import { byId } from "./page.js";

const KEPT = "lampyris-theme";
const DARK = window.matchMedia("(prefers-color-scheme: dark)");
const ICONS = {
  undo: "M4 8h8a4 4 0 0 1 0 8H8M4 8l4-4M4 8l4 4", redo: "M16 8H8a4 4 0 0 0 0 8h4M16 8l-4-4M16 8l-4 4",
  link: "M8.5 11.5a3 3 0 0 0 4.3 0l2.4-2.4a3 3 0 0 0-4.3-4.3l-1 1M11.500 8.500a3 3 0 0 0-4.300 0l-2.400 2.400a3 3 0 0 0 4.300 4.300l1-1",
  light: "M10 6.500a3.500 3.500 0 1 0 0 7 3.500 3.500 0 0 0 0-7M10 2v1.500M10 16.500V18M2 10h1.500M16.500 10H18M4.300 4.300l1.100 1.100M14.600 14.600l1.100 1.100M15.700 4.300l-1.100 1.100M5.400 14.600l-1.100 1.100",
  dark: "M16 11.500A6.500 6.500 0 0 1 8.500 4a6.500 6.500 0 1 0 7.500 7.500",
  commands: "M3 5h14M3 10h9M3 15h6M16 12.500v6M13 15.500h6",
  auto: "M3 4h14v10H3zM7 17h6M10 4v10M10 6h5M10 9h5M10 12h5",
};

/** @param {Page} page @param {HTMLElement} bar */
export function mount(page, bar) {
  const { store } = page;
  const undo = iconButton("Undo (Ctrl+Z)", ICONS.undo, () => store.undo());
  const redo = iconButton("Redo (Ctrl+Shift+Z)", ICONS.redo, () => store.redo());
  const link = iconButton("Copy the link of this state (L)", ICONS.link, () => copyLink(page));
  const look = iconButton("", ICONS.auto, () => turnTheme(page));
  const help = iconButton("Keys and help (?)", "", () => page.tell("help"));
  help.textContent = "?";
  const palette = iconButton("Commands (Ctrl+K)", ICONS.commands, () => page.tell("palette"));
  bar.append(undo, redo, el("span", { class: "sep" }), palette, link, look, help);

  const apply = () => {
    const kept = preferred();
    page.dark = kept === "dark" || (kept === "auto" && DARK.matches);
    document.documentElement.dataset.theme = page.dark ? "dark" : "light";
    look.replaceChildren(icon(ICONS[kept]));
    const words = { auto: "as the system", light: "light", dark: "dark" }[kept];
    look.title = `Colours: ${words} (T)`;
    look.setAttribute("aria-label", look.title);
    page.map.setDark(page.dark);
    page.tell("theme", page.dark);
  };
  DARK.addEventListener("change", apply);
  page.on("turn-theme", apply);
  apply();

  const draw = () => {
    undo.disabled = !store.canUndo;
    redo.disabled = !store.canRedo;
  };
  store.listen(draw);
  draw();
  const where = byId("where");
  page.on("ground", () => {
    const { ground } = page;
    if (!ground) return;
    const metres = ground.resolution === 1 ? "" : `, ${ground.resolution} m a cell`;
    const name = el("b", {}, ground.name);
    where.replaceChildren(name, el("span", {}, `${ground.width} \u00d7 ${ground.height}${metres}`));
    document.title = `${ground.name} \u2013 lampyris`;
  });
  page.on("busy", (busy) => document.body.classList.toggle("busy", busy));
}

/** @returns {"auto" | "light" | "dark"} */
function preferred() {
  try {
    const kept = localStorage.getItem(KEPT);
    return kept === "light" || kept === "dark" ? kept : "auto";
  } catch {
    return "auto";
  }
}

/** The next of system, light and dark. @param {Page} page */
export function turnTheme(page) {
  const order = DARK.matches ? ["auto", "light", "dark"] : ["auto", "dark", "light"];
  const next = order[(order.indexOf(preferred()) + 1) % 3];
  try {
    localStorage.setItem(KEPT, next);
  } catch {
    // Not kept then.
  }
  page.tell("turn-theme");
}

/** @param {Page} page */
export async function copyLink(page) {
  const link = await page.link();
  try {
    await navigator.clipboard.writeText(link);
    page.say("Link copied. It holds the scenario and this start's token: it opens on this machine, while this lampyris app runs.", "good");
  } catch {
    page.say("The browser does not let this page copy; the link is in the address bar.");
  }
}
