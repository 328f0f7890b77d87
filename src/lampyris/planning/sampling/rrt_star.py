"""The planners rrt-star, informed-rrt-star and bit-star: paths that become shorter with every batch of samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from lampyris._core.settings import flag
from lampyris.planning.base import Traits
from lampyris.planning.sampling import settings
from lampyris.planning.sampling.rrt import TRAITS
from lampyris.planning.sampling.session import SamplingPlanner
from lampyris.planning.sampling.trees import BatchSearch, OneTree, Query


@dataclass(frozen=True, slots=True)
class RrtStar(SamplingPlanner):
    """RRT*: a random tree from the start that is rewired as it grows, so that its paths become shorter.

    States, lines and completeness are those of :class:`~lampyris.planning.sampling.rrt.Rrt`. The length of the path
    tends to that of the shortest one of straight lines between cell centres: any two cells are tried as parent and child
    again and again, at random.

    Parameters
    ----------
    samples : greatest number of samples; all are drawn unless the path is one straight line.
    batch : samples per iteration.
    step : longest line by which the tree grows.
    goal_bias : share of samples that are the goal, until it is reached.
    ancestors : number of ancestors of a parent that are tried in its place; 0 is RRT* as published, more is Quick-RRT*.
    narrow : share of samples drawn from narrow passages: cells between blocked cells less than four apart.
    near_path : share of samples drawn near the best path, up to 1, 2, 4 or 8 cells from a cell of it; 0: as published.
    seeded : begin with the cheapest path of the grid (A*), pulled straight, so that samples are near it at once, and the
        answer is never longer. What the grid search expands counts for the budget.
    seed_after : without ``seeded``: samples after which the search goes on from such a path, if it has no shorter one; None:
        never, as published.
    shortcut : whether the path is made shorter by straight lines between its points at the end.
    turns : where the path may turn: at cell ``centres``, or ``anywhere``: at the end its turns move to the corners of walls, as
        far as they can without passing over a wall, and ``Plan.waypoints`` are float64 places between cell centres where
        that made it shorter. It is never longer, but touches the walls that it goes round.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    samples: int = settings.samples_of_improving()
    batch: int = settings.batch_of_improving()
    step: float | None = settings.step()
    goal_bias: float = settings.goal_bias()
    ancestors: int = settings.ancestors()
    narrow: float = settings.narrow()
    near_path: float = settings.near_path()
    seeded: bool = settings.seeded()
    seed_after: int | None = settings.seed_after()
    shortcut: bool = flag(True)
    turns: str = settings.turns()

    name: ClassVar[str] = "rrt-star"
    traits: ClassVar[Traits] = TRAITS
    summary: ClassVar[str] = "RRT*: a random tree that is rewired; the path tends to the shortest one."
    source: ClassVar[str] = (
        "Karaman, Frazzoli 2011; ancestors: Jeong, Lee, Kim 2019; random parents, exact lines on the grid and the "
        "shortcuts are ours."
    )
    improves: ClassVar[bool] = True
    informed: ClassVar[bool] = False

    def begin(self, query: Query) -> OneTree:
        """The search of one call."""
        return OneTree(query, self.goal_bias, star=True, informed=self.informed, ancestors=self.ancestors)


@dataclass(frozen=True, slots=True)
class InformedRrtStar(RrtStar):
    """Informed RRT*: RRT* that, once it has a path, draws only cells that a shorter one may lead through.

    These lie in an ellipse around start and goal. Everything else is as in :class:`RrtStar`.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    name: ClassVar[str] = "informed-rrt-star"
    summary: ClassVar[str] = "Informed RRT*: RRT* that draws only from where a shorter path may lead through."
    source: ClassVar[str] = (
        "Gammell, Srinivasa, Barfoot 2014; ancestors: Jeong, Lee, Kim 2019; random parents, exact lines on the grid "
        "and the shortcuts are ours."
    )
    informed: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class BitStar(SamplingPlanner):
    """BIT*: batches of samples, searched in the order of what a path through them may cost.

    Lines are checked only where they may lead to a shorter path. States, lines and completeness are those of
    :class:`~lampyris.planning.sampling.rrt.Rrt`, the length tends to the shortest as in :class:`RrtStar`.

    Parameters
    ----------
    samples : greatest number of samples; all are drawn unless the path is one straight line.
    batch : samples of a batch.
    ancestors : number of ancestors of a parent that are tried in its place; 0: as published.
    narrow : share of samples drawn from narrow passages: cells between blocked cells less than four apart.
    near_path : share of samples drawn near the best path, up to 1, 2, 4 or 8 cells from a cell of it; 0: as published.
    seeded : begin with the cheapest path of the grid (A*), pulled straight, so that samples are drawn from its ellipse at
        once, and the answer is never longer. What the grid search expands counts for the budget.
    seed_after : without ``seeded``: samples after which the search goes on from such a path, if it has no shorter one; None:
        never, as published.
    shortcut : whether the path is made shorter by straight lines between its points at the end.
    turns : where the path may turn: at cell ``centres``, or ``anywhere``: at the end its turns move to the corners of walls, as
        far as they can without passing over a wall, and ``Plan.waypoints`` are float64 places between cell centres where
        that made it shorter. It is never longer, but touches the walls that it goes round.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    samples: int = settings.samples_of_improving()
    batch: int = settings.batch_of_improving()
    ancestors: int = settings.ancestors()
    narrow: float = settings.narrow()
    near_path: float = settings.near_path()
    seeded: bool = settings.seeded()
    seed_after: int | None = settings.seed_after()
    shortcut: bool = flag(True)
    turns: str = settings.turns()

    name: ClassVar[str] = "bit-star"
    traits: ClassVar[Traits] = TRAITS
    summary: ClassVar[str] = (
        "BIT*: batches of samples, searched best first; the path tends to the shortest one."
    )
    source: ClassVar[str] = (
        "Gammell, Srinivasa, Barfoot 2020; ancestors: Jeong, Lee, Kim 2019; random parents, exact lines on the grid "
        "and the shortcuts are ours."
    )
    improves: ClassVar[bool] = True

    def begin(self, query: Query) -> BatchSearch:
        """The search of one call."""
        return BatchSearch(query, ancestors=self.ancestors)
