"""Svg page: a figure of matplotlib as SVG for a page: small, in the page's own colours and font."""

from __future__ import annotations

import io
import re
import warnings
from typing import TYPE_CHECKING, Any

from lampyris._core.cancellation import uninterrupted
from lampyris.report.style import INK

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FAINT", "GRID", "INK", "PAPER", "clean", "figure_of", "inline"]

FAINT, GRID, PAPER = "#5b6370", "#e3e5e9", "#fdfdfb"
_VARIABLES = {INK: "--ink", FAINT: "--faint", GRID: "--grid", PAPER: "--paper"}
"""Colours that a page has of its own, light and dark; the plain one stands beside for any other place."""

_FONT = "'DejaVu Sans', Verdana, sans-serif"


def figure_of(width: float, height: float) -> Figure:
    """An empty figure, inches, without paper of its own."""
    with uninterrupted():
        from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=100)
    figure.patch.set_visible(False)
    return figure


def clean(words: str, most: int) -> str:
    """A name as a figure can show it: one line, not too long, nothing that is taken for a formula."""
    if not words.isprintable():
        words = "".join(c if c.isprintable() else repr(c)[1:-1] for c in words)
    if len(words) > most:
        words = words[: most - 3] + "..."
    return words.replace("$", r"\$")


def inline(figure: Figure, name: str) -> str:
    """A figure as an SVG element; ``name`` sets its ids apart from those of the page's other figures."""
    with uninterrupted():
        from matplotlib import rc_context

    for axes in figure.axes:
        axes.patch.set_visible(False)
    out = io.StringIO()
    fixed: Any = {"svg.hashsalt": "lampyris", "svg.fonttype": "none", "font.family": "DejaVu Sans"}
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with rc_context(fixed), warnings.catch_warnings():
        # A name may be in letters that DejaVu Sans has not; the page's font then has them.
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        figure.savefig(out, format="svg", metadata=nothing)
    inches = float(figure.get_figwidth())
    size = f' style="min-width: {4.9 * inches:.1f}rem; max-width: {6.6 * inches:.1f}rem"'
    return _smaller(out.getvalue(), name, size)


def _smaller(words: str, name: str, size: str) -> str:
    """Only the element itself, without what nothing in it needs, as large as its words are to be read."""
    words = words[words.index("<svg") :].rstrip()
    words = re.sub(r"\s*<metadata>.*?</metadata>", "", words, flags=re.DOTALL)
    words = re.sub(r"\s*<!--.*?-->", "", words, flags=re.DOTALL)
    words = re.sub(r'(<svg[^>]*?) width="[^"]*" height="[^"]*"', rf"\1{size}", words, count=1)
    used = frozenset(re.findall(r'(?:href="#|url\(#)([^")]+)', words))
    words = re.sub(r"<[^>]*>", lambda match: _tag(match[0], name, used), words)
    words = re.sub(r"\n\s*", "\n", words)
    return re.sub(r"<g>\n</g>\n", "", words)


def _tag(words: str, name: str, used: frozenset[str]) -> str:
    """One tag: ids made unique or left out, colours and font of the page, coordinates to a hundredth."""
    words = re.sub(r' id="([^"]*)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in used else "", words)
    words = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", words)
    words = words.replace("'DejaVu Sans'", _FONT)
    for colour, variable in _VARIABLES.items():
        words = words.replace(colour, f"var({variable}, {colour})")
    return re.sub(r"(\d\.\d\d)\d+", r"\1", words)
