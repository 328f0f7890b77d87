"""Expanded: the cells that a planner's search takes, in its own order, for who wants to see it.

The search is made once more in its plain form with a list in the place of one scratch array, which writes
down what is read of it or written to it: each expansion does either. So neither form of the kernel
knows of it, and a search that nobody asks about costs what it did. A record kept by the kernel itself would
have put a branch into each expansion of every search.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels._jit import Kernel
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.typing import Cells

MOST_CELLS: Final = 600_000
"""Cells of the largest map that is searched for this: a second or so in the plain form."""
MOST_NS: Final = 2_000_000_000
"""Nanoseconds of the plain form, about, that an order of expansion may take."""
MOST_POSES: Final = 40_000
"""Poses of the longest record of a planner of poses: a second or so of ``lattice`` in the plain form."""
SLOW_POSES: Final[Mapping[str, int]] = {"hybrid-astar": 12_000}
"""The same for planners that need longer for a pose in the plain form: about two seconds."""


class Writes(list[Any]):
    """A list that writes down which of its values are changed, for the plain form of a kernel.

    Parameters
    ----------
    values : what it holds at first.
    to : only changes to this value are written down; None: every write.
    """

    def __init__(self, values: Iterable[Any], to: int | None = None) -> None:
        super().__init__(values)
        self.to = to
        self.changed: list[int] = []

    def __setitem__(self, k: Any, value: Any) -> None:
        if type(k) is not slice and (self.to is None or (value == self.to and self[k] != value)):
            self.changed.append(int(k))
        super().__setitem__(k, value)

    def order(self) -> NDArray[np.int64]:
        """Indices of what was changed, first come first."""
        return np.array(self.changed, dtype=np.int64)


def run_noting(
    kernel: Kernel, args: Sequence[Any], watched: NDArray[Any], to: int
) -> tuple[Any, NDArray[np.int64]]:
    """Run the plain form of a kernel; its result, and which elements of one of its arrays it changed, first come first.

    Parameters
    ----------
    args : its arguments.
    watched : the array, one of ``args``; it has its new values afterwards.
    to : only changes to this value count.
    """
    at = next(k for k, one in enumerate(args) if one is watched)
    writes = Writes(watched.tolist(), to)
    result = kernel.run_plain(*args[:at], writes, *args[at + 1 :])
    watched[:] = writes
    return result, writes.order()


def most_poses(planner: str) -> int:
    """Poses of the longest record of a planner of poses, by its name."""
    return min(MOST_POSES, SLOW_POSES.get(planner, MOST_POSES))


@runtime_checkable
class Recordable(Protocol):
    """A session that can say in which order its search expands cells."""

    def expansion_order(self) -> Cells | None:
        """The cells from where the robot is to the goal, first come first, int32 (n, 2); None: it cannot be said."""
        ...


def expanded(planner: Planner, scene: Scene) -> Cells | None:
    """The cells that a planner expands on its way from the scene's start to its goal, first come first;
    int32 (n, 2). Of ``jps`` these are jump points. A cell that is expanded twice is there twice.

    None where it cannot be said: other planners than those of graphs keep no record, and
    on maps of more than :data:`MOST_CELLS` it would take too long, with slower searches on smaller ones, and with planners
    of poses that expand more than :func:`most_poses`.
    """
    if scene.grid.blocked.size > MOST_CELLS:
        return None
    session = planner.open(scene, np.random.Generator(np.random.PCG64(0)))
    return session.expansion_order() if isinstance(session, Recordable) else None
