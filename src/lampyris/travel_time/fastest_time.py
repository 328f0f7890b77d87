"""Fastest time: the path that takes the least time, and not the shortest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from lampyris._core.defaults import CREEP
from lampyris._core.limits import demand_states
from lampyris._core.settings import check_settings, default_of, flag, number, redeclared, under_name
from lampyris.kernels.graph.search import FOUND, LIMIT
from lampyris.kernels.graph.travel_time import travel_time
from lampyris.model.grid import Grid, frozen
from lampyris.model.moves import Moves
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.motion.safety.blind_areas import BlindArea
from lampyris.planning.base import Traits
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.graph.grid_graph import PaddedMap, check_limits, rules_of
from lampyris.planning.search_planner import SearchPlanner, SearchSession
from lampyris.travel_time.static_caps import corner_speeds, edge_caps, node_caps
from lampyris.typing import BoolGrid, Cell, Cells, Floats

BLIND_SETTINGS: Mapping[str, str] = MappingProxyType(
    {
        **{name: name for name in ("hidden_speed", "hidden_radius", "reaction", "reach", "unknown")},
        "blind_creep": "creep",
    }
)
"""Settings of the rule for blind areas: the planner's name of each, and the rule's."""
_BYTES = 34
"""Of a state."""
_DOWN = 1.0 - 1e-12
"""The heuristic is lowered by so much that rounding never makes it too great."""


@dataclass(frozen=True, slots=True)
class FastestTime(SearchPlanner):
    """The path that is driven in the least time under the static caps of the law ``physical``.

    A* over states (cell, step that led there). The time of a path is that of driving every step as fast as the caps
    allow, with the square of the speed linear between the caps of its two cells, and the half steps next to a corner no
    faster than the corner. It is the least of all paths of the scene's moves, exactly, and a lower bound of the time of
    every one of them under the whole law, which also limits acceleration between nodes: ``Plan.time_lower_bound``, and
    docs/fastest_time.md. The planner
    ``fastest`` is something else: the shortest path, by the search that takes the least computing time.

    Parameters
    ----------
    clearance : whether distance to walls limits the speed, as the law's rule ``clearance``.
    zones : whether speed zones do.
    turns : whether corners do: an arc within half a step, as slow as a_lat_max asks, or a stop.
    blind : whether blind areas do, as in the law ``blind``, for a robot that goes straight on.
    creep : share of v_max that clearance leaves, as the law's ``creep``.
    hidden_speed, hidden_radius, reaction, reach, unknown, blind_creep : settings of the rule for blind areas, see
        :class:`lampyris.motion.safety.blind_areas.BlindArea`.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    clearance: bool = flag(True, title="distance to walls")
    zones: bool = flag(True, title="speed zones")
    turns: bool = flag(True, title="corners")
    blind: bool = flag(False, title="blind areas")
    creep: float = number(CREEP, 1e-6, 1.0, title="share of speed always left")
    hidden_speed: float = redeclared(BlindArea, "hidden_speed", default_of(BlindArea, "hidden_speed"))
    hidden_radius: float = redeclared(BlindArea, "hidden_radius", default_of(BlindArea, "hidden_radius"))
    reaction: float = redeclared(BlindArea, "reaction", default_of(BlindArea, "reaction"))
    reach: float | None = redeclared(BlindArea, "reach", None)
    unknown: str = redeclared(BlindArea, "unknown", default_of(BlindArea, "unknown"))
    blind_creep: float = redeclared(BlindArea, "creep", CREEP)

    name: ClassVar[str] = "fastest-time"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = (
        "Fastest time: the path of least travel time under clearance, turns, zones and blind areas."
    )
    source: ClassVar[str] = (
        "Ours, after the choice of path by travel time of Tsubasa et al.; A* of Hart, Nilsson, Raphael 1968."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> SearchSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return TravelTimeSession(self, scene, rng)


class TravelTimeSession(SearchSession):
    """A session that keeps the caps of its map until the map changes."""

    def __init__(self, planner: FastestTime, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(planner, scene, rng)
        self._settings = planner
        self._of: Grid | None = None
        self._layers: _Layers | None = None

    def _search(self, free: BoolGrid, limit: int | None) -> Plan:
        scene, start = self._scene, self._robot
        if self._layers is None or self._of is not scene.grid:
            self._of, self._layers = scene.grid, _layers(scene, self._settings)
        found = _searched(scene, free, start, self._layers, limit)
        name = self._settings.name
        if found.cells is None:
            status = Status.LIMIT if found.ending == LIMIT else Status.NO_PATH
            return Plan(status, name, expansions=found.expansions)
        path = path_of(found.cells, moves_for(scene), scene.grid.terrain)
        return Plan(
            Status.FOUND,
            name,
            path,
            iterations=1,
            expansions=found.expansions,
            time_lower_bound=found.seconds,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Layers:
    """The caps of a map as the kernel reads them."""

    node: Floats
    edge: Floats
    layered: bool
    corner: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """What one search found; ``seconds`` is infinity without a path."""

    ending: int
    expansions: int
    cells: Cells | None
    seconds: float


def _layers(scene: Scene, settings: FastestTime) -> _Layers:
    """The caps of a scene, padded and flat."""
    moves, free = moves_for(scene), free_space(scene)
    check_limits(free, moves)
    board = PaddedMap(free.shape, moves.reach)
    demand_states(free.shape[0], free.shape[1], moves.reach, len(moves.offsets), settings.name, each=_BYTES)
    node = np.full(board.size, scene.robot.v_max)
    board.lay(node_caps(scene, free, clearance=settings.clearance, creep=settings.creep), node)
    rule: dict[str, Any] = {theirs: getattr(settings, ours) for ours, theirs in BLIND_SETTINGS.items()}
    blind = BlindArea(**rule) if settings.blind else None
    layers = edge_caps(scene, free, moves, zones=settings.zones, blind=blind)
    edge = np.full(1 if layers is None else len(moves.offsets) * board.size, np.inf)
    if layers is not None:
        for k, layer in enumerate(layers):
            board.lay(layer, edge[k * board.size : (k + 1) * board.size])
    corner = corner_speeds(scene.robot, scene.grid.resolution, moves)
    if not settings.turns:
        corner = np.full(corner.shape, np.inf)
    return _Layers(
        frozen(node), frozen(edge), layers is not None, frozen(np.ascontiguousarray(corner.ravel()))
    )


def _searched(scene: Scene, free: BoolGrid, start: Cell, layers: _Layers, limit: int | None) -> _Found:
    """The path of least time from a cell to the scene's goal."""
    if start == scene.goal:
        return _Found(FOUND, 0, np.array([start], dtype=np.int32), 0.0)
    moves, robot = moves_for(scene), scene.robot
    board = PaddedMap(free.shape, moves.reach)
    board.lay(free, board.free)
    rules = rules_of(moves, informed=False)
    length = np.sqrt(np.square(rules.dx) + np.square(rules.dy)) * scene.grid.resolution
    states = len(length) * board.size + 1
    heap, place = np.zeros(states + 1, dtype=np.int32), np.zeros(states, dtype=np.int32)
    f, h, g = np.empty(states), np.empty(states), np.full(states, np.inf)
    before, result = np.zeros(states, dtype=np.int8), np.zeros(3)
    top = float(layers.node.max())
    # NumPy makes the arrays of a copied session writable; the kernel would be compiled once more for them.
    node, edge, corner = (frozen(one) for one in (layers.node, layers.edge, layers.corner))
    travel_time(
        board.free, node, edge, layers.layered, board.stride, board.flat(start), board.flat(scene.goal),
        -1 if limit is None else limit, *board.steps(rules), length, corner,
        _norm(moves) * scene.grid.resolution * _DOWN, top, robot.a_max, robot.d_max,
        heap, place, f, h, g, before, result,
    )  # fmt: skip
    ending, expansions = int(result[0]), int(result[1])
    if ending != FOUND:
        return _Found(ending, expansions, None, float("inf"))
    flat, step = [board.flat(scene.goal)], int(before[-1])
    offsets = (rules.dx + rules.dy * board.stride).tolist()
    while step < len(offsets):
        state = step * board.size + flat[-1]
        flat.append(flat[-1] - offsets[step])
        step = int(before[state])
    return _Found(ending, expansions, board.cells(np.array(flat, dtype=np.int32)), float(result[2]))


def _norm(moves: Moves) -> Floats:
    """Length of the shortest path in an open plane as the greater of two linear forms in a >= b, cells."""
    root2, root5 = 2.0**0.5, 5.0**0.5
    if moves.knight:
        return np.array([1.0, root5 - 2.0, root5 - root2, 2.0 * root2 - root5])
    if moves.diagonal:
        return np.array([1.0, root2 - 1.0, 1.0, root2 - 1.0])
    return np.array([1.0, 1.0, 1.0, 1.0])
