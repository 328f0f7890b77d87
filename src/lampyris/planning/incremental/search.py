"""Searches that keep what they know while the map and the robot change: the arrays behind the four planners.

Each is asked the same four things: the robot is elsewhere, some cells changed, go on searching, and what does
the path look like. Costs in all of them are costs to the goal, which stays where it is.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import SettingError
from lampyris.kernels.incremental import dstar, dstar_lite
from lampyris.kernels.incremental import queue as incremental
from lampyris.kernels.incremental.queue import BIAS, NEVER, SLOPE
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.moves import Moves
from lampyris.planning.field.frame import BorderedMap
from lampyris.planning.graph.expanded import MOST_NS, Writes
from lampyris.planning.graph.grid_graph import check_limits, rules_of
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells

_MOST_BIAS = 2**59
"""From here on all keys are made again without a bias, so that they never outgrow 64 bits."""

LIMIT = incremental.LIMIT
Bytes = NDArray[np.uint8]


class SearchMap:
    """A map in a border of walls, the step set as kernels read it, and the robot's place on it.

    Parameters
    ----------
    free : bool, (height, width).
    terrain : uint8, same shape, with weighed moves; or None.
    moves : the step set.
    goal, robot : cells.
    informed : whether estimates are the metric of the open plane, or all 0.

    Raises
    ------
    LimitError : more cells, or costlier steps, than exact costs have room for.
    SettingError : a step without its opposite.
    """

    def __init__(
        self,
        free: BoolGrid,
        terrain: ByteGrid | None,
        moves: Moves,
        goal: Cell,
        robot: Cell,
        *,
        informed: bool,
    ) -> None:
        check_limits(free, moves)
        back = _opposites(moves.offsets)
        if back is None:
            raise SettingError(
                "MOVES", f"{moves.name}: a step without its opposite", allowed="steps in pairs"
            )
        frame = self.frame = BorderedMap(free, moves, terrain=terrain is not None)
        unit = 1 if terrain is None else TERRAIN_UNIT
        self.free = frame.lay(free, np.uint8)
        self.weight = np.zeros(1, np.uint8) if terrain is None else frame.lay(terrain, np.uint8)
        jump, side, other = frame.table(moves)
        prices = np.array(moves.costs, dtype=np.int64) // unit
        self.steps: tuple[NDArray[np.int64], ...] = (jump, side, other, prices)
        self.opposite = np.array(back, dtype=np.int64)
        self.setup = np.zeros(SLOPE + 4, dtype=np.int64)
        mask = 0 if terrain is None else -1
        self.setup[:4] = unit, mask, frame.width, frame.index(goal)
        self.setup[SLOPE:] = rules_of(moves, informed).slope
        self._path = np.zeros(frame.size, dtype=np.int32)
        self.place(robot)

    def cells(self, indices: NDArray[np.int64]) -> Cells:
        """Cells of the map, int32 (n, 2), from where they lie in the frame."""
        y, x = np.divmod(indices, self.frame.width)
        return np.stack((x, y), axis=1).astype(np.int32) - np.int32(self.frame.pad)

    def place(self, robot: Cell) -> int:
        """Put the robot on a cell; the estimate between that and where it was."""
        index = self.frame.index(robot)
        moved = int(incremental.estimate(self.setup, index)) - self.bias
        pad = self.frame.pad
        self.setup[incremental.ROBOT : incremental.ROBOT_Y + 1] = index, robot[0] + pad, robot[1] + pad
        return moved

    @property
    def bias(self) -> int:
        """What is added to every estimate."""
        return int(self.setup[BIAS])

    @bias.setter
    def bias(self, value: int) -> None:
        self.setup[BIAS] = value

    def indices(self, x: NDArray[np.int32], y: NDArray[np.int32]) -> NDArray[np.int32]:
        """Where cells lie in the frame."""
        return (y + self.frame.pad) * np.int32(self.frame.width) + (x + self.frame.pad)

    def extract_path(self, cost: NDArray[np.int64]) -> Cells:
        """The path from the robot to the goal down these costs; the robot can reach it."""
        length = incremental.descend(self.free, self.weight, cost, *self.steps, self.setup, self._path)
        flat, width, pad = self._path[:length], self.frame.width, self.frame.pad
        y = flat // width
        pairs = np.empty((length, 2), dtype=np.int32)
        pairs[:, 0] = flat - y * width - pad
        pairs[:, 1] = y - pad
        return pairs


@lru_cache(maxsize=16)
def _opposites(offsets: tuple[Cell, ...]) -> tuple[int, ...] | None:
    """The place of each step's opposite; None: one has none."""
    places = {offset: k for k, offset in enumerate(offsets)}
    found = [places.get((-dx, -dy)) for dx, dy in offsets]
    return None if None in found else tuple(k for k in found if k is not None)


class _Queue:
    """A heap of cells with keys of two parts, kept from call to call."""

    def __init__(self, ground: SearchMap) -> None:
        n = ground.frame.size
        goal = int(ground.setup[incremental.GOAL])
        self.low = np.zeros(n, dtype=np.int64)
        self.key = np.zeros(n, dtype=np.int64)
        self.heap = np.zeros(n + 1, dtype=np.int32)
        self.place = np.zeros(n, dtype=np.int32)
        self.key[goal] = incremental.estimate(ground.setup, goal)
        self.heap[:2] = 1, goal
        self.place[goal] = 1

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """As every kernel takes them."""
        return self.low, self.key, self.heap, self.place

    def follow(self, ground: SearchMap, robot: Cell) -> None:
        """The robot has moved: raise the bias, so that every key made so far stays a lower bound."""
        ground.bias += ground.place(robot)
        if ground.bias > _MOST_BIAS:
            ground.bias = 0
            self.renew(ground)

    def renew(self, ground: SearchMap) -> None:
        """Make every key, and the order of the heap, again."""
        incremental.refile(*self.arrays, ground.setup)


