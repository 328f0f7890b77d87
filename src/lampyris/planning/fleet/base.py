"""The contract of planners of fleets: frozen settings, traits that say what is promised, and one call."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Protocol, runtime_checkable

from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.planning.base import BOTH as BOTH
from lampyris.planning.base import FOUR as FOUR
from lampyris.planning.base import FleetTraits as FleetTraits

Progress = Callable[[int, int | None], None]
"""Called with the iterations so far and the sum of costs of the best plan so far (None: there is none yet)."""


@runtime_checkable
class FleetPlanner(Protocol):
    """A frozen dataclass; its fields are the settings."""

    name: ClassVar[str]
    traits: ClassVar[FleetTraits]
    summary: ClassVar[str]
    source: ClassVar[str]

    def plan(
        self,
        fleet: Fleet,
        seed: int,
        iterations: int | None = None,
        progress: Progress | None = None,
        moves: str = FOUR,
    ) -> FleetPlan:
        """A plan for the fleet.

        Parameters
        ----------
        fleet : the question.
        seed : of every random draw.
        iterations : how many at most, see :attr:`FleetPlan.iterations`; None: as many as its settings say.
        progress : called now and then.
        moves : one of the step sets of its traits. Every step takes a tick and costs 1, a diagonal one, too.

        The caller's time limit and cancel token are those of :mod:`lampyris._core.cancellation`.
        """
        ...
