"""D* Lite: as much as D*, in less."""

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
class DStarLite:
    """D* Lite, optimised version.

    Koenig and Likhachev, "D* Lite", AAAI 2002. Ours: after an edit, the cells around it look ahead again
    instead of comparing each edge's old and new cost; and should the bias (k_m) ever grow towards the end of
    64 bits, the queue is filed again without one.
    """

    name: ClassVar[str] = "dstar-lite"
    traits: ClassVar[Traits] = Traits(optimal=True, incremental=True)
    summary: ClassVar[str] = "D* Lite: LPA* from the goal, with a bias for a robot that moves."
    source: ClassVar[str] = (
        "Koenig and Likhachev 2002, optimised version; exact integer costs and the local rule for the path "
        "are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> IncrementalSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return IncrementalSession(scene, self.name, partial(Estimates, biased=True), informed=True)
