"""The referee on walls that come and go: steps by the map of their tick, cells that turned by the rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from referee_builders import Cell, footprint, random_trace, with_body

from lampyris.model.edit import Edit
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Event, Outcome, Trace
from lampyris.model.traffic import Obstacle
from lampyris.referee import check_trace
from lampyris.referee import trace as judge_room
from lampyris.referee.simulations import edits
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor
from sizes import sized

ROW = [(x, 2) for x in range(6)]
WALL, OPEN = Edit(2, ((3, 0), (3, 4))), Edit(4, (), ((3, 0),))


def judge(trace: Trace) -> str | None:
    verdict = check_trace(trace)
    return None if verdict is None else verdict.rule


def told(edits: Sequence[Edit]) -> tuple[Event, ...]:
    events = []
    for e in edits:
        for word, cells in (("wall", e.blocked), ("opened", e.freed)):
            if cells:
                events.append(Event(e.tick, word, cells[0], f"{len(cells)} cells"))
    return tuple(events)


def trace_of(
    way: Sequence[Cell], edits: Sequence[Edit], turned: Sequence[Edit] | None = None, **more: Any
) -> Trace:
    """A robot alone that drives these cells; what turned is told as given, the rest as held."""
    n, turned = len(way), edits if turned is None else turned
    there = {e.tick for e in turned}
    held = [
        Event(e.tick, "wall", e.blocked[0], "0 cells") for e in edits if e.blocked and e.tick not in there
    ]
    events = sorted((*told(turned), *(e for e in held if e.tick < n)), key=lambda e: e.tick)
    moves = MOVES[more.pop("moves", "octile")]
    grid = more.pop("grid", Grid(np.zeros((5, 6), bool)))
    scene = Scene(grid, way[0], more.pop("goal", way[-1]), moves, edits=tuple(edits), **more)
    driven = [way[0]] + [q for p, q in pairwise(way) if p != q]
    paid = moves.plain() if grid.terrain is None else moves.weighed()
    waits = n - len(driven)
    arrived = way[-1] == scene.goal
    return Trace(
        scene, "walker", 0, Outcome.ARRIVED if arrived else Outcome.TIMEOUT, np.array(way), (), (), (),
        np.zeros(n), ("waiting",) * n, "physical", "m/s", tuple(events), 0, waits, 1, 0,
        path_of(np.array(driven), paid, grid.terrain), edits=tuple(turned),
    )  # fmt: skip


def test_a_lawful_trace_and_every_lie_about_what_turned() -> None:
    good = trace_of(ROW, (WALL, OPEN))
    assert judge(good) is None
    wall, opened = good.events
    lies = {
        "nothing turned": {"edits": ()},
        "one cell too few": {"edits": (Edit(2, ((3, 0),)), OPEN)},
        "one too many": {"edits": (replace(WALL, blocked=(*WALL.blocked, (0, 0))), OPEN)},
        "a tick late": {"edits": (replace(WALL, tick=3), OPEN)},
        "the other way": {"edits": (WALL, Edit(4, ((3, 0),)))},
        "an edit too many": {"edits": (WALL, OPEN, Edit(5, ((0, 0),)))},
        "the last not": {"edits": (WALL,)},
        "an empty one": {"edits": (WALL, Edit(3), OPEN)},
        "no wall told": {"events": (opened,)},
        "nothing opened told": {"events": (wall,)},
        "told twice": {"events": (wall, wall, opened)},
        "told at another tick": {"events": (wall, Event(3, "wall", (0, 0)), opened)},
        "opened when nothing did": {"events": (wall, Event(2, "opened", (0, 0)), opened)},
    }
    for what, lie in lies.items():
        assert judge(replace(good, **lie)) == "edits", what  # type: ignore[arg-type]
    held = trace_of(ROW, (Edit(3, ((2, 2),)),), ())
    assert judge(held) is None
    assert judge(replace(held, events=())) == "edits"
    # In any order within a tick; and what comes after the end has not come.
    assert judge(replace(good, edits=(replace(WALL, blocked=WALL.blocked[::-1]), OPEN))) is None
    assert judge(trace_of(ROW, (WALL, OPEN, Edit(6, ((0, 0),))), (WALL, OPEN))) is None


@pytest.mark.parametrize(
    ("tick", "cell", "turns", "rule"),
    [
        (3, (2, 2), False, None),  # it stands there at tick 2
        (3, (2, 2), True, "edits"),
        (3, (3, 2), True, "wall"),  # it comes there in that very tick
        (3, (4, 2), True, "wall"),
        (3, (4, 2), False, "edits"),
        (3, (1, 2), True, None),  # it has gone
        (2, (1, 2), False, None),
        (3, (5, 2), False, None),  # the goal
        (3, (5, 2), True, "edits"),
        (1, (0, 2), False, None),
        (2, (0, 2), True, None),
    ],
)
def test_a_wall_on_the_way(tick: int, cell: Cell, turns: bool, rule: str | None) -> None:
    edit = Edit(tick, (cell,))
    assert judge(trace_of(ROW, (edit,), (edit,) if turns else ())) == rule


def test_a_wall_that_goes_is_no_wall_from_its_tick_on() -> None:
    blocked = np.zeros((5, 6), bool)
    blocked[2, 3] = True
    for tick, rule in ((2, None), (3, None), (4, "wall")):
        trace = trace_of(ROW, (Edit(tick, (), ((3, 2),)),), grid=Grid(blocked))
        assert judge(trace) == rule, tick
    shut = (Edit(1, ((4, 2),)), Edit(4, (), ((4, 2),)))
    assert judge(trace_of(ROW, shut)) is None


def test_corners_knights_and_discs_by_the_map_of_the_tick() -> None:
    slant = [(0, 0), (1, 1), (2, 2), (3, 3)]
    for tick, rule in ((1, "corner"), (2, "corner"), (3, None)):
        assert judge(trace_of(slant, (Edit(tick, ((1, 2),)),))) == rule
        assert judge(trace_of(slant, (Edit(tick, ((1, 2),)),), moves="dissertation")) is None
    knight = [(0, 2), (2, 3), (4, 4)]
    for tick, rule in ((1, "knight"), (2, "knight")):
        assert judge(trace_of(knight, (Edit(tick, ((3, 3),)),), moves="sixteen-connected")) == rule
    assert judge(trace_of([*knight, (5, 4)], (Edit(3, ((3, 3),)),), moves="sixteen-connected")) is None
    wide = Grid(np.zeros((7, 12), bool))
    row, robot = [(x, 3) for x in range(2, 9)], Robot(radius=1.0)
    # At tick 2 it covers columns 3 to 5 of rows 2 to 4: (6, 2) turns, and its next step is over it.
    for tick, cell, rule in ((3, (6, 2), "sweep"), (6, (4, 2), None), (3, (6, 1), None)):
        assert judge(trace_of(row, (Edit(tick, (cell,)),), grid=wide, robot=robot)) == rule, (tick, cell)
    under = Edit(3, ((5, 2),))
    assert judge(trace_of(row, (under,), (), grid=wide, robot=robot)) is None
    assert judge(trace_of(row, (under,), grid=wide, robot=robot)) == "edits"


def test_bodies_by_the_map_of_the_tick() -> None:
    track = [(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (4, 0)]
    for tick, cell, turns, rule in (
        (3, (3, 0), True, "obstacle wall"),
        (3, (2, 0), False, None),
        (3, (2, 0), True, "edits"),
        (3, (1, 0), True, None),
        (3, (4, 0), True, "obstacle wall"),
    ):
        edit = Edit(tick, (cell,))
        alone = trace_of(ROW, (edit,), (edit,) if turns else ())
        assert judge(with_body(alone, 0, track)) == rule, (tick, cell)
    # One that has not appeared covers nothing; one with a size covers more than its own cell.
    edit = Edit(3, ((0, 4),))
    assert judge(with_body(trace_of(ROW, (edit,)), 3, [(1, 4)] * 3)) is None
    assert judge(with_body(trace_of(ROW, (edit,)), 3, [(0, 4)] * 3)) == "obstacle wall"
    assert judge(with_body(trace_of(ROW, (edit,), ()), 2, [(0, 4)] * 4)) is None
    tall = Grid(np.zeros((9, 6), bool))
    beside = Edit(3, ((2, 7), (4, 7)))
    wide = trace_of(ROW, (beside,), (Edit(3, ((4, 7),)),), grid=tall)
    assert judge(with_body(wide, 0, [(2, 6)] * 6, radius=1.0)) is None
    moved = [(2, 6)] * 3 + [(3, 6)] * 3
    assert judge(with_body(wide, 0, moved, radius=1.0)) == "obstacle wall"


def test_the_ground_is_that_of_the_map_as_given() -> None:
    terrain = np.full((5, 6), 63, np.uint8)
    shut = (Edit(1, ((4, 2),)), Edit(4, (), ((4, 2),)))
    trace = trace_of(ROW, shut, grid=Grid(np.zeros((5, 6), bool), terrain=terrain))
    assert trace.cost == 10.0
    assert judge(trace) is None
    assert trace.path is not None
    cheap = replace(trace.path, paid=trace.path.exact - 63)
    assert judge(replace(trace, path=cheap)) == "cost"


@pytest.mark.nightly
@sized("cases", 60, 90)
def test_of_one_mind_with_the_slow_monitor(cases: int) -> None:
    """Random edits thrown into lawful traces: both find a fault in the same ones."""

    class OfWalls(Monitor):
        def kinds(self) -> None:
            """Nothing is specified here."""

    rng, found = np.random.default_rng(8), {True: 0, False: 0}
    for k in range(cases):
        trace = random_trace(rng, ["octile", "dissertation", "four-connected"][k % 3])
        height, width = trace.scene.grid.blocked.shape
        some, tick = [], 0
        while (tick := tick + int(rng.integers(1, 6))) <= trace.ticks + 2 and len(some) < 3:
            n = int(rng.integers(1, 9))
            cells = {(int(rng.integers(width)), int(rng.integers(height))) for _ in range(n)}
            both = sorted(cells)
            some.append(Edit(tick, tuple(both[: n // 2 + 1]), tuple(both[n // 2 + 1 :])))
        trace = replace(trace, scene=replace(trace.scene, edits=tuple(some)))
        monitor = OfWalls(trace)
        turned = [Edit(t, tuple(sorted(w)), tuple(sorted(f))) for t, (w, f) in sorted(monitor.turned.items())]
        held = [Event(t, "wall", min(c), "0 cells") for t, c in monitor.kept.items()]
        held = [e for e in held if not any(x.tick == e.tick and x.blocked for x in turned)]
        events = sorted((*trace.events, *told(turned), *held), key=lambda e: e.tick)
        trace = replace(trace, edits=tuple(turned), events=tuple(events))
        # The referee asks of bodies where they are, not how they turn corners.
        faults = [
            f
            for f in OfWalls(trace).faults()
            if ("wall" in f or "turned" in f or "corner" in f) and ("corner" not in f or ": -1 " in f)
        ]
        verdict = check_trace(trace)
        assert (verdict is None) == (not faults), (k, verdict, faults[:3])
        found[verdict is None] += 1
    assert min(found.values()) > 0.23 * cases, found


def test_a_referee_that_knows_one_map_only_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """It refuses what is lawful and passes what is broken."""
    blocked = np.zeros((5, 6), bool)
    blocked[2, 3] = True
    through = trace_of(ROW, (Edit(2, (), ((3, 2),)),), grid=Grid(blocked))
    over = trace_of(ROW, (Edit(3, ((4, 2),)),))
    assert (judge(through), judge(over)) == (None, "wall")
    monkeypatch.setattr(judge_room, "eras_of", lambda trace: [edits.Era(0, trace.ticks, Edit(0))])
    assert (judge(through), judge(over)) == ("edits", "edits")
    monkeypatch.setattr(judge_room, "edits_violation", lambda trace, eras: None)
    assert (judge(through), judge(over)) == ("wall", None)


def test_footprints_are_those_of_the_builders() -> None:
    for radius in (0.0, 0.4, 0.8, 1.0, 1.2):
        trace = trace_of(ROW, (Edit(1, ((0, 0),)),))
        body = Obstacle("patrol", radius, True, footprint(radius))
        far = replace(trace, tracks=(np.array([(3, 9)] * 6),), appears=(0,), obstacle_specs=(body,))
        covered = edits._covered(far, 0)
        assert covered == {(0, 2)} | {(3 + dx, 9 + dy) for dx, dy in footprint(radius)}
