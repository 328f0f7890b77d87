"""Settings that turn a photograph into a map."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris._core.settings import check_settings, number, under_code, whole, word
from lampyris.errors import SettingError

CRITERIA = ("otsu", "kapur", "cross-entropy")
"""Criteria for thresholds."""
METHODS = ("exact", "gso", "igso", "pso")
"""Methods that search for thresholds."""
CHANNELS = ("luma", "red", "green", "blue")


@dataclass(frozen=True, slots=True)
class PhotoSettings:
    """How a photograph is divided into classes of grey levels, and its pixels into cells; see docs/photos.md.

    Parameters
    ----------
    thresholds : number of thresholds; there is one class more, and a level at a threshold belongs to the darker
        class.
    criterion : criterion for thresholds: ``otsu``, the variance between classes; ``kapur``, the sum of the
        entropies of the classes; ``cross-entropy``, the least cross-entropy between the photograph and its classes.
    by : search method: ``exact``, dynamic programming; ``gso``, ``igso`` or ``pso``, a swarm.
    channel : of a colour photograph: ``luma`` (brightness by Rec.601), ``red``, ``green`` or ``blue``.
    median : side of the square of a median filter, odd; 1: none.
    cell : side of a cell in pixels.
    free_share : share of the pixels of a cell that must be free for the cell to be free; half of them is never enough.

    Raises
    ------
    SettingError : ``PHOTO_SETTING``.
    """

    thresholds: int = whole(1, 1, 15)
    criterion: str = word(CRITERIA[0], CRITERIA)
    by: str = word(METHODS[0], METHODS)
    channel: str = word(CHANNELS[0], CHANNELS)
    median: int = whole(1, 1, 9, unit="pixels")
    cell: int = whole(1, 1, 4096, unit="pixels")
    free_share: float = number(0.5, 0.5, 1.0)

    def __post_init__(self) -> None:
        check_settings(self, under_code("PHOTO_SETTING", ""))
        if self.median % 2 == 0:
            allowed = "an odd whole number from 1 to 9 pixels"
            raise SettingError.of("PHOTO_SETTING", "median", f"{self.median}", allowed=allowed)
