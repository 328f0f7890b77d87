"""Colours, and how a figure becomes the same bytes every time.

The landscape is cividis and the speeds are a middle stretch of inferno: both perceptually uniform and
readable with the common kinds of colour blindness; where two things could be distinguished by colour alone they
also differ in shape or hatching. Terrain goes from the white of free ground to ochre, and its lightness alone
says how costly it is: the costliest is still far lighter than a wall, and unknown cells are hatched.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import uninterrupted
from lampyris.errors import FileError, UsageError
from lampyris.model.grid import MAX_TERRAIN, TERRAIN_UNIT
from lampyris.typing import ByteGrid

if TYPE_CHECKING:
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

OutFile: TypeAlias = str | os.PathLike[str]
Rgb: TypeAlias = NDArray[np.uint8]

INK = "#20242c"
FAINT = "#6b7280"
FREE = (250, 249, 245)
WALL = (32, 36, 44)
UNKNOWN = (178, 184, 194)
UNKNOWN_STRIPE = (142, 149, 161)
CUT_OFF = (226, 226, 228)
COSTLY = (186, 150, 96)
"""Terrain of the highest value, five times plain ground; what lies between is mixed with FREE."""
CHEAP = 0.14
"""Share of COSTLY in the lowest terrain there is, to distinguish it from plain ground."""
START = "#04a560"
GOAL = "#b6101c"
PATH = "#c1121f"
"""Of a path that is not coloured by speed."""
FOOTPRINT = "#ffb703"
GATE = "#7b2cbf"
RING = "#ffffff"

CAUSES = {
    "start": "#626262",
    "goal": "#3c3c3c",
    "limit": "#0072b2",
    "acceleration": "#009e73",
    "braking": "#d55e00",
    "clearance": "#e69f00",
    "curvature": "#56b4e9",
    "moving obstacle": "#cc79a7",
    "zone": "#f0e442",
    "uncertainty": "#2e002b",
    "undecided": "#000571",
    "blind area": "#882af5",
    "three speeds": "#811d00",
    "danger": "#004b69",
    "approach": "#e236f5",
    "turn": "#f5b5a7",
    "wait": "#ee1540",
    "jerk": "#c9efd2",
    "yaw rate": "#3a742e",
    "no data": "#000000",
    "obstacle": "#8208bc",
    "waiting": "#a7ba6e",
    # Of the laws of ticks and of transfers, which have none of the above but the first six.
    "ring 1": "#e69f00",
    "ring 2": "#f0e442",
    "angle": "#56b4e9",
}
"""Colour of each cause that binds a speed. Okabe and Ito's palette for the frequent ones; the others were
searched for by chance, so that any two that can meet are far apart to the colour-blind too: at least 12 in
CIELAB, with and without each of the three kinds. Causes not named here take :data:`SPARE` in order."""

FLEET = (
    (0, 114, 178), (230, 120, 0), (0, 135, 95), (200, 30, 60), (123, 44, 191), (86, 180, 233), (240, 200, 40),
    (204, 121, 167), (130, 90, 40), (90, 170, 60), (60, 70, 160), (240, 130, 120),
)  # fmt: skip
"""Colours of the robots of a fleet, by turns: Okabe and Ito's and darker ones; a robot's number tells it apart, not
its colour alone."""

RACE = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (122, 92, 0))
"""Colours of the planners of a race, in their order: Okabe and Ito's, and brown for their orange; as the app has them."""

SPARE = ("#882255", "#44aa99", "#ddcc77", "#332288", "#117733", "#aa4499")


LAWS = {
    "physical": ("#0072b2", "solid"),
    "optimum": ("#20242c", "dashed"),
    "constant": ("#8a8f98", "dashdot"),
    "dissertation": ("#d55e00", "solid"),
    "rpp": ("#009e73", "solid"),
    "uncertainty": ("#2e002b", "solid"),
    "blind": ("#882af5", "solid"),
    "three-speed": ("#811d00", "solid"),
    "cloud": ("#e69f00", "solid"),
}
"""Colour and line of each speed law in a comparison."""


