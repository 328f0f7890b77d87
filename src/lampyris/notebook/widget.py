"""The widget that scrubs a run. anywidget is imported when one is made."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.drive import Drive
from lampyris.model.trace import Trace
from lampyris.notebook.frames import frames_of


def scrub(run: Trace | Drive) -> Any:
    """A widget that shows a simulation or a drive at any moment: a slider, a button that plays it, the speed and its cause.

    Its trait ``frame`` is the number of the frame, which Python may set and observe; ``frames["t"]`` has their times.

    Parameters
    ----------
    run : what :func:`lampyris.simulate` or :func:`lampyris.drive` returned.

    Raises
    ------
    UsageError : ``NOTEBOOK``: anywidget is not installed.
    SettingError : ``TYPE``: something else.

    Examples
    --------
    >>> lampyris.notebook.scrub(lampyris.drive(scene, "ad-gso"))  # doctest: +SKIP
    """
    frames = frames_of(run)
    grid = run.scene.grid
    cells = np.where(grid.blocked, 1, 0).astype(np.uint8)
    if grid.unknown is not None:
        cells[grid.unknown] = 2
    return _kind()(frames=frames, cells=cells.tobytes(), shape=[grid.width, grid.height])


@cache
def _kind() -> Any:
    try:
        import anywidget
        import traitlets
    except ImportError:
        todo = "pip install 'lampyris[notebook]'"
        raise UsageError("NOTEBOOK", "anywidget is not installed", todo=todo) from None

    class Scrubber(anywidget.AnyWidget):
        """See :func:`scrub`."""

        _esm = files("lampyris.notebook").joinpath("scrub.js").read_text("utf-8")
        frames = traitlets.Dict().tag(sync=True)
        cells = traitlets.Bytes().tag(sync=True)
        shape = traitlets.List().tag(sync=True)
        frame = traitlets.Int(0).tag(sync=True)

    return Scrubber
