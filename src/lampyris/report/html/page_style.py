"""Html style: how pages look, on paper and screen, light and dark, wide and narrow."""

from __future__ import annotations

CSS = """\
:root {
  color-scheme: light dark;
  --paper: #fdfdfb; --raised: #f4f4f0; --ink: #20242c; --faint: #5b6370; --line: #dcdfe4; --grid: #e3e5e9;
  --link: #005b94; --good: #e2f1e7; --bad: #fae3dd; --mild: #fbf0d5;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #15181d; --raised: #1e2229; --ink: #e4e7ec; --faint: #a2abb8; --line: #353b45; --grid: #2c323b;
    --link: #7cc0ee; --good: #17352a; --bad: #45211a; --mild: #3d3315;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", Verdana, sans-serif;
}
main, footer { max-width: 76rem; margin: 0 auto; padding: 1.5rem 1.25rem; }
footer { color: var(--faint); font-size: 0.85rem; border-top: 1px solid var(--line); }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0.5rem 0 0.75rem; overflow-wrap: anywhere; }
h2 { font-size: 1.35rem; line-height: 1.3; margin: 2.75rem 0 0.75rem; padding-top: 0.75rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1.08rem; margin: 1.75rem 0 0.5rem; }
p, li, dd { max-width: 46rem; overflow-wrap: anywhere; }
p { margin: 0.6rem 0; }
ul { padding-left: 1.25rem; }
a { color: var(--link); }
code, pre { font: 0.88em/1.5 ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; }
code { overflow-wrap: anywhere; }
pre { background: var(--raised); border: 1px solid var(--line); border-radius: 6px; padding: 0.75rem 1rem;
  overflow-x: auto; }
.lead { font-size: 1.08rem; }
.note, figcaption, .small { color: var(--faint); font-size: 0.85rem; }
.note { margin: 0.4rem 0 0; max-width: 60rem; }
nav ul { list-style: none; padding: 0; display: flex; flex-wrap: wrap; gap: 0.25rem 1.1rem; margin: 1rem 0; }
.facts { margin: 1rem 0; display: grid; gap: 0.35rem 1.5rem; }
.facts > div { display: grid; grid-template-columns: 9rem minmax(0, 1fr); gap: 0 1rem; }
.facts dt { color: var(--faint); }
.facts dd { margin: 0; }
.tab, figure, details { margin: 1.25rem 0; }
.scroll { overflow-x: auto; max-width: 100%; }
.scroll:focus-visible { outline: 2px solid var(--link); outline-offset: 2px; }
table { border-collapse: collapse; font-size: 0.9rem; line-height: 1.35; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: 0 0 0.5rem; white-space: nowrap; }
th, td { text-align: left; padding: 0.32rem 0.7rem; vertical-align: top;
  border-bottom: 1px solid var(--line); }
td { white-space: nowrap; }
td.long { white-space: normal; min-width: 16rem; }
thead th { color: var(--faint); font-weight: 600; vertical-align: bottom;
  border-bottom: 2px solid var(--line); }
tbody th { font-weight: 500; white-space: nowrap; position: sticky; left: 0; background: var(--paper); }
.right { text-align: right; }
td small { color: var(--faint); font-size: 0.82em; }
.stacked th, .stacked td { padding: 0.32rem 0.4rem; }
.stacked td small { display: block; }
.stacked tbody th { white-space: normal; min-width: 7rem; }
tr.good > * { background: var(--good); }
tr.bad > * { background: var(--bad); }
tr.mild > * { background: var(--mild); }
tr.total > * { border-top: 2px solid var(--line); font-weight: 600; }
figure { margin-left: 0; margin-right: 0; }
figcaption { max-width: 60rem; margin-top: 0.4rem; }
.drawing svg { display: block; width: 100%; height: auto; }
.pair { display: grid; gap: 0 1.5rem;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 27rem), 1fr)); }
.pair > * { min-width: 0; }
img { max-width: 100%; height: auto; display: block; border-radius: 4px; }
.maps { display: flex; flex-wrap: wrap; gap: 1rem; padding: 0; margin: 1rem 0; }
.maps figure { margin: 0; width: 8rem; }
.maps img { width: 100%; image-rendering: pixelated; border: 1px solid var(--line); }
.films { display: flex; flex-wrap: wrap; gap: 1.25rem; }
.films figure { margin: 0.5rem 0; flex: 0 1 22rem; min-width: 0; }
summary { cursor: pointer; color: var(--link); padding: 0.25rem 0; }
@media (max-width: 40rem) {
  main, footer { padding: 1rem 0.9rem; }
  h1 { font-size: 1.5rem; }
  th, td { padding: 0.3rem 0.5rem; }
  .facts > div { grid-template-columns: minmax(0, 1fr); }
  .facts dd { margin-bottom: 0.4rem; }
  tbody th { white-space: normal; min-width: 6.5rem; max-width: 10rem; overflow-wrap: break-word; }
  caption span { display: inline-block; white-space: normal; max-width: calc(100vw - 2rem); }
}
@media print {
  body { font-size: 10pt; }
  .scroll { overflow: visible; }
}
"""
