"""Waiting: how long obstacles have kept a robot from getting on."""

from __future__ import annotations

from dataclasses import dataclass

WAITS = ("moving obstacle", "obstacle", "wait")
"""Causes for which a robot without progress waits for an obstacle."""


@dataclass
class Waiting:
    """To be kept from getting on is to stand, or to crawl: less than ``step`` metres in all that time.

    Parameters
    ----------
    step : metres that count as getting on.
    far : metres of a path after which the robot has left the place where it was kept.

    Attributes
    ----------
    stood : seconds since the robot got on, or since the planner was last asked.
    waited : seconds since the robot got on.
    tries : paths asked for since it left the place.
    reported : whether it was reported that the robot stands and waits.
    anchor : where the robot last got on, metres.
    """

    step: float
    far: float
    stood: float = 0.0
    waited: float = 0.0
    tries: int = 0
    reported: bool = False
    anchor: float = 0.0

    def begin(self) -> None:
        """A new path is taken, at its beginning."""
        self.anchor = 0.0

    def asked(self) -> None:
        """The planner has been asked."""
        self.stood = 0.0
        self.tries += 1

    def count(self, s: float, cause: str, seconds: float) -> bool:
        """Take in a period that ended at distance ``s``; whether the robot is kept from getting on."""
        if s - self.anchor > self.step:
            self.anchor, self.stood, self.waited, self.reported = s, 0.0, 0.0, False
        if s > self.far:
            self.tries = 0
        if cause not in WAITS:
            return False
        self.stood += seconds
        self.waited += seconds
        return True
