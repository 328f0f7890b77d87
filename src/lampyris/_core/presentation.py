"""How nouns reach what shows them: functions that the package puts here, so that the model imports nothing above it.

``lampyris/__init__.py`` fills them when the package is loaded, with functions that load their module when they are
first called.
"""

from collections.abc import Callable
from typing import Any

html_of: Callable[[Any], str] | None = None
"""A noun as HTML for a notebook."""

frame_of: Callable[..., Any] | None = None
"""A noun as a pandas DataFrame."""

array_of: Callable[..., Any] | None = None
"""A grid as an xarray Dataset."""

irsim_grid: Callable[..., Any] | None = None
"""A grid from a map of IR-SIM."""
