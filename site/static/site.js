// What the theme leaves out for those who use a screen reader or the keyboard alone.

document.addEventListener("DOMContentLoaded", () => {
  // The search page has none.
  if (!document.querySelector("h1")) {
    const heading = document.createElement("h1");
    heading.textContent = document.title.split(" - ")[0];
    document.querySelector("article")?.prepend(heading);
  }
  for (const caption of document.querySelectorAll(".caption[role=heading]")) caption.setAttribute("aria-level", "2");
  for (const [place, name] of [["sidebar-drawer", "All pages"], ["toc-drawer", "This page"]]) {
    document.querySelector(`aside.${place}`)?.setAttribute("aria-label", name);
  }
  // The titles of the gallery's pictures are drawn beside their links, which have no text of their own.
  for (const link of document.querySelectorAll(".sphx-glr-thumbcontainer a")) {
    link.setAttribute("aria-label", link.textContent.trim());
  }
  // Commands are wrapped (site.css); listings are not.
  for (const part of document.querySelectorAll(".highlight pre")) {
    if (/^(lampyris|python|pip|make) /.test(part.textContent)) part.classList.add("commands");
  }
  for (const table of document.querySelectorAll("article table.docutils")) {
    if (table.querySelectorAll("tr:first-child > *").length <= 3) table.classList.add("wrapped");
  }
  for (const film of document.querySelectorAll("article img[src$='.webp']")) stoppable(film);
  const reachable = () => {
    for (const part of document.querySelectorAll(".table-wrapper, .highlight pre, div.math")) {
      if (part.scrollWidth > part.clientWidth) part.setAttribute("tabindex", "0");
      else part.removeAttribute("tabindex");
    }
  };
  reachable();
  addEventListener("resize", reachable);
});

// A film plays by itself and without an end: it can be stopped, and waits where less motion is asked for.
function stoppable(film) {
  const frame = document.createElement("div");
  const still = document.createElement("canvas");
  const button = document.createElement("button");
  frame.className = "film";
  film.replaceWith(frame);
  frame.append(film, still, button);
  still.hidden = true;
  still.setAttribute("role", "img");
  still.setAttribute("aria-label", film.alt);
  const play = (playing) => {
    if (!playing) {
      still.width = film.naturalWidth;
      still.height = film.naturalHeight;
      still.getContext("2d").drawImage(film, 0, 0);
    }
    film.hidden = !playing;
    still.hidden = playing;
    button.textContent = playing ? "Stop the film" : "Play the film";
  };
  button.addEventListener("click", () => play(film.hidden));
  play(true);
  const quiet = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (quiet) film.decode().then(() => play(false), () => {});
}
