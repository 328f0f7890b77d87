"""A field repaired, and a search continued, after each edit are those made from scratch."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from lampyris.model.moves import MOVES
from lampyris.planning.base import Planner
from lampyris.planning.field import repair as repairing
from lampyris.planning.incremental.dstar import DStar
from lampyris.planning.incremental.dstar_lite import DStarLite
from lampyris.planning.incremental.focussed_dstar import FocussedDStar
from lampyris.planning.incremental.lpa_star import LpaStar
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.changes.repair_every import Group, edits
from lampyris_selfcheck.checks.changes.repair_story import data, plan_through, repair_through
from lampyris_selfcheck.reference.paths.changing_map import Cell
from lampyris_selfcheck.reference.paths.edit_stories import story

PLANNERS: tuple[Planner, ...] = (DStar(), FocussedDStar(), LpaStar(), DStarLite())

EVERY_3, EVERY_4 = 9 << 9, 16 << 16

KINDS = {
    "3x3": Kind(
        "every edit of every 3x3 grid: fields of the four step sets, and the four planners; ends take turns",
        commit=EVERY_3 // 3,
        nightly=EVERY_3,
        release=EVERY_3,
        chunk=576,
        whole=EVERY_3,
    ),
    "4x4": Kind(
        "the same of every 4x4 grid",
        commit=0,
        nightly=EVERY_4,
        release=EVERY_4,
        chunk=4_096,
        whole=EVERY_4,
    ),
    "stories": Kind(
        "six edits of a map of up to 64 x 64: walls, terrain, obstacles, a robot that moves and has a size;"
        " the field and the four planners after each",
        commit=100,
        nightly=10_000,
        release=100_000,
        chunk=50,
    ),
}


@contextmanager
def never_anew() -> Iterator[None]:
    """Small maps are repaired here, where solving them anew would be quicker."""
    before = repairing.GIVE_UP, repairing.HOPELESS
    repairing.GIVE_UP = repairing.HOPELESS = 1
    try:
        yield
    finally:
        repairing.GIVE_UP, repairing.HOPELESS = before


def run(ask: Ask, part: Part) -> Outcome:
    """Judge some cases."""
    tally = Tally(part)
    with never_anew():
        if part.kind == "stories":
            _stories(ask, tally, part)
        else:
            _every(tally, part, 3 if part.kind == "3x3" else 4)
    return tally.outcome()


# ---- every edit -------------------------------------------------------------------------------------------


def _every(tally: Tally, part: Part, side: int) -> None:
    """The cases of an exhaustive kind. What keeps the field of a grid lives through all its edits, so a part
    that begins among them lives through those before, too: no case depends on the part that it is in.
    """
    rows = edits(side)
    first = part.first - part.first % 2
    while first and rows[first // 2 - 1, 0] == rows[first // 2, 0]:
        first -= 2
    group = None
    for number in range(first, part.first + part.cases):
        bits, cell = (int(v) for v in rows[number // 2])
        wrong, words = "", {"raised"}
        try:
            if group is None or group.bits != bits:
                group = _group(side, bits)
            words = group.edit(cell, number % 2 == 0)
        except Exception as error:
            wrong = f"{type(error).__name__}: {error}"
            group = None
        if number >= part.first:
            tally.case(*sorted(words))
            if wrong:
                way = "freed" if number % 2 == 0 else "blocked again"
                tally.fail(number, f"{wrong}; cell {cell} {way}", side=side, bits=bits, cell=cell)


def _group(side: int, bits: int) -> Group:
    """Which fields are kept and who is asked: fields of all step sets; goals and starts take turns, and so do
    the planners' step sets."""
    names, cells = list(MOVES), side * side
    # Odd, so that the ends go through all pairs of cells over the grids.
    turn = bits * 7 + 3

    def end(k: int) -> Cell:
        at = k % cells
        return at % side, at // side

    fields = [(name, end(turn + 4 * k)) for k, name in enumerate(names)]
    asked = [(p, names[(bits + k) % 4], end(turn // cells), end(turn)) for k, p in enumerate(PLANNERS)]
    return Group(side, bits, fields, asked)


# ---- stories ----------------------------------------------------------------------------------------------


def _stories(ask: Ask, tally: Tally, part: Part) -> None:
    """Drawn lives of a map."""
    for number in part.numbers:
        told = story(ask.seed, number)
        try:
            repairer = repair_through(told)
            seen = plan_through(told, PLANNERS)
        except Exception as error:
            tally.case("raised")
            tally.fail(number, f"{type(error).__name__}: {error}", **data(told))
            continue
        tally.case(told.name, "terrain" if told.terrain is not None else "plain ground")
        tally.count("fields repaired", repairer.repaired)
        tally.count("fields solved anew", repairer.solved - 1)
        for word, times in sorted(seen.items()):
            tally.count(f"answers: {word}", times)


CHECK = Check(
    "repair",
    ("G3",),
    "after every edit the repaired field, and the search continued, are those made from scratch",
    KINDS,
    run,
)
