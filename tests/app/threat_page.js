// Put before everything of the page: what the browser refuses is written down, and so is whatever runs that should not.
window.refused = [];
window.hit = 0;
document.addEventListener("securitypolicyviolation", (event) => {
  window.refused.push(`${event.effectiveDirective} ${event.blockedURI} ${event.sample}`);
});
for (const name of ["alert", "confirm", "prompt", "print"]) window[name] = () => (window.hit += 1);

/** Elements and attributes of the document that could run or lead to somebody else. */
window.couldRun = () => {
  const found = [];
  for (const one of document.querySelectorAll("*")) {
    const tag = one.localName;
    if (["iframe", "object", "embed", "base", "form", "animate", "foreignobject", "marquee", "video"].includes(tag)) found.push(tag);
    if (tag === "script" && !one.src.startsWith(`${location.origin}/static/`)) found.push("script");
    if (tag === "style" || (tag === "meta" && one.httpEquiv)) found.push(tag);
    for (const { name, value } of one.attributes) {
      const leads = ["href", "src", "action", "xlink:href", "srcdoc", "data", "formaction"].includes(name);
      if (name.startsWith("on")) found.push(`${tag} ${name}`);
      // Named from the page, or from a module, which makes an address of the same server of it.
      const own = value.startsWith(`${location.origin}/static/`) || /^(\/static\/|blob:|#)/.test(value);
      if (leads && !own) found.push(`${tag} ${name}=${value}`);
    }
  }
  return found;
};

/** All that is there to be read, in fields and titles too. */
window.allWords = () => {
  const words = [document.title, document.body.textContent];
  for (const one of document.querySelectorAll("*")) {
    for (const name of ["title", "aria-label", "placeholder", "aria-valuetext", "alt"]) words.push(one.getAttribute(name) ?? "");
    if ("value" in one) words.push(String(one.value));
  }
  return words.join("\n");
};

/** Wait until something is true. */
window.until = async (when, ms = 10000) => {
  const end = performance.now() + ms;
  while (!when()) {
    if (performance.now() > end) return false;
    await new Promise((go) => setTimeout(go, 40));
  }
  return true;
};

/** Open a scenario as a link does, and wait until the page has said what it makes of it. */
window.openLink = async (scenario, seen, where = "body") => {
  const packed = new Blob([JSON.stringify(scenario)]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(packed).arrayBuffer());
  const text = btoa(String.fromCharCode(...bytes)).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
  const token = new URLSearchParams(location.hash.slice(1)).get("t");
  location.hash = `t=${token}&s=${text}`;
  const words = () => (where === "body" ? window.allWords() : document.querySelector(where).textContent);
  return window.until(() => words().includes(seen), 5000);
};

/** Give the page files, and all that it says until it is done. */
window.giveFiles = async (...files) => {
  const notes = document.getElementById("notes");
  notes.replaceChildren();
  const given = new DataTransfer();
  for (const [name, text] of files) given.items.add(new File([text], name));
  const input = document.querySelector("#library input[type=file]");
  input.files = given.files;
  input.dispatchEvent(new Event("change", { bubbles: true }));
  await window.until(() => notes.textContent !== "");
  return notes.textContent;
};

/** Press and turn everything of a panel; what was pressed. */
window.pressAll = async (panel, spared) => {
  const here = (one) => one.isConnected && one.offsetParent !== null && !one.disabled;
  const pause = (ms) => new Promise((go) => setTimeout(go, ms));
  const change = (one) => ["input", "change"].forEach((name) => one.dispatchEvent(new Event(name, { bubbles: true })));
  const done = new Set();
  await window.until(() => panel.childElementCount, 5000); // some are loaded when they are opened
  for (const one of panel.querySelectorAll("details")) one.open = true;
  for (const one of [...panel.querySelectorAll("input[type=checkbox], input[type=radio]")].slice(0, 12)) if (here(one)) one.click();
  for (const one of [...panel.querySelectorAll("input[type=number]")].slice(0, 10)) {
    if (!here(one)) continue;
    if (one.step === "any") one.value = String(Number(one.value) + 1);
    else one.stepUp();
    change(one);
  }
  for (const one of panel.querySelectorAll("select")) {
    for (const option of [...one.options].slice(0, 4)) {
      if (!here(one)) break;
      one.value = option.value;
      change(one);
      await pause(20);
    }
  }
  for (let round = 0; round < 80; round++) {
    await window.until(() => ![...panel.querySelectorAll("progress")].some(here), 5000);
    const name = (one) => one.getAttribute("aria-label") ?? one.textContent.trim();
    const next = [...panel.querySelectorAll("button")].find((one) => here(one) && !done.has(name(one)) && (!one.matches(".map-card") || done.size < 8) && !spared.some((word) => name(one).startsWith(word)));
    if (!next) break;
    done.add(name(next));
    next.click();
    await pause(30);
    document.querySelector("dialog[open]")?.close();
  }
  return [...done];
};
