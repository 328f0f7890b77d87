"""Delays: how often robots of a fleet are held up, and for how long."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris._core.noun import Noun
from lampyris._core.settings import check_settings, number, under_code


@dataclass(frozen=True, slots=True, repr=False)
class Delays(Noun):
    """Random delays of robots that drive: a robot brakes with its maximum deceleration, stands, and continues.

    Parameters
    ----------
    probability : chance that a move from one cell to the next is delayed, somewhere on the move.
    duration : mean time that it stands; drawn uniformly between 0 and twice this time.

    Raises
    ------
    SettingError : ``DELAYS``: out of their range.

    Examples
    --------
    >>> import lampyris
    >>> lampyris.Delays(probability=0.1, duration=2.0)
    <Delays: 0.1 of all moves, 2 s on average>
    """

    probability: float = number(0.0, 0.0, 1.0)
    duration: float = number(3.0, 0.0, 1e6, unit="s")

    def __post_init__(self) -> None:
        check_settings(self, under_code("DELAYS", "delays."))

    def _brief(self) -> str:
        return f"<Delays: {self.probability:g} of all moves, {self.duration:g} s on average>"