class IncrementalSearch(Protocol):
    """What a session asks of the four."""

    ground: SearchMap

    def move(self, robot: Cell) -> None:
        """The robot is somewhere else."""
        ...

    def edit(self, cells: NDArray[np.int32], free: Bytes, weights: Bytes) -> None:
        """Some cells, each once, are free, or not, or weigh something else than before."""
        ...

    def run(self, budget: int | None) -> tuple[int, int]:
        """Search until the robot's cost is known or the budget spent: DONE or LIMIT, and expansions.

        After LIMIT another call goes on from there.
        """
        ...

    def order(self) -> Cells | None:
        """The cells that :meth:`run` would expand from here on, first come first, int32 (n, 2); recomputed in plain Python
        without a trace in this search. None: it would take too long."""
        ...

    @property
    def cost(self) -> NDArray[np.int64]:
        """Costs to the goal, right along every cheapest path of the robot."""
        ...


class Waves:
    """D*, and Focussed D* if the ground's estimates are informed."""

    def __init__(self, ground: SearchMap) -> None:
        self.ground = ground
        self._queue = _Queue(ground)
        n, goal = ground.frame.size, int(ground.setup[incremental.GOAL])
        self.cost = np.full(n, NEVER, dtype=np.int64)
        self._back = np.full(n, dstar.NEW, dtype=np.int8)
        self.cost[goal], self._back[goal] = 0, -1

    def move(self, robot: Cell) -> None:
        """See :class:`IncrementalSearch`."""
        self._queue.follow(self.ground, robot)

    def edit(self, cells: NDArray[np.int32], free: Bytes, weights: Bytes) -> None:
        """See :class:`IncrementalSearch`."""
        g, q = self.ground, self._queue
        dstar.edit(
            g.free,
            g.weight,
            self.cost,
            q.low,
            q.key,
            q.heap,
            q.place,
            cells,
            free,
            weights,
            g.steps[0],
            g.setup,
        )

    def run(self, budget: int | None) -> tuple[int, int]:
        """See :class:`IncrementalSearch`."""
        g, q = self.ground, self._queue
        known = (g.free, g.weight, self.cost, q.low, q.key, self._back, q.heap, q.place)
        limit = -1 if budget is None else budget
        ending, expansions = dstar.process(*known, *g.steps, g.opposite, g.setup, limit)
        return int(ending), int(expansions)

    def order(self) -> Cells | None:
        """See :class:`IncrementalSearch`: each expansion takes a cell off the open list."""
        g, q = self.ground, self._queue
        if dstar.process.each * g.frame.size > MOST_NS:
            return None
        place = Writes(q.place.tolist(), 0)
        known = (g.free, g.weight, *(a.copy() for a in (self.cost, q.low, q.key, self._back, q.heap)), place)
        dstar.process.run_plain(*known, *g.steps, g.opposite, g.setup, -1)
        return g.cells(place.order())


class Estimates:
    """D* Lite, or LPA*.

    Parameters
    ----------
    ground : the map.
    biased : D* Lite's bias (k_m) and optimised search; or LPA*, which files its queue again when the robot
        moves.
    """

    def __init__(self, ground: SearchMap, *, biased: bool) -> None:
        self.ground = ground
        self._biased = biased
        self._queue = _Queue(ground)
        n = ground.frame.size
        self.cost = np.full(n, NEVER, dtype=np.int64)
        self._ahead = np.full(n, NEVER, dtype=np.int64)
        self._ahead[ground.setup[incremental.GOAL]] = 0

    def move(self, robot: Cell) -> None:
        """See :class:`IncrementalSearch`."""
        if self._biased:
            self._queue.follow(self.ground, robot)
        else:
            self.ground.place(robot)
            self._queue.renew(self.ground)

    def edit(self, cells: NDArray[np.int32], free: Bytes, weights: Bytes) -> None:
        """See :class:`IncrementalSearch`."""
        g = self.ground
        dstar_lite.edit(
            g.free,
            g.weight,
            self.cost,
            self._ahead,
            *self._queue.arrays,
            cells,
            free,
            weights,
            *g.steps,
            g.setup,
        )

    def run(self, budget: int | None) -> tuple[int, int]:
        """See :class:`IncrementalSearch`."""
        g = self.ground
        search = dstar_lite.d_star_lite if self._biased else dstar_lite.lpa_star
        known = (g.free, g.weight, self.cost, self._ahead, *self._queue.arrays)
        ending, expansions = search(*known, *g.steps, g.setup, -1 if budget is None else budget)
        return int(ending), int(expansions)

    def order(self) -> Cells | None:
        """See :class:`IncrementalSearch`: each expansion, and nothing else, writes the cost of its cell."""
        g = self.ground
        search = dstar_lite.d_star_lite if self._biased else dstar_lite.lpa_star
        if search.each * g.frame.size > MOST_NS:
            return None
        cost = Writes(self.cost.tolist())
        known = (g.free, g.weight, cost, self._ahead.copy(), *(a.copy() for a in self._queue.arrays))
        search.run_plain(*known, *g.steps, g.setup, -1)
        return g.cells(cost.order())
