"""What of a field takes how long: cost alone, parents, luciferin; compared with C++ and the memory floor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import zip_longest
from types import SimpleNamespace
from typing import Any

import numpy as np
from benchmarks.figures import Figure, Spread
from benchmarks.limits import NEW_MEMORY
from benchmarks.native import Native, build
from benchmarks.turns import Call, take_turns

from lampyris.model.field import Field
from lampyris.model.moves import Moves
from lampyris.planning.field import waves
from lampyris.planning.field.solve import solve

PARENTS, LUCIFERIN = ("parents8", "parents"), ("glow", "shine")
"""The passes of :mod:`lampyris.kernels.field.descent`."""
HEADS = (
    "map", "moves", "cost alone", "with parents", "with luciferin: whole", "whole / cost alone", "C++ -O3",
    "ours / that", "C++ -O3 -march=native", "ours / that", "floor",
)  # fmt: skip
MOST_OF_ALONE, MOST_OF_NATIVE = 1.7, 1.2
"""Times of cost alone, and of the same loop in C++."""
Maps = Sequence[np.ndarray]
Cell = tuple[int, int]


def without(passes: Sequence[str], call: Callable[[], Field]) -> Field:
    """The same call, those passes left out: what a caller would wait for costs alone, or for parents."""
    kept = waves.descent
    some = {name: getattr(kept, name) for name in (*PARENTS, *LUCIFERIN)}
    waves.descent = SimpleNamespace(**some | dict.fromkeys(passes, _nothing))  # type: ignore[assignment]
    try:
        return call()
    finally:
        waves.descent = kept


def _nothing(*_: Any) -> None:
    pass


def stages(
    title: str, frees: Maps, moves: Moves, goals: Sequence[Cell], rounds: int, *, judged: bool
) -> tuple[tuple[str, ...], list[Figure]]:
    """A row under ``HEADS`` and the figures of one kind of map; all answers compared once, untimed.

    Parameters
    ----------
    frees, goals : one map or several small ones, read-only, and a goal on each.
    judged : whether what is claimed is claimed of this size.
    """
    whole = [partial(solve, free, moves, goal) for free, goal in zip(frees, goals, strict=True)]
    fields = [call() for call in whole]
    cells = sum(field.expansions for field in fields)
    alone = [partial(without, (*PARENTS, *LUCIFERIN), call) for call in whole]
    parented = [partial(without, LUCIFERIN, call) for call in whole]
    natives: dict[str, list[Native]] = {}
    for name, library in _libraries().items():
        pairs = zip(frees, goals, strict=True)
        natives[f"C++ {name}"] = [Native(library, free, moves, goal) for free, goal in pairs]
    _check(fields, alone, parented, natives)
    answers = np.empty(sum(f.exact.nbytes + f.step.nbytes + f.luciferin.nbytes for f in fields), np.uint8)
    del fields
    # None of ours after another of ours: anyone who comes next would find the memory just used in the caches.
    theirs: list[tuple[str, Call]] = [(name, _all(several)) for name, several in natives.items()]
    theirs.append(("floor", partial(answers.fill, 1)))
    # One array of all, as a field has it: large ones are new to the process each time.
    theirs.append((NEW_MEMORY, lambda: np.empty(answers.size, np.uint8).fill(1)))
    ours = (("alone", _all(alone)), ("parents", _all(parented)), ("whole", _all(whole)))
    calls = dict(one for pair in zip_longest(ours, theirs) for one in pair if one)
    times = take_turns(calls, rounds=rounds, per=cells, warm=cells < 2**21)
    return _told(title, moves.name, times, judged)


def _all(calls: Sequence[Call]) -> Call:
    def run() -> None:
        for call in calls:
            call()

    return run


def _check(
    fields: Sequence[Field], alone: Sequence[Call], parented: Sequence[Call], natives: dict[str, list[Native]]
) -> None:
    """Stages must give the same and nothing of what was left out; C++ the same to the last bit."""
    same = np.testing.assert_array_equal
    for k, field in enumerate(fields):
        reached = field.exact >= 0
        some: Field = alone[k]()
        same(some.exact[reached], field.exact[reached])
        assert not (some.step >= 0).any() or (field.step < 0).all(), "parents were not left out"
        some = parented[k]()
        same(some.exact, field.exact)
        same(some.step, field.step)
        for several in natives.values():
            native = several[k]
            native()
            same(field.exact, native.frame.inside(native.cost))
            same(field.step, native.frame.inside(native.step))
            same(field.luciferin, native.frame.inside(native.luciferin))


def _told(
    title: str, kind: str, times: dict[str, Spread], judged: bool
) -> tuple[tuple[str, ...], list[Figure]]:
    task, ours = f"stages, {title}, {kind}", times["whole"]
    figures = [
        Figure(f"{task}, with parents", "ns a cell", times["parents"], "cost alone", times["alone"]),
        Figure(
            task, "ns a cell", ours, "cost alone", times["alone"], asked=1 / MOST_OF_ALONE if judged else None
        ),
        Figure(task, "ns a cell", ours, "memory floor", times["floor"]),
    ]
    figures.append(Figure(f"{task}, {NEW_MEMORY}", "ns a cell", times[NEW_MEMORY]))
    row = [title, kind, text(times["alone"]), text(times["parents"]), text(ours)]
    row.append(f"{ours.middle / times['alone'].middle:.2f}")
    for name in (heads for heads in HEADS if heads.startswith("C++")):
        theirs = times.get(name)
        row += [text(theirs), f"{ours.middle / theirs.middle:.2f}"] if theirs else ["", ""]
        if theirs:
            asked = 1 / MOST_OF_NATIVE if judged else None
            figures.append(Figure(task, "ns a cell", ours, name, theirs, asked=asked))
    return (*row, f"{times['floor'].middle:.2f}"), figures


_built: list[dict[str, Any]] = []


def _libraries() -> dict[str, Any]:
    if not _built:
        _built.append(build())
    return _built[0]


def text(s: Spread) -> str:
    """``3.4 (3.3 to 3.6)``."""
    return f"{s.middle:.1f} ({s.low:.1f} to {s.high:.1f})"
