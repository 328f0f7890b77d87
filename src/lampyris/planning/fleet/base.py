"""The contract of planners of fleets: frozen settings, traits that say what is promised, and one call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan

Progress = Callable[[int, int | None], None]
"""Called with the iterations so far and the sum of costs of the best plan so far (None: there is none yet)."""


FOUR = "four-connected"
BOTH = (FOUR, "octile")
"""The step sets that fleets may use."""


@dataclass(frozen=True, slots=True)
class FleetTraits:
    """What a planner of fleets promises. None is free of conflicts by promise: the referee judges every plan.

    Parameters
    ----------
    complete : it finds a plan if there is one, given time and memory, and says that there is none only if so.
    reaches : every robot comes to its goal after finitely many ticks, though not all are there at once, on maps where
        neighbouring free cells always lie on a common cycle; with four-connected moves and the settings that its docstring
        names.
    optimal : its plans have the least sum of costs.
    bounded : they cost at most ``weight`` times the lower bound that comes with them.
    anytime : it goes on to cheaper plans until the budget is used.
    stochastic : plans depend on the seed.
    sizes : it plans for discs of several sizes, larger than cells among them. The others take robots that fit in their
        cells (:func:`lampyris.model.fleet.fleet.most_radius`).
    moves : the step sets that it knows: ``four-connected``, ``octile``.
    """

    complete: bool = False
    reaches: bool = False
    optimal: bool = False
    bounded: bool = False
    anytime: bool = False
    stochastic: bool = False
    sizes: bool = False
    moves: tuple[str, ...] = (FOUR,)


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
