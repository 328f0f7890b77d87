"""AD-GSO's walk made callable: room to work in, and the record read back."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lampyris.kernels.adgso import walk as w
from lampyris.model.grid import MAX_TERRAIN, TERRAIN_UNIT
from lampyris.model.moves import Moves
from lampyris.model.plan import Candidate, Jump
from lampyris.planning.field.frame import BorderedMap
from lampyris.planning.field.repair import Padded
from lampyris.typing import Cell, Cells, Floats

Flat = np.ndarray[Any, np.dtype[Any]]

RULES = {"greedy": w.GREEDY, "roulette": w.ROULETTE, "exact": w.EXACT}
NO_LIMIT = 2**62
HEAVIEST = (TERRAIN_UNIT + MAX_TERRAIN) // TERRAIN_UNIT
_DRAWS = 64


@dataclass(slots=True)
class WalkState:
    """How far one plan has walked. ``path`` and ``log`` grow when the kernel says they are full."""

    tally: Flat
    path: Flat
    log: Flat
    code: int = w.PAUSED
    jumps: list[Jump] = field(default_factory=list)
    gates_met: list[Cell] = field(default_factory=list)

    @property
    def cells(self) -> Flat:
        """Flat cells walked so far, the start first."""
        return self.path[: self.tally[w.LENGTH]]

    def at(self, place: int) -> int:
        """One number of the tally."""
        return int(self.tally[place])


class Walker:
    """Runs the walk kernel over one map size and step set, with one set of settings.

    Parameters
    ----------
    frame : the map in its border of walls.
    goal : the goal cell.
    moves : the step set; see :meth:`take`.
    choice, nt, mvr : see :class:`lampyris.planning.adgso.ad_gso.AdGso`.
    rng : where roulette's numbers come from.
    record : whether :attr:`WalkState.jumps` is kept.
    """

    def __init__(
        self,
        frame: BorderedMap,
        goal: Cell,
        moves: Moves,
        *,
        choice: str,
        nt: int,
        mvr: int,
        rng: np.random.Generator,
        record: bool,
    ) -> None:
        rings = max(mvr, moves.reach)
        side = 2 * (rings + w.MARGIN) + 1
        self._frame = frame
        self._numbers = (frame.width, frame.rows, frame.index(goal), RULES[choice], nt, rings, moves.reach)
        self._steps = moves.offsets, moves.corner_cutting
        self._side, self._rings = side, rings
        self.take(moves)
        self._first_log = 16 * side * side if record else 0
        self._draws_needed = choice == "roulette"
        self._rng = rng
        self._draws = np.zeros(1)
        self._drawn = 1

    def take(self, moves: Moves) -> None:
        """Reckon with the costs of these moves from now on; weighed ones are for grounds with terrain."""
        cells = self._side * self._side
        # No step is three times as costly as another (field.waves sees to it), and terrain weighs five-fold at
        # most: so many steps may a chain of parents have that leaves the window.
        longest = 3 * cells * (1 if moves.scale == 1 else HEAVIEST)
        self._longest = longest
        self._costs = tuple(cost // moves.scale for cost in moves.costs)
        self._first_path = 4 * (self._frame.width + self._frame.rows) + longest
        self._laid: tuple[Flat, tuple[Flat, ...]] | None = None

    @property
    def drawn(self) -> tuple[Floats, int]:
        """The draws taken from the generator beforehand, and how many of them are used; may be put back."""
        return self._draws, self._drawn

    @drawn.setter
    def drawn(self, was: tuple[Floats, int]) -> None:
        self._draws, self._drawn = was

    def start(self, at: int) -> WalkState:
        """A trip that stands on a flat cell and has not moved."""
        tally = np.zeros(w.LOGGED + 1, dtype=np.int64)
        tally[w.AT], tally[w.LENGTH] = at, 1
        path = np.zeros(self._first_path, dtype=np.int64)
        path[0] = at
        return WalkState(tally, path, np.zeros(self._first_log, dtype=np.int64))

    def arrays(self) -> tuple[Flat, tuple[Flat, ...]]:
        """Of what :func:`lampyris.kernels.adgso.walk.walk` takes: ``setup``, and all from ``ring_dx`` to ``sub_path``: tables and
        room, made when they are first asked for.
        """
        if self._laid is None:
            cells = self._side * self._side
            price = np.array(self._costs, dtype=np.int64)
            wall, toll, *rest = (np.zeros(n, dtype=np.int64) for n in [cells] * 6 + [self._longest])
            toll.fill(1)
            near, far = (w.step_table(*self._steps, row) for row in (self._side, self._frame.width))
            tables = *w.ring_table(self._rings), near, far
            self._laid = np.array(self._numbers, dtype=np.int64), (*tables, price, wall, toll, *rest)
        return self._laid

    def go(self, trip: WalkState, ground: Padded, shut: Flat, *, jumps: int, look: int) -> int:
        """Walk on until the goal or a reason to stop; the kernel's word for it, also in ``trip.code``.

        Parameters
        ----------
        ground : the field to walk on.
        shut : its :func:`walls` with obstacles and gates marked.
        jumps, look : jumps and window cells at most, counted over the whole trip.
        """
        tally, (setup, others) = trip.tally, self.arrays()
        tally[w.ALLOWED] = look
        while True:
            if self._draws_needed and self._drawn == len(self._draws):
                self._draws, self._drawn = self._rng.random(_DRAWS), 0
            left = len(self._draws) - self._drawn if self._draws_needed else NO_LIMIT
            tally[w.STOP] = min(jumps, trip.at(w.JUMPS) + left)
            tally[w.DRAWN] = self._drawn
            trip.code = int(
                w.walk(
                    ground.cost,
                    ground.luciferin,
                    ground.step,
                    shut,
                    ground.terrain,
                    setup,
                    tally,
                    self._draws,
                    trip.path,
                    trip.log,
                    *others,
                )
            )
            self._drawn = trip.at(w.DRAWN)
            self._read(trip, ground)
            if trip.code == w.FULL and trip.at(w.LENGTH) + self._longest <= len(trip.path):
                continue  # it was the log, and that has just been emptied
            if trip.code == w.FULL:
                trip.path = np.concatenate((trip.path, np.zeros_like(trip.path)))
            elif trip.code != w.PAUSED or trip.at(w.JUMPS) >= jumps:
                return trip.code

    def _read(self, trip: WalkState, ground: Padded) -> None:
        """Turn the kernel's log into Jumps, and empty it."""
        log = trip.log[: trip.tally[w.LOGGED]].tolist()
        trip.tally[w.LOGGED] = 0
        heads = []
        k = 0
        while k < len(log):
            heads.append(k)
            k += w.LOG_HEAD + log[k + 4]
        ends = [log[k + 3] for k in heads[1:]] + [trip.at(w.LENGTH) - 1]
        for k, end in zip(heads, ends, strict=True) if heads else ():
            at, chosen, by_parents, begin, count, rings = log[k : k + w.LOG_HEAD]
            cells = log[k + w.LOG_HEAD : k + w.LOG_HEAD + count]
            trip.jumps.append(
                Jump(
                    at=self.cell(at),
                    luciferin=float(ground.luciferin[at]),
                    candidates=self._candidates(at, cells, ground),
                    chosen=self.cell(chosen),
                    subpath=tuple(self.cell(c) for c in trip.path[begin : end + 1].tolist()),
                    by_parents=bool(by_parents),
                    rings=rings,
                )
            )

    def _candidates(self, at: int, cells: list[int], ground: Padded) -> tuple[Candidate, ...]:
        x, y = self.cell(at)
        luc = [float(ground.luciferin[c]) for c in cells]
        here = float(ground.luciferin[at])
        total = 0.0
        for value in luc:  # One after the other: from Python 3.12 on, sum() carries what rounding loses.
            total += here - value
        out = []
        for c, value in zip(cells, luc, strict=True):
            cx, cy = self.cell(c)
            ring = max(abs(cx - x), abs(cy - y))
            out.append(Candidate((cx, cy), ring, value, (here - value) / total))
        return tuple(out)

    def cell(self, flat: int) -> Cell:
        """x, y of a flat cell."""
        frame = self._frame
        return flat % frame.width - frame.pad, flat // frame.width - frame.pad

    def cells(self, flat: Flat) -> Cells:
        """The same for many; int32 (n, 2)."""
        width, pad = self._frame.width, self._frame.pad
        y = flat // width
        pairs = np.empty((len(flat), 2), dtype=np.int32)
        pairs[:, 0] = flat - y * width - pad
        pairs[:, 1] = y - pad
        return pairs

    def flats(self, cells: Iterable[Cell]) -> list[int]:
        """The flat cells of some cells, in their order."""
        pad, width = self._frame.pad, self._frame.width
        return [(y + pad) * width + x + pad for x, y in cells]

    def flat(self, cell: Cell) -> int:
        """The flat cell of x, y."""
        return self._frame.index(cell)


def walls(ground: Padded) -> Flat:
    """``shut`` of a field: WALL where a cell may not be entered. A new array."""
    return (ground.free ^ np.uint8(1)) * np.uint8(w.WALL)
