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
  const reachable = () => {
    for (const part of document.querySelectorAll(".table-wrapper, .highlight pre, div.math")) {
      if (part.scrollWidth > part.clientWidth) part.setAttribute("tabindex", "0");
      else part.removeAttribute("tabindex");
    }
  };
  reachable();
  addEventListener("resize", reachable);
});
