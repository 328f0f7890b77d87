"""Cap: one rule's speeds at the nodes of a sampled path, and what a rule may look at besides the map."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris.model.obstacles import ObstacleStates
from lampyris.typing import Floats


class Cap(NamedTuple):
    """Speeds that one rule allows.

    Parameters
    ----------
    cause : the rule's name, in one or two words.
    v : m/s (or velocity units), shape (n,), >= 0; infinity where the rule says nothing.
    cause_index : int64 (n,), what the rule speaks of at each node, such as an obstacle's number; None: nothing.
    """

    cause: str
    v: Floats
    cause_index: NDArray[np.int64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Around:
    """What moves around the robot now.

    Parameters
    ----------
    cells : int64 (m, 2): cells that obstacles of the tick model cover.
    obstacle_states : discs in continuous time; None: there are none.
    """

    cells: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    obstacle_states: ObstacleStates | None = None
