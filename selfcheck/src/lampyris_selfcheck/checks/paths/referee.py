"""The referee against the published rules of a competition, and against paths spoilt in twelve ways.

Where the public rules apply - octile moves, two cells or more, right ends, right length - the two judges must
agree on every path. Where the public judge is blind (an empty path, a path between other cells, a single
cell), the referee must not be.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lampyris.model.moves import MOVES
from lampyris.model.path import Path
from lampyris.model.robot import Robot
from lampyris.referee import check_path
from lampyris.typing import Cell
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.paths import referee_wide as wide
from lampyris_selfcheck.checks.paths.referee_cases import TWELVE, WalkClaim, drawn
from lampyris_selfcheck.reference.paths.competition import first_wrong, moves_of, turns_of

KINDS = {
    "paths": Kind(
        "a lawful walk (even numbers) is accepted, one spoilt in one of twelve ways (odd ones) is refused by"
        " the rule it breaks; the public rules agree where they apply",
        commit=1_000, nightly=1_000_000, release=10_000_000, chunk=1000,
    ),
    "wide": Kind(
        "the same for robots with a size on ground that costs: a wall within the radius, a wrong price",
        commit=250, nightly=50_000, release=500_000, chunk=250,
    ),
    "wild": Kind(
        "eight cells or fewer on a map of 4 x 4, drawn near each other: both judges say the same",
        commit=1_000, nightly=1_000_000, release=10_000_000, chunk=5000,
    ),
}  # fmt: skip
_OCTILE = MOVES["octile"]
_POINT = Robot()


def run(ask: Ask, part: Part) -> Outcome:
    """Judge the paths of a part."""
    tally = Tally(part)
    case = {"paths": _paths, "wide": _wide, "wild": _wild}[part.kind]
    for number in part.numbers:
        rng = ask.rng("referee", part.kind, number)
        try:
            case(rng, number, tally)
        except Exception as problem:
            tally.fail(number, f"{type(problem).__name__}: {problem}")
    return tally.outcome()


def _judged(asked: WalkClaim) -> str:
    """The rule by which the referee refuses it; empty if it accepts."""
    found = check_path(asked.path, asked.grid, _POINT, MOVES[asked.moves], asked.start, asked.goal)
    return "" if found is None else found.rule


def _paths(rng: np.random.Generator, number: int, tally: Tally) -> None:
    way = None if number % 2 == 0 else number // 2 % len(TWELVE)
    spoilt = drawn(rng, way)
    said = _judged(spoilt)
    name, rules = ("lawful", frozenset({""})) if way is None else (TWELVE[way][0], TWELVE[way][2])
    tally.case("accepted" if not said else "refused", name)
    if said not in rules:
        want = "accepted" if way is None else f"refused by {' or '.join(sorted(rules))}"
        tally.fail(number, f"{name}: {_word(said)}, to be {want}", **_data(spoilt))
    if spoilt.moves == "octile" and spoilt.cells:
        _agree(spoilt, said, number, tally)


def _agree(asked: WalkClaim, said: str, number: int, tally: Tally) -> None:
    """Both judges on one path; the public one is told the ends and the length beside its own rules."""
    rows = asked.blocked.tolist()
    public = first_wrong(rows, asked.cells) < 0
    ends = asked.cells[0] == asked.start and asked.cells[-1] == asked.goal
    path = asked.path
    right = public and ends and _is_length(path, asked.cells) and path.steps == moves_of(asked.cells)
    tally.count("judged by both")
    if right != (not said):
        word = "accept" if right else "refuse"
        tally.fail(number, f"the public rules {word} it, the referee has it {_word(said)}", **_data(asked))
    turns = turns_of(asked.cells)
    if public and (first_wrong(rows, turns) >= 0 or moves_of(turns) != moves_of(asked.cells)):
        tally.fail(number, "the public rules have its turns otherwise than its cells", **_data(asked))


def _is_length(path: Path, cells: tuple[Cell, ...]) -> bool:
    """Whether the told length is that of a walk: exactly in units of price, nearly as a fraction."""
    cardinal, ordinal = moves_of(cells)
    exact = cardinal * _OCTILE.straight + ordinal * _OCTILE.diagonal
    return path.exact == exact and math.isclose(path.cost, cardinal + math.sqrt(2) * ordinal, rel_tol=1e-12)


def _wide(rng: np.random.Generator, number: int, tally: Tally) -> None:
    """Even numbers are lawful, odd ones spoilt."""
    way = None if number % 2 == 0 else number // 2 % len(wide.WAYS)
    asked = wide.lawful(rng) if way is None else wide.spoilt(rng, way)
    cells = asked.cells
    found = check_path(asked.path, asked.grid, asked.robot, MOVES[asked.moves], cells[0], cells[-1])
    said, want = "" if found is None else found.rule, "" if way is None else wide.RULES[way]
    tally.case("accepted" if not said else "refused", "lawful, wide" if way is None else wide.WAYS[way])
    if said != want:
        data = {
            "radius": asked.radius,
            "moves": asked.moves,
            "cells": cells,
            "blocked": asked.blocked.tolist(),
        }
        tally.fail(number, f"{_word(said)}, to be {_word(want)}", **data, terrain=asked.terrain.tolist())


def _wild(rng: np.random.Generator, number: int, tally: Tally) -> None:
    """A sequence of cells of no particular lawfulness, and claims that are true of it."""
    blocked = rng.random((4, 4)) < rng.choice([0.0, 0.1, 0.3])
    cells = [(int(rng.integers(0, 4)), int(rng.integers(0, 4)))]
    for _ in range(int(rng.integers(1, 8))):
        step = rng.integers(-1, 2, 2) if rng.random() < 0.93 else rng.integers(-3, 4, 2)
        cell = (cells[-1][0] + int(step[0]), cells[-1][1] + int(step[1]))
        inside = rng.random() < 0.9
        cells.append((min(max(cell[0], 0), 3), min(max(cell[1], 0), 3)) if inside else cell)
    start = cells[0] if rng.random() < 0.95 else (int(rng.integers(0, 4)), 0)
    goal = cells[-1] if rng.random() < 0.95 else (int(rng.integers(0, 4)), 3)
    asked = WalkClaim(blocked, "octile", start, goal, tuple(cells))
    said = _judged(asked)
    tally.case("accepted" if not said else f"refused: {said}")
    _agree(asked, said, number, tally)


def _word(said: str) -> str:
    return f"refused by {said}" if said else "accepted"


def _data(asked: WalkClaim) -> dict[str, Any]:
    return {
        "blocked": asked.blocked.astype(int).tolist(),
        "moves": asked.moves,
        "start": asked.start,
        "goal": asked.goal,
        "cells": asked.cells,
        "claimed": asked.claimed,
        "cheaper": asked.cheaper,
    }


CHECK = Check(
    "referee",
    ("G27",),
    "the referee agrees with a competition's published rules, sees what they miss, and refuses spoilt paths",
    KINDS,
    run,
)
