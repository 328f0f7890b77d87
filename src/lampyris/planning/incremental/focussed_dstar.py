"""Focussed D*: D* that looks towards the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.incremental.search import Waves
from lampyris.planning.incremental.session import IncrementalSession


@dataclass(frozen=True, slots=True)
class FocussedDStar:
    """D* with an open list in order of cost plus the metric of the open plane to the robot.

    Stentz, "The focussed D* algorithm for real-time replanning", IJCAI 1995. Its pseudocode was not to be
    found in full: how the bias of a moving robot is kept is ours (see :mod:`lampyris.kernels.incremental.dstar`); the
    order of the list, the comparisons of pairs and the end of the search are the paper's.
    """

    name: ClassVar[str] = "focussed-dstar"
    traits: ClassVar[Traits] = Traits(optimal=True, incremental=True)
    summary: ClassVar[str] = "Focussed D*: D* led towards the robot by a heuristic."
    source: ClassVar[str] = (
        "Stentz 1995; the bookkeeping of the bias, renewed when a cell comes to the top, is ours, as are "
        "exact integer costs and the local rule for the path."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> IncrementalSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return IncrementalSession(scene, self.name, Waves, informed=True)
