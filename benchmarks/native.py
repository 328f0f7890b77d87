"""The same field in C++, built by the compiler of this machine where it has one.

Twice: for any processor of the kind, and for this one, as numba compiles.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.model.moves import Moves
from lampyris.planning.field.frame import AHEAD, SPARING, BorderedMap

BUILDS = {"-O3": ("-O3",), "-O3 -march=native": ("-O3", "-march=native")}
"""What the table calls a build, and the flags that make it."""
FLAGS = ("-ffp-contract=off", "-shared", "-fPIC")
"""Of every build. A product and a sum stay two roundings: the results are ours to the last bit."""


def build() -> dict[str, ctypes.CDLL]:
    """The compiled library of each build; none where there is no compiler, fewer where it lacks a flag."""
    found = shutil.which("g++") or shutil.which("clang++")
    if found is None:
        return {}
    source = Path(__file__).with_name("wavefront.cpp")
    made: dict[str, ctypes.CDLL] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, flags in BUILDS.items():
            library = Path(folder) / f"wavefront{len(made)}.so"
            command = [found, *flags, *FLAGS, "-o", str(library), str(source)]
            if subprocess.run(command, check=name == "-O3").returncode == 0:
                made[name] = ctypes.CDLL(str(library))
    return made


class Native:
    """The field of one map in C++, by the loops that :mod:`lampyris.planning.field.waves` picks; arrays made once.

    Parameters
    ----------
    library : one of :func:`build`.
    free : bool, (height, width).
    moves : of :data:`lampyris.model.moves.MOVES`.
    goal : x, y.
    """

    def __init__(self, library: ctypes.CDLL, free: np.ndarray, moves: Moves, goal: tuple[int, int]) -> None:
        self.frame = frame = BorderedMap(free, moves)
        self._library, self._moves = library, moves
        n, cells = frame.size, frame.cells
        self._free = np.ascontiguousarray(free).view(np.uint8).ravel()
        self.cost = np.empty(n, frame.dtype)
        self.step = np.empty(n, np.int8)
        self.luciferin = np.empty(n)
        self._order = np.zeros(2 * cells + 2 + AHEAD, np.uint32)
        self._levels = np.empty(cells + 1, np.uint32), np.empty(cells + 1, np.uint32)
        self._table = frame.table(moves)
        self._price = np.array(moves.costs, dtype=frame.dtype)
        self._jump = np.zeros(128, np.int64)
        self._jump[: len(moves.costs)] = self._table[0]
        self._goal = frame.index(goal)
        self._bits = self.cost.itemsize * 8

    def __call__(self) -> None:
        """Cost, parents and luciferin."""
        count = self._windows() if self._moves.name == "octile" else self._heads()
        unit = float(self._moves.unit)
        if self.frame.size >= SPARING:
            maps = (self.cost, self.step, self._jump, self.luciferin)
            self._run(
                f"shine_{self._bits}", *maps, self.frame.size, self.frame.width, self._goal, *_RATES, unit
            )
        else:
            maps = (self.cost, self.step, self._jump, self.luciferin)
            self._run(f"glow_{self._bits}", self._order, self.frame.size, count, *maps, *_RATES, unit)

    def _heads(self) -> int:
        frame, moves = self.frame, self._moves
        prices = sorted(set(moves.costs))
        many = self._run(
            ("one_head", "two_heads", "three_heads")[len(prices) - 1], self._free, self.cost, self.step,
            self._order, *self._levels, frame.cells, frame.size, frame.width, self._goal, *prices,
            frame.never,
        )  # fmt: skip
        lay = (self.cost, self.step, frame.width, frame.rows)
        if len(prices) == 2:
            self._run("parents8_32", *lay, *prices, 0, frame.never - 1)
        else:
            table = (*self._table, self._price, len(self._price))
            self._run("parents", *lay, frame.pad, *table, frame.never - 1)
        return int(self._levels[1][many - 1])

    def _windows(self) -> int:
        frame, a, b = self.frame, self._moves.unit, self._moves.diagonal
        where = (frame.cells, frame.size, frame.width, self._goal)
        count = self._run("windows_64", self._free, self.cost, self._order, *where, a, b, -1, frame.never)
        lay = (self.cost, self.step, frame.width, frame.rows)
        self._run("parents8_64", *lay, a, b, -1, frame.never - 1)
        return count

    def _run(self, name: str, *given: Any) -> int:
        called = getattr(self._library, name)
        called.restype = ctypes.c_int64
        return int(called(*(_passed(value) for value in given)))


_RATES = (np.inf, 0.6, 0.6)
"""What cells get that were not reached; 1 - rho; gamma."""


def _passed(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return ctypes.c_void_p(value.ctypes.data)
    return ctypes.c_double(value) if isinstance(value, float) else ctypes.c_int64(value)
