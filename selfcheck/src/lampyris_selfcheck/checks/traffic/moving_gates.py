"""Drawn cases in which it is not plain whether to wait or to go about: a search that guesses shows there.

``ring``: two ways around a block, the nearer one shut for about as long as the other is longer. A search
whose estimate says too much waits where it should have gone about, or goes about where it should have waited.
``crossing``: at the very last tick at which anything moves, two bodies cross the only step that is left, and
then hold the cells beside it for ever: the robot has to wait through that tick.
"""

from __future__ import annotations

import numpy as np

from lampyris.model.change import ObstacleTrack
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris_selfcheck.checks.traffic.moving_cases import ONE
from lampyris_selfcheck.checks.traffic.moving_drawn import Drawn
from lampyris_selfcheck.reference.paths.timed import Cell

Track = tuple[Cell, ...]


def draw(rng: np.random.Generator) -> Drawn:
    """A question of one of the two forms."""
    return _ring(rng) if rng.random() < 0.75 else _crossing(rng)


def _asked(blocked: np.ndarray, start: Cell, goal: Cell, moves: str, tracks: list[Track]) -> Drawn:
    bodies = tuple(ObstacleTrack(k, track, 0, 1, ONE) for k, track in enumerate(tracks))
    traffic = tuple(Recorded(track) for track in tracks)
    return Drawn(Scene(Grid(blocked), start, goal, MOVES[moves], traffic=traffic), 0, bodies, recorded=True)


def _ring(rng: np.random.Generator) -> Drawn:
    width, height = (int(n) for n in rng.integers(3, 9, 2))
    round_about = _around(width, height)
    blocked = np.ones((height, width), dtype=np.bool_)
    for x, y in round_about:
        blocked[y, x] = False
    n = len(round_about)
    first, near = int(rng.integers(n)), int(rng.integers(2, n // 2 + 1))
    ring = round_about[first:] + round_about[:first]
    if rng.random() < 0.5:
        ring = ring[:1] + ring[:0:-1]
    # One stands on the nearer way until the other is about as quick, a second one, sometimes, on that.
    # What leaves goes into the block and stays there: what is known of an obstacle is believed.
    gates = [(int(rng.integers(1, near)), n - near + int(rng.integers(-4, 5)))]
    if rng.random() < 0.4:
        gates.append((int(rng.integers(near + 1, n)), int(rng.integers(1, n))))
    tracks = [_stands(ring[at], max(until, 1), width, height) for at, until in gates]
    return _asked(blocked, ring[0], ring[near], ("octile", "four-connected")[int(rng.integers(2))], tracks)


def _around(width: int, height: int) -> list[Cell]:
    """The cells at the border of the map, one after the other."""
    across = [(x, 0) for x in range(width - 1)] + [(width - 1, y) for y in range(height - 1)]
    return across + [(width - 1 - x, height - 1 - y) for x, y in across]


def _stands(cell: Cell, until: int, width: int, height: int) -> Track:
    """On a cell of the ring up to a tick; after it in the block."""
    x, y = cell
    inside = (min(max(x, 1), width - 2), min(max(y, 1), height - 2))
    return (cell,) * (until + 1) + (inside,)


def _crossing(rng: np.random.Generator) -> Drawn:
    long, tick = (int(n) for n in rng.integers(0, 6, 2))
    tick += long + 1
    blocked = np.ones((2, long + 2), dtype=np.bool_)
    blocked[0] = blocked[1, long:] = False
    ahead, below = (long + 1, 0), (long, 1)
    tracks = [(ahead,) * tick + (below,), (below,) * tick + (ahead,)]
    if rng.random() < 0.5:
        tracks.reverse()
    # Before that tick the step is shut, too: somebody stands on the goal, who leaves it then.
    goal = (long + 1, 1)
    tracks.append((goal,) * tick + (ahead,))
    return _asked(blocked, (0, 0), goal, "octile", tracks)
