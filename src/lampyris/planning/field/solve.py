"""Solve: from free cells and a goal to the field (method.md, "The field").

Everything is laid out once in a padded frame; the Field's arrays are read-only views of its inside.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris._core.defaults import GAMMA, GATES, RHO
from lampyris._core.scalars import is_real, is_word
from lampyris.errors import SceneError, SettingError, of_kind, shown
from lampyris.model.field import Field
from lampyris.model.grid import MAX_TERRAIN, TERRAIN_UNIT, frozen
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.planning.field.frame import BorderedMap, carve
from lampyris.planning.field.gates import gate_mask
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.waves import LastMap, Wave
from lampyris.typing import BoolGrid, ByteGrid, Cell, Floats


def solve_field(scene: Scene, *, rho: float = RHO, gamma: float = GAMMA, gates: str = GATES) -> Field:
    """The field of a scene: cost-to-goal, parent and luciferin of every cell that can reach the goal.

    Parameters
    ----------
    scene : its map, goal, moves and robot.
    rho, gamma : luciferin decay, 0 < rho <= 1, and enhancement, > 0.
    gates : ``ignore``, or ``close`` to seal openings too narrow for the robot (never the start or the goal).

    Raises
    ------
    SettingError : a setting out of its range.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> field = lampyris.solve_field(scene)
    >>> round(float(field.cost[8, 1]), 3)
    11.243
    """
    of_kind("scene", scene, Scene)
    if not is_word(gates, ("ignore", "close")):
        raise SettingError("GATES", shown(gates), where="gates", allowed="ignore, close")
    free = free_space(scene)
    if gates == "close":
        closed = gate_mask(scene.grid, scene.robot).copy()
        for x, y in (scene.start, scene.goal):
            closed[y, x] = False
        free = frozen(free & ~closed)
    return solve(free, moves_for(scene), scene.goal, terrain=scene.grid.terrain, rho=rho, gamma=gamma)


def solve(
    free: BoolGrid,
    moves: Moves,
    goal: Cell,
    *,
    terrain: ByteGrid | None = None,
    rho: float = RHO,
    gamma: float = GAMMA,
    stop: Cell | None = None,
    revision: int = 0,
) -> Field:
    """The field over free cells. A blocked goal gives a field without a cost anywhere.

    Parameters
    ----------
    free : bool, (height, width); where the robot's centre may be. Copied unless it is read-only.
    moves : the step set; steps are legal as :class:`lampyris.model.moves.Moves` says. With terrain they must
        be weighed (:func:`lampyris.planning.field.layers.moves_for` sees to it).
    goal : x, y.
    terrain : uint8, (height, width), 0 to 252, or None: what cells cost to enter, see
        :class:`lampyris.model.grid.Grid`. A path pays for each cell it enters, the goal too, the start not.
    rho, gamma : luciferin decay, 0 < rho <= 1, and enhancement, > 0. Luciferin is a float64 recursion along
        parents, of ``exact / moves.unit`` (for octile moves q + p sqrt 2 to within rounding: p / q differs
        from sqrt 2 by less).
    stop : a cell; the field then holds just the cells that cost no more than it. A cell that cannot be
        reached: all.
    revision : how many Changes went into ``free``.

    Raises
    ------
    SettingError : rho or gamma out of its range, a step set that no wavefront can serve, terrain that does
        not fit the map or the moves.
    SceneError : a goal outside the map.
    LimitError : more cells than exact octile costs can tell apart.
    """
    free, terrain, goal = checked(free, terrain, moves, goal, rho, gamma)
    shares = (1.0 - rho, float(gamma), float(moves.unit))
    frame, (luciferin, cost, step), count = fill(free, terrain, moves, goal, shares, stop=stop)
    return Field(
        free=free,
        exact=frame.inside(cost),
        step=frame.inside(step),
        luciferin=frame.inside(luciferin),
        goal=goal,
        moves=moves,
        rho=rho,
        gamma=gamma,
        revision=revision,
        expansions=count,
    )


def checked(
    free: BoolGrid, terrain: ByteGrid | None, moves: Moves, goal: Cell, rho: float, gamma: float
) -> tuple[BoolGrid, ByteGrid | None, Cell]:
    """Free space, terrain and goal as :func:`fill` wants them.

    Raises
    ------
    SettingError, SceneError : see :func:`solve`.
    """
    _check(rho, gamma)
    free = _cells(free)
    height, width = free.shape
    BorderedMap(free, moves, terrain=terrain is not None)  # before anything is made for it
    free = _own(free)
    if not (0 <= goal[0] < width and 0 <= goal[1] < height):
        raise SceneError(
            "GOAL_OUTSIDE",
            f"goal {goal} is outside the map",
            allowed=f"x 0 to {width - 1}, y 0 to {height - 1}",
        )
    return free, None if terrain is None else _weights(terrain, free, moves), (int(goal[0]), int(goal[1]))


def costs_along(
    free: BoolGrid, moves: Moves, goal: Cell, cells: NDArray[np.int32], *, terrain: ByteGrid | None = None
) -> NDArray[Any]:
    """The exact costs to the goal of cells that can reach it, as :func:`solve` gives them; nothing else is computed.

    Parameters
    ----------
    free, moves, goal, terrain : as for :func:`solve`.
    cells : int32, (n, 2); x and y.
    """
    free, terrain, goal = checked(free, terrain, moves, goal, RHO, GAMMA)
    frame, (_, cost, _), _ = fill(free, terrain, moves, goal, (0.0, 0.0, 1.0), last="cost", once=True)
    inside = frame.inside(cost)
    found: NDArray[Any] = inside[cells[:, 1], cells[:, 0]]
    return found


def exact_costs(
    free: BoolGrid, moves: Moves, goal: Cell, *, terrain: ByteGrid | None = None, stop: Cell | None = None
) -> tuple[NDArray[Any], int]:
    """``exact`` and ``expansions`` of the field that :func:`solve` gives; its parents and luciferin are not computed.

    Two kernels fewer are loaded, or compiled, than for the whole field.

    Parameters
    ----------
    free, moves, goal, terrain, stop : as for :func:`solve`.

    Returns
    -------
    Exact costs, (height, width), read-only, -1 where there is none; how many cells were settled.

    Raises
    ------
    SettingError, SceneError, LimitError : see :func:`solve`.
    """
    free, terrain, goal = checked(free, terrain, moves, goal, RHO, GAMMA)
    frame, (_, cost, _), count = fill(free, terrain, moves, goal, (0.0, 0.0, 1.0), stop=stop, last="cost")
    most = frame.never - 1
    if (
        stop is not None
        and 0 <= stop[0] < free.shape[1]
        and 0 <= stop[1] < free.shape[0]
        and free[stop[1], stop[0]]
    ):
        most = min(most, int(cost[frame.index(stop)]))
    cost[cost > most] = -1
    return frame.inside(cost), count


Maps = tuple[Floats, NDArray[Any], NDArray[np.int8]]
"""Luciferin, exact cost and step, flat in a frame."""


def fill(
    free: BoolGrid,
    terrain: ByteGrid | None,
    moves: Moves,
    goal: Cell,
    shares: tuple[float, float, float],
    *,
    stop: Cell | None = None,
    into: tuple[BorderedMap, Maps] | None = None,
    sparing: bool | None = None,
    last: LastMap = "luciferin",
    once: bool = False,
) -> tuple[BorderedMap, Maps, int]:
    """The three maps of a field, the frame they lie in, and how many cells were settled.

    Parameters
    ----------
    free, terrain, moves, goal, stop : as for :func:`solve`, but taken as they are.
    shares : 1 - rho, gamma, unit.
    into : a frame and maps of it to be written over, for the same map size and moves.
    sparing, last : see :class:`lampyris.planning.field.waves.Wave`.
    once : this process is not likely to fill another; how many were settled is then of no use.
    """
    frame = into[0] if into else BorderedMap(free, moves, terrain=terrain is not None)
    maps = into[1] if into else _maps(frame)
    count = _fill(frame, maps, free, terrain, moves, goal, stop, shares, sparing, last, once)
    if count == 0 and free[goal[1], goal[0]]:
        frame = BorderedMap(free, moves, terrain=True, wide=True)
        maps = _maps(frame)
        count = _fill(frame, maps, free, terrain, moves, goal, stop, shares, sparing, last)
    return frame, maps, count


def _maps(frame: BorderedMap) -> Maps:
    # One block, not three: freed and asked for again it comes back without the pages being faulted in again.
    n = frame.size
    _, (luciferin, cost, step) = carve(None, (n, np.float64), (n, frame.dtype), (n, np.int8))
    return luciferin, cost, step


def _fill(
    frame: BorderedMap,
    maps: Maps,
    free: BoolGrid,
    terrain: ByteGrid | None,
    moves: Moves,
    goal: Cell,
    stop: Cell | None,
    shares: tuple[float, float, float],
    sparing: bool | None,
    last: LastMap,
    once: bool = False,
) -> int:
    """How many cells settled; 0 if costs outgrow the frame."""
    luciferin, cost, step = maps
    checkpoint()
    step.fill(-1)
    if not free[goal[1], goal[0]]:
        cost.fill(-1)
        if last == "luciferin":
            luciferin.fill(np.inf)
        return 0
    height, width = free.shape
    until = 0
    if stop is not None and 0 <= stop[0] < width and 0 <= stop[1] < height and free[stop[1], stop[0]]:
        until = frame.index(stop)
    wave = Wave(frame, free, moves, frame.index(goal), until, cost, step, luciferin, shares, sparing, last)
    if once and terrain is None and wave.run_costs_alone():
        return 1
    return wave.run() if terrain is None else wave.run_over(terrain)


def _weights(terrain: ByteGrid, free: BoolGrid, moves: Moves) -> ByteGrid:
    """The terrain as a read-only array that nobody else can write to."""
    array = np.asarray(terrain)
    if array.shape != free.shape or array.dtype != np.uint8:
        raise SettingError(
            "GRID_SHAPE",
            f"terrain has shape {array.shape} of {array.dtype}",
            allowed=f"uint8, the shape of free, {free.shape}",
        )
    if array.max() > MAX_TERRAIN:
        y, x = divmod(int(array.argmax()), array.shape[1])
        raise SettingError(
            "GRID_TERRAIN", f"{array[y, x]} at ({x}, {y})", where="terrain", allowed=f"0 to {MAX_TERRAIN}"
        )
    if moves.scale != TERRAIN_UNIT or any(c % TERRAIN_UNIT for c in moves.costs):
        raise SettingError(
            "MOVES",
            f"{moves.name} moves in units of {moves.scale} over terrain",
            allowed=f"units of {TERRAIN_UNIT}",
            todo="ask Moves.weighed() for them",
        )
    if array.flags.writeable or not array.flags.c_contiguous:
        array = frozen(np.array(array, order="C"))
    return array


def _cells(free: BoolGrid) -> BoolGrid:
    """What is given, if it is cells."""
    array = np.asarray(free)
    if array.ndim != 2 or array.size == 0 or array.dtype != np.bool_:
        raise SettingError(
            "GRID_SHAPE",
            f"free has shape {array.shape} of {array.dtype}",
            allowed="bool, (height, width), not empty",
        )
    return array


def _own(array: BoolGrid) -> BoolGrid:
    """The same cells as a read-only array that nobody else can write to."""
    if array.flags.writeable or not array.flags.c_contiguous:
        array = frozen(np.array(array, order="C"))
    return array


def _check(rho: float, gamma: float) -> None:
    if not (is_real(rho) and 0 < rho <= 1):
        raise SettingError("RHO", shown(rho), where="rho", allowed="0 < rho <= 1")
    if not (is_real(gamma) and gamma > 0):
        raise SettingError("GAMMA", shown(gamma), where="gamma", allowed="a finite number > 0")
