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
    "walled": (64, 512, 1024), "spiral": (64, 512, 1024), "free": (64, 512, 2048), "slits": (64, 512, 1024),
    "clutter": (64, 512, 1024), "weighted": (64, 512, 1024), "traffic": (64, 256, 256),
}  # fmt: skip
"""Cells a side of each map; the last for calls that may be large."""
SWARMS = (
    "ant-system",
    "apso",
    "diversity-pso",
    "gso",
    "igso",
    "ipso",
    "lpso",
    "mmas-dstar",
    "pso",
    "pso-apf",
)
FOR_MINUTES: Mapping[str, Any] = {"iterations": 100_000, "swarm": 200, "seeded": False}
"""Settings with which such a planner goes on for minutes."""
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


def call_of(rng: np.random.Generator, *, large: bool) -> DeadlineCall:
    """A drawn call: its limit is 1 to 64 ms, or up to 1.5 s; a swarm goes on for minutes half of the time."""
    kind = tuple(SIDES)[int(rng.integers(len(SIDES)))]
    names = _TIMED if kind == "traffic" else _ours()
    planner = names[int(rng.integers(len(names)))]
    side = SIDES[kind][int(rng.integers(3 if large else 2))]
    moves = tuple(MOVES)[int(rng.integers(len(MOVES)))]
    settings: dict[str, Any] = {}
    if planner in SWARMS and rng.random() < 0.5:
        own = registry.settings_of(registry.planner_class(planner))
        settings = {k: v for k, v in FOR_MINUTES.items() if k in own}
    seconds = float(rng.uniform(0.3, 1.5)) if rng.random() < 0.025 else float(2.0 ** rng.uniform(-10.0, -4.0))
    blocked, terrain, start, goal = _map(kind, side)
    traffic = _tracks(rng, blocked) if kind == "traffic" else ()
    scene = Scene(Grid(blocked, terrain=terrain), start, goal, moves=MOVES[moves], traffic=traffic)
    seed = int(rng.integers(2**31))
    reachable = _joined(kind, side, moves == "dissertation")
    share = float(rng.uniform(0.1, 0.8))
    return DeadlineCall(kind, side, moves, planner, settings, seed, seconds, scene, reachable, share)


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
    """A corridor one cell wide that winds inwards: half of the cells are on the path."""
    blocked = np.ones((side, side), dtype=np.bool_)
    x, y, dx, dy, length = 1, 1, 1, 0, side - 3
    blocked[y, x] = False
    for leg in range(side):
        for _ in range(length):
            x, y = x + dx, y + dy
            blocked[y, x] = False
        dx, dy = -dy, dx
        length -= 2 if leg and leg % 2 == 0 else 0
        if length < 2:
            break
    return blocked, (1, 1), (x, y)


def _free(side: int) -> tuple[Blocked, Cell, Cell]:
    """Nothing in the way, the ends as far apart as a knight's slope has them."""
    return np.zeros((side, side), dtype=np.bool_), (0, 1), (side - 1, side // 3)


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


def _clutter(side: int, share: float = 0.4) -> tuple[Blocked, Cell, Cell]:
    """Walls on four cells in ten, or another share."""
    blocked = np.random.Generator(np.random.PCG64(7 * side)).random((side, side)) < share
    blocked[1, 1] = blocked[side - 2, side - 2] = False
    return blocked, (1, 1), (side - 2, side - 2)


def _tracks(rng: np.random.Generator, blocked: Blocked) -> tuple[Recorded, ...]:
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
    "walled": _walled, "spiral": _spiral, "free": _free, "slits": _slits, "clutter": _clutter,
    "weighted": lambda side: _clutter(side, 0.2), "traffic": _free,
}  # fmt: skip
