"""LPA*: A* for life."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.incremental.search import Estimates
from lampyris.planning.incremental.session import IncrementalSession


@dataclass(frozen=True, slots=True)
class LpaStar:
    """LPA* rooted at the goal.

    Koenig, Likhachev, Furcy, "Lifelong Planning A*", Artificial Intelligence 155, 2004. The paper searches
    from a start that stays where it is. Here it is the goal that stays, so the search begins there and its
    costs outlive the robot's moves; but the heuristic is measured from the robot, so when the robot has
    moved, every key in the queue is made again (not counted as expansions). That is what D* Lite's k_m avoids,
    and the only difference in kind between the two here.
    """

    name: ClassVar[str] = "lpa-star"
    traits: ClassVar[Traits] = Traits(optimal=True, incremental=True)
    summary: ClassVar[str] = "LPA*: A* that keeps two estimates a cell and repairs where they differ."
    source: ClassVar[str] = (
        "Koenig, Likhachev, Furcy 2004; rooted at the goal, its queue filed again when the robot moves, exact "
        "integer costs and the local rule for the path are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> IncrementalSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return IncrementalSession(scene, self.name, partial(Estimates, biased=False), informed=True)
