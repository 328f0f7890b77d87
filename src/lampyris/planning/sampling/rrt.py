"""The planners rrt and rrt-connect: any path, soon."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from lampyris._core.settings import flag
from lampyris.planning.base import Traits
from lampyris.planning.sampling import settings
from lampyris.planning.sampling.session import SamplingPlanner
from lampyris.planning.sampling.trees import OneTree, Query, TwoTrees

TRAITS = Traits(optimal=False, stochastic=True)


@dataclass(frozen=True, slots=True)
class Rrt(SamplingPlanner):
    """RRT: a tree from the start grows towards random cells until it reaches the goal.

    States are the centres of free cells, lines between them are as for :class:`~lampyris.planning.graph.theta_star.ThetaStar`.
    If there is a path, the probability that it is found tends to 1 with the number of samples. That there is none is
    never concluded from samples: it is proven by a search of the cells.

    Parameters
    ----------
    samples : greatest number of samples.
    batch : samples per iteration.
    step : longest line by which the tree grows.
    goal_bias : share of samples that are the goal.
    narrow : share of samples drawn from narrow passages: cells between blocked cells less than four apart.
    shortcut : whether the path is made shorter by straight lines between its points.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    samples: int = settings.samples_of_first_path()
    batch: int = settings.batch_of_first_path()
    step: float | None = settings.step()
    goal_bias: float = settings.goal_bias()
    narrow: float = settings.narrow()
    shortcut: bool = flag(True)

    name: ClassVar[str] = "rrt"
    traits: ClassVar[Traits] = TRAITS
    summary: ClassVar[str] = "RRT: a random tree from the start; any path."
    source: ClassVar[str] = "LaValle 1998; exact lines on the grid and the shortcuts are ours."
    improves: ClassVar[bool] = False

    def begin(self, query: Query) -> OneTree:
        """The search of one call."""
        return OneTree(query, self.goal_bias, star=False, informed=False, ancestors=0)


@dataclass(frozen=True, slots=True)
class RrtConnect(SamplingPlanner):
    """RRT-Connect: trees from the start and the goal grow towards random cells and towards each other.

    States, lines and completeness are those of :class:`Rrt`. The first sample is the goal. The smaller tree grows towards
    the sample until it is blocked, then the other towards its last node (the form with two greedy trees). A step that is
    blocked is tried at a half and a quarter of its length, and then as a step of one cell along either axis.

    Parameters
    ----------
    samples : greatest number of samples.
    batch : samples per iteration.
    step : longest line by which the trees grow.
    narrow : share of samples drawn from narrow passages: cells between blocked cells less than four apart.
    shortcut : whether the path is made shorter by straight lines between its points.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    samples: int = settings.samples_of_first_path()
    batch: int = settings.batch_of_first_path()
    step: float | None = settings.step_of_two_trees()
    narrow: float = settings.narrow()
    shortcut: bool = flag(True)

    name: ClassVar[str] = "rrt-connect"
    traits: ClassVar[Traits] = TRAITS
    summary: ClassVar[str] = (
        "RRT-Connect: two random trees that grow towards each other; the first path soon."
    )
    source: ClassVar[str] = (
        "Kuffner, LaValle 2000; exact lines on the grid, shorter steps where one is blocked and the shortcuts are ours."
    )
    improves: ClassVar[bool] = False
    reach: ClassVar[float] = 0.05

    def begin(self, query: Query) -> TwoTrees:
        """The search of one call."""
        return TwoTrees(query)
