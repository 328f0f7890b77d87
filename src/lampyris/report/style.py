"""Colours, and how a figure becomes the same bytes every time.

The landscape is cividis and the speeds are a middle stretch of inferno: both perceptually uniform and
readable with the common kinds of colour blindness; where two things could be told apart by colour alone they
also differ in shape or hatching.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import FileError, UsageError

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
START = "#c1121f"
GOAL = "#ffb703"
GATE = "#7b2cbf"
RING = "#ffffff"

CAUSES = {
    "start": "#999999",
    "goal": "#555555",
    "limit": "#0072b2",
    "acceleration": "#009e73",
    "braking": "#d55e00",
    "clearance": "#e69f00",
    "obstacle": "#cc79a7",
    "ring 1": "#e69f00",
    "ring 2": "#f0e442",
    "angle": "#56b4e9",
    "waiting": "#cc79a7",
}
"""Colour of each cause that binds a speed (Okabe and Ito's palette); others take :data:`SPARE` in order."""

SPARE = ("#882255", "#44aa99", "#ddcc77", "#332288", "#117733", "#aa4499")


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


def landscape_colours() -> Rgb:
    """256 colours for luciferin or cost, (256, 3): pale cividis, bright at the goal."""
    from matplotlib import colormaps

    ramp = colormaps["cividis_r"](np.linspace(0.0, 0.92, 256))[:, :3]
    out: Rgb = np.round(255 * (0.72 * ramp + 0.28)).astype(np.uint8)
    return out


def landscape_map() -> ListedColormap:
    """The same as a colour map for the bar beside it."""
    from matplotlib.colors import ListedColormap

    return ListedColormap(landscape_colours() / 255.0, name="lampyris-landscape")


def speed_map() -> ListedColormap:
    """Colours of speed, slow and dark to fast and bright: inferno without its darks, which its casing has."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["inferno"](np.linspace(0.3, 0.9, 256)), name="lampyris-speed")


def cause_colours(causes: tuple[str, ...]) -> dict[str, str]:
    """A colour for each cause that occurs, in order of first occurrence."""
    spare = iter(SPARE * (1 + len(causes) // len(SPARE)))
    return {c: CAUSES.get(c) or next(spare) for c in dict.fromkeys(causes)}


def save(figure: Figure, out: OutFile, suffix: str, dpi: int) -> None:
    """Write a figure as PNG or SVG: the same bytes for the same figure, no date, no version.

    Raises
    ------
    FileError : the system refuses.
    """
    from matplotlib import rc_context

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
