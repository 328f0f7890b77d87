"""Hard calls for planners: maps on which searches take as long as they can, and traffic beside them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.planning import registry
from lampyris.planning.base import Session
from lampyris.typing import Cell

Blocked = NDArray[np.bool_]

SMALL = 64
"""Maps of so many cells a side: a stopped call is asked again there, without a limit."""
SIDES = {
    "walled": (64, 256, 512), "spiral": (64, 256, 512), "free": (64, 512, 2048), "ends": (64, 512),
    "slits": (64, 256, 512), "clutter": (64, 512), "weighted": (64, 512), "crowd": (64, 256),
}  # fmt: skip
MAPS = tuple(SIDES)
LONG_MAPS = ("free", "weighted")
SWARMS = ("apso", "gso", "igso", "ipso", "lpso", "mmas-dstar", "pso", "pso-apf")
FOR_MINUTES: Mapping[str, Any] = {"iterations": 100_000, "swarm": 200, "seeded": False}
"""Settings with which such a planner goes on for minutes."""
LARGE = {
    "spiral": (512, 1024), "free": (2048,), "walled": (1024,), "slits": (1024,), "clutter": (1024,),
    "weighted": (1024,),
}  # fmt: skip
_OF_LARGE = (0.4, 0.12, 0.12, 0.12, 0.12, 0.12)
_OF_MAP = (0.12, 0.2, 0.12, 0.08, 0.12, 0.12, 0.12, 0.12)
_TIMED = ("sipp", "space-time-astar")
_FOUR = ndimage.generate_binary_structure(2, 1)
_EIGHT = ndimage.generate_binary_structure(2, 2)


@dataclass(frozen=True)
class DeadlineCall:
    """One call.

    Parameters
    ----------
    map, side : which map (:data:`SIDES`), and how many cells a side.
    moves, planner, settings : how to plan on it.
    seed : of the session.
    seconds : when it is to end, if it goes on for so long.
    share : of the time that it takes, else.
    scene : the map, its ends and its traffic.
    reachable : whether there is a way on the bare map.
    """

    map: str
    side: int
    moves: str
    planner: str
    settings: Mapping[str, Any]
    seed: int
    seconds: float
    scene: Scene
    reachable: bool
    share: float = 0.5

    @property
    def small(self) -> bool:
        """Whether a call without a limit is over soon."""
        return self.side <= SMALL and not self.settings

    @property
    def said(self) -> dict[str, Any]:
        """It, in words of JSON."""
        return {
            "map": self.map, "side": self.side, "moves": self.moves, "planner": self.planner,
            "settings": dict(self.settings), "seed": self.seed, "seconds": self.seconds,
            "share": self.share,
        }  # fmt: skip


def call_of(rng: np.random.Generator) -> DeadlineCall:
    """A drawn call. Its limit is 1 to 64 ms, one in forty 0.3 s."""
    kind = MAPS[int(rng.choice(len(MAPS), p=_OF_MAP))]
    names = _TIMED if kind == "crowd" else _ours()
    planner = names[int(rng.integers(len(names)))]
    sides = SIDES[kind]
    side = sides[int(rng.integers(len(sides)))]
    moves = tuple(MOVES)[int(rng.integers(len(MOVES)))]
    settings: dict[str, Any] = {}
    if rng.random() < 0.5 and registry.planner_class(planner).traits.stochastic:
        own = registry.settings_of(registry.planner_class(planner))
        settings = {k: v for k, v in {"iterations": 5000, "swarm": 60}.items() if k in own}
    seconds = 0.3 if rng.random() < 0.025 else float(2.0 ** rng.uniform(-10.0, -4.0))
    blocked, terrain, start, goal = _map(kind, side)
    grid = Grid(blocked, terrain=terrain)
    traffic = _crowd(rng, blocked) if kind == "crowd" else ()
    scene = Scene(grid, start, goal, moves=MOVES[moves], traffic=traffic)
    seed = int(rng.integers(2**31))
    reachable = _joined(kind, side, moves == "dissertation")
    share = float(rng.uniform(0.1, 0.8))
    return DeadlineCall(kind, side, moves, planner, settings, seed, seconds, scene, reachable, share)


def large_call_of(rng: np.random.Generator) -> DeadlineCall:
    """A drawn call on a large map. It is to end at any moment of its first second and a half."""
    kind = tuple(LARGE)[int(rng.choice(len(LARGE), p=_OF_LARGE))]
    names, sides = _ours(), LARGE[kind]
    side = sides[int(rng.integers(len(sides)))]
    planner = names[int(rng.integers(len(names)))]
    moves = tuple(MOVES)[int(rng.integers(len(MOVES)))]
    seconds, share = float(rng.uniform(0.02, 1.5)), float(rng.uniform(0.02, 0.98))
    seed = int(rng.integers(2**31))
    blocked, terrain, start, goal = _map(kind, side)
    scene = Scene(Grid(blocked, terrain=terrain), start, goal, moves=MOVES[moves])
    reachable = _joined(kind, side, moves == "dissertation")
    return DeadlineCall(kind, side, moves, planner, {}, seed, seconds, scene, reachable, share)


def long_call_of(rng: np.random.Generator) -> DeadlineCall:
    """A drawn call of a swarm that would go on for minutes. Its limit is 1.5 to 4 s."""
    kind = LONG_MAPS[int(rng.integers(len(LONG_MAPS)))]
    planner = SWARMS[int(rng.integers(len(SWARMS)))]
    side = (64, 512)[int(rng.integers(2))]
    blocked, terrain, start, goal = _map(kind, side)
    scene = Scene(Grid(blocked, terrain=terrain), start, goal, moves=MOVES["octile"])
    seconds = float(rng.uniform(1.5, 4.0))
    return DeadlineCall(
        kind, side, "octile", planner, FOR_MINUTES, int(rng.integers(2**31)), seconds, scene, True
    )


def _ours() -> tuple[str, ...]:
    """Planners without those of guests: what is drawn must not hang on what else is installed."""
    return tuple(name for name in registry.names() if not registry.origin_of(name))


def session_of(call: DeadlineCall) -> Session:
    """A fresh session for it."""
    planner = registry.make(call.planner, call.settings)
    return planner.open(call.scene, np.random.Generator(np.random.PCG64(call.seed)))


@cache
def _map(kind: str, side: int) -> tuple[Blocked, NDArray[np.uint8] | None, Cell, Cell]:
    """Blocked cells, terrain, start and goal."""
    blocked, start, goal = _MAKERS[kind](side)
    terrain = None
    if kind == "weighted":
        terrain = np.random.Generator(np.random.PCG64(side)).integers(0, 253, blocked.shape).astype(np.uint8)
        terrain[blocked] = 0
    return blocked, terrain, start, goal


@cache
def _joined(kind: str, side: int, cutting: bool) -> bool:
    """Whether steps lead from start to goal: straights alone, or diagonals past corners too.

    A diagonal between two free side cells, and a knight's step, lead nowhere that straights do not.
    """
    blocked, _, start, goal = _map(kind, side)
    part, _ = ndimage.label(~blocked, structure=_EIGHT if cutting else _FOUR)
    return bool(part[start[1], start[0]] == part[goal[1], goal[0]])


def _walled(side: int) -> tuple[Blocked, Cell, Cell]:
    """Open ground, and a wall around the goal."""
    blocked = np.zeros((side, side), dtype=np.bool_)
    goal = (side - 4, side // 2)
    blocked[goal[1] - 1 : goal[1] + 2, goal[0] - 1 : goal[0] + 2] = True
    blocked[goal[1], goal[0]] = False
    return blocked, (1, 1), goal


def _spiral(side: int) -> tuple[Blocked, Cell, Cell]:
    """A corridor one cell wide that winds inwards: half of the cells are on the way."""
    blocked = np.ones((side, side), dtype=np.bool_)
    x, y, dx, dy = 1, 1, 1, 0
    blocked[y, x] = False
    turned = 0
    while turned < 2:
        ahead, beyond = (x + dx, y + dy), (x + 2 * dx, y + 2 * dy)
        inside = 0 < ahead[0] < side - 1 and 0 < ahead[1] < side - 1
        if (
            inside
            and blocked[ahead[1], ahead[0]]
            and (not _in(blocked, beyond) or blocked[beyond[1], beyond[0]])
        ):
            x, y = ahead
            blocked[y, x] = False
            turned = 0
        else:
            dx, dy = -dy, dx
            turned += 1
    return blocked, (1, 1), (x, y)


def _in(blocked: Blocked, cell: Cell) -> bool:
    height, width = blocked.shape
    return bool(0 <= cell[0] < width and 0 <= cell[1] < height)


def _free(side: int) -> tuple[Blocked, Cell, Cell]:
    """Nothing in the way, the ends as far apart as a knight's slope has them."""
    return np.zeros((side, side), dtype=np.bool_), (0, 1), (side - 1, side // 3)


def _ends(side: int) -> tuple[Blocked, Cell, Cell]:
    """Walls everywhere but on start and goal."""
    blocked = np.ones((side, side), dtype=np.bool_)
    blocked[1, 1] = blocked[side - 2, side - 2] = False
    return blocked, (1, 1), (side - 2, side - 2)


def _slits(side: int) -> tuple[Blocked, Cell, Cell]:
    """Chambers joined by gaps of no width: two cells that touch at a corner."""
    blocked = np.zeros((side, side), dtype=np.bool_)
    for k, y in enumerate(range(7, side - 8, 8)):
        blocked[y] = True
        gap = side - 6 if k % 2 else 5
        blocked[y, gap] = False
        blocked[y + 1, gap - 1 : gap + 2] = True
        blocked[y + 1, gap + 1] = False
    return blocked, (1, 1), (side - 2, side - 2)


def _clutter(side: int) -> tuple[Blocked, Cell, Cell]:
    """Walls on four cells in ten."""
    blocked = np.random.Generator(np.random.PCG64(7 * side)).random((side, side)) < 0.4
    blocked[1, 1] = blocked[side - 2, side - 2] = False
    return blocked, (1, 1), (side - 2, side - 2)


def _ground(side: int) -> tuple[Blocked, Cell, Cell]:
    """Walls on two cells in ten."""
    blocked = np.random.Generator(np.random.PCG64(3 * side)).random((side, side)) < 0.2
    blocked[1, 1] = blocked[side - 2, side - 2] = False
    return blocked, (1, 1), (side - 2, side - 2)


def _crowd(rng: np.random.Generator, blocked: Blocked) -> tuple[Recorded, ...]:
    """Thirty obstacles with known tracks, each to and fro over some columns in a row of its own."""
    side = blocked.shape[0]
    tracks = []
    for y in rng.permutation(np.arange(3, side - 3))[:30].tolist():
        first = int(rng.integers(2, side - 20))
        last = first + int(rng.integers(3, 16))
        out = [(x, y) for x in range(first, last + 1)]
        tracks.append(Recorded(tuple((out + out[-2:0:-1]) * 8)))
    return tuple(tracks)


_MAKERS: Mapping[str, Callable[[int], tuple[Blocked, Cell, Cell]]] = {
    "walled": _walled, "spiral": _spiral, "free": _free, "ends": _ends, "slits": _slits,
    "clutter": _clutter, "weighted": _ground, "crowd": _free,
}  # fmt: skip