def suffix_of(out: OutFile, allowed: tuple[str, ...]) -> str:
    """The suffix of a file to be written, in lower case.

    Raises
    ------
    UsageError : it is none of ``allowed``.
    """
    suffix = Path(out).suffix.lower()
    if suffix not in allowed:
        raise UsageError(
            "SUFFIX",
            f"suffix {suffix!r}",
            where=str(out),
            allowed="a name that ends in " + " or ".join(allowed),
        )
    return suffix


def cannot_write(out: OutFile, error: OSError) -> FileError:
    """The error for a file that the system refuses to write."""
    return FileError(
        "FILE_WRITE", error.strerror or str(error), where=str(out), allowed="a file that can be written"
    )


def terrain_colours() -> Rgb:
    """A colour for each terrain value, uint8 (253, 3): that of free ground for 0, then ever darker ochre."""
    share = CHEAP + (1 - CHEAP) * np.arange(MAX_TERRAIN + 1) / MAX_TERRAIN
    share[0] = 0.0
    free, costly = (np.array(c, dtype=np.float64) for c in (FREE, COSTLY))
    out: Rgb = np.round(free + share[:, None] * (costly - free)).astype(np.uint8)
    return out


def terrain_range(terrain: ByteGrid) -> tuple[int, int]:
    """The least and the greatest value of a map's terrain, plain ground left out."""
    used = np.flatnonzero(np.bincount(index_array(terrain.ravel()))[1:]) + 1
    return int(used[0]), int(used[-1])


def terrain_label(least: int, most: int) -> str:
    """``terrain 1.8-5x``: what entering such cells costs, plain ground being 1."""
    low, high = (f"{(TERRAIN_UNIT + c) / TERRAIN_UNIT:.2g}" for c in (least, most))
    return f"terrain {low}x" if low == high else f"terrain {low}-{high}x"


def landscape_colours() -> Rgb:
    """256 colours for luciferin or cost, (256, 3): pale cividis, bright at the goal."""
    with uninterrupted():
        from matplotlib import colormaps

    ramp = colormaps["cividis_r"](np.linspace(0.0, 0.92, 256))[:, :3]
    out: Rgb = np.round(255 * (0.72 * ramp + 0.28)).astype(np.uint8)
    return out


def landscape_map() -> ListedColormap:
    """The same as a colour map for the bar beside it."""
    with uninterrupted():
        from matplotlib.colors import ListedColormap

    return ListedColormap(landscape_colours() / 255.0, name="lampyris-landscape")


def speed_map() -> ListedColormap:
    """Colours of speed, slow and dark to fast and bright: inferno without its darks, which its casing has."""
    with uninterrupted():
        from matplotlib import colormaps
        from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["inferno"](np.linspace(0.3, 0.9, 256)), name="lampyris-speed")


def cause_colours(causes: tuple[str, ...]) -> dict[str, str]:
    """A colour for each cause that occurs, in order of first occurrence."""
    spare = iter(SPARE * (1 + len(causes) // len(SPARE)))
    return {c: CAUSES.get(c) or next(spare) for c in dict.fromkeys(causes)}


def law_look(name: str) -> tuple[str, str]:
    """Colour and kind of line of a speed law."""
    return LAWS.get(name, (FAINT, "dotted"))


def save(figure: Figure, out: OutFile, suffix: str, dpi: int) -> None:
    """Write a figure as PNG or SVG: the same bytes for the same figure, no date, no version.

    Raises
    ------
    FileError : the system refuses.
    """
    with uninterrupted():
        from matplotlib import rc_context
        from matplotlib.text import Text

    for words in figure.findobj(Text):
        # A map may be called $\href{x}$: a name is words, and no formula.
        words.set_parse_math(False)
    metadata: dict[str, Any]
    if suffix == ".svg":
        metadata = {"Date": None, "Creator": None}
    else:
        metadata = {"Software": None}
    try:
        with rc_context({"svg.hashsalt": "lampyris", "svg.fonttype": "path", "font.family": "DejaVu Sans"}):
            figure.savefig(out, format=suffix[1:], dpi=dpi, metadata=metadata)
    except OSError as error:
        raise cannot_write(out, error) from None


def with_alpha(colour: str, alpha: float) -> tuple[float, float, float, float]:
    """A colour ``#rrggbb`` as shares of red, green and blue, and how much it covers."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue, alpha
