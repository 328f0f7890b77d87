"""The same field in C++, built by the compiler of this machine where it has one."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.field.frame import AHEAD, Frame
from lampyris.model.moves import MOVES

FLAGS = ("-O3", "-ffp-contract=off", "-shared", "-fPIC")
_MOVES = MOVES["dissertation"]


def build() -> ctypes.CDLL | None:
    """The compiled library, or None where no compiler is found."""
    found = shutil.which("g++") or shutil.which("clang++")
    if found is None:
        return None
    source = Path(__file__).with_name("wavefront.cpp")
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "wavefront.so"
        subprocess.run([found, *FLAGS, "-o", str(made), str(source)], check=True)
        return ctypes.CDLL(str(made))


class Native:
    """The field of one map in C++: arrays once, stages one by one.

    Parameters
    ----------
    library : see :func:`build`.
    free : bool, (height, width).
    goal : x, y.
    """

    def __init__(self, library: ctypes.CDLL, free: np.ndarray, goal: tuple[int, int]) -> None:
        self.frame = frame = Frame(free, _MOVES)
        n = frame.size
        self._library = library
        library.costs.restype = ctypes.c_int64
        self._free = np.ascontiguousarray(free).view(np.uint8)
        self.cost = np.empty(n, np.int32)
        self.step = np.empty(n, np.int8)
        self.luciferin = np.empty(n)
        self._fresh = np.empty(n, np.uint8)
        self._order = np.zeros(n + AHEAD, np.uint32)
        self._levels = np.empty(n + 1, np.uint32), np.empty(n + 1, np.uint32)
        self._jump = frame.table(_MOVES)[0]
        self._goal = frame.index(goal)
        self._count = 0

    def costs(self) -> None:
        """The first stage alone."""
        frame, levels = self.frame, self._levels
        many = self._library.costs(
            *(_at(a) for a in (self._free, self.cost, self._fresh, self._order, *levels)),
            *(ctypes.c_size_t(v) for v in (frame.width, frame.rows, self._goal)),
            ctypes.c_int64(_MOVES.unit),
            ctypes.c_int64(_MOVES.diagonal),
            ctypes.c_int32(frame.never),
        )
        self._count = int(levels[1][many - 1])

    def parents(self) -> None:
        """The second stage, after :meth:`costs`."""
        frame = self.frame
        self._library.parents(
            _at(self.cost), _at(self.step), ctypes.c_size_t(frame.width), ctypes.c_size_t(frame.rows),
            *(ctypes.c_int32(v) for v in (_MOVES.unit, _MOVES.diagonal, frame.never - 1)),
        )  # fmt: skip

    def glow(self) -> None:
        """The third stage."""
        self._library.glow(
            _at(self._order), ctypes.c_size_t(self.frame.size), ctypes.c_size_t(self._count),
            *(_at(a) for a in (self.cost, self.step, self._jump, self.luciferin)),
            *(ctypes.c_double(v) for v in (np.inf, 0.6, 0.6, float(_MOVES.unit))),
        )  # fmt: skip

    def whole(self) -> None:
        """Cost, parents and luciferin."""
        self.costs()
        self.parents()
        self.glow()

    def floor(self) -> None:
        """Every result written once: what no program can be quicker than."""
        self._library.floor_of_memory(
            _at(self.cost), _at(self.step), _at(self.luciferin), ctypes.c_size_t(self.frame.size)
        )


def _at(array: np.ndarray) -> Any:
    return ctypes.c_void_p(array.ctypes.data)
