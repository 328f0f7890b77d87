"""Limits: how many cells pass between two looks, what a stopped call says, and what its session says next."""

from __future__ import annotations

import signal
import threading
import time
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris import Budget, CancelToken, Change, Scene, Status
from lampyris._core import cancellation
from lampyris.errors import SettingError
from lampyris.kernels import _helpers
from lampyris.kernels._jit import KERNELS, Kernel
from lampyris.kernels.graph import any_angle, bidirectional, jps, search
from lampyris.kernels.incremental import dstar, dstar_lite
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Plan
from lampyris.planning import registry
from lampyris.planning.base import Session
from lampyris.planning.field.solve import solve
from lampyris.planning.session_limits import within
from lampyris.referee import check_plan
from lampyris.study.execution import run as running

FIRST_PATH = {"rrt", "rrt-connect"}
"""Planners that return the first path that they find: how long it is depends on their draws."""
OURS = tuple(name for name in registry.names() if not registry.origin_of(name))


def scene_of(side: int = 24, moves: str = "octile", *, terrain: bool = False, seed: int = 3) -> Scene:
    rng = np.random.Generator(np.random.PCG64(seed))
    blocked = rng.random((side, side)) < 0.2
    blocked[:2, :2] = blocked[-2:, -2:] = False
    ground = rng.integers(0, 200, blocked.shape).astype(np.uint8) if terrain else None
    return Scene(Grid(blocked, terrain=ground), (0, 0), (side - 1, side - 1), moves=MOVES[moves])


def open_(name: str, scene: Scene, seed: int = 0) -> Session:
    return registry.make(name).open(scene, np.random.Generator(np.random.PCG64(seed)))


class Word(list[int]):
    """A word that becomes 1 at its n-th look."""

    def __init__(self, looks: int) -> None:
        super().__init__([0])
        self.left = looks

    def __getitem__(self, k: Any) -> Any:
        self.left -= 1
        return 0 if self.left > 0 else 1


class Met(Exception):
    pass


def expansions_after(kernel: Kernel, name: str, looks: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """How many cells a planner's kernel has expanded when it stops at its n-th look."""
    seen: list[int] = []
    names = kernel.plain.__code__.co_varnames[: kernel.plain.__code__.co_argcount]
    told = next((k for k, word in enumerate(names) if word in ("result", "state")), -1)

    def call(self: Kernel, *args: Any) -> Any:
        if self is not kernel:
            return self.run_plain(*args)
        returned = self.run_plain(*args, Word(looks))
        seen.append(int(returned[1]) if isinstance(returned, tuple) else int(args[told][1]))
        raise Met

    with monkeypatch.context() as m:
        m.setattr(Kernel, "__call__", call)
        blocked = np.zeros((70, 70), dtype=np.bool_)
        for k, y in enumerate(range(4, 66, 4)):
            blocked[y] = True
            blocked[y, 0 if k % 2 else 69] = False
        scene = Scene(Grid(blocked), (1, 1), (68, 68), moves=MOVES["octile"])
        with pytest.raises(Met):
            open_(name, scene).plan()
    return seen[0]


@pytest.mark.parametrize(
    ("name", "kernel", "most"),
    [
        ("dijkstra", search.search, _helpers.LOOK),
        ("bidirectional-astar", bidirectional.meet_even, _helpers.LOOK),
        ("dstar", dstar.process, _helpers.LOOK),
        ("dstar-lite", dstar_lite.d_star_lite, _helpers.LOOK),
        ("lpa-star", dstar_lite.lpa_star, _helpers.LOOK),
    ],
)
def test_so_many_cells_between_two_looks(
    name: str, kernel: Kernel, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = [expansions_after(kernel, name, looks, monkeypatch) for looks in (1, 2, 3)]
    assert done[0] == 0  # the first look is before any work
    # A turn of an incremental search may renew a key instead of expanding a cell.
    assert all(0 < b - a <= most for a, b in pairwise(done)), done


def test_jump_points_and_lines_of_sight_are_looked_at_more_often(monkeypatch: pytest.MonkeyPatch) -> None:
    assert [expansions_after(jps.jump, "jps", n, monkeypatch) for n in (1, 2)] == [0, 1]
    some = [expansions_after(any_angle.theta, "theta-star", n, monkeypatch) for n in (1, 2, 3)]
    assert some[1] - some[0] == some[2] - some[1] == any_angle.LOOK


def field_looks(name: str, *, terrain: bool, monkeypatch: pytest.MonkeyPatch) -> tuple[int, int]:
    """How often the kernels of a field look, and how many cells the map has."""
    free = np.ones((50, 40), dtype=np.bool_)
    looks = [0]

    class Counted(Word):
        def __getitem__(self, k: Any) -> Any:
            looks[0] += 1
            return 0

    def call(self: Kernel, *args: Any) -> Any:
        return self.run_plain(*args, Counted(1)) if self._halts else self.run_plain(*args)

    with monkeypatch.context() as m:
        for kernel in KERNELS:
            m.setattr(kernel, "arrays", None)  # the loops that are compiled
        m.setattr(Kernel, "__call__", call)
        moves = MOVES[name].weighed() if terrain else MOVES[name].plain()
        solve(free, moves, (3, 3), terrain=np.zeros(free.shape, dtype=np.uint8) if terrain else None)
    return looks[0], free.size


@pytest.mark.parametrize("terrain", [False, True])
@pytest.mark.parametrize("name", list(MOVES))
def test_a_field_looks_at_every_row_and_every_level(
    name: str, terrain: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks, cells = field_looks(name, terrain=terrain, monkeypatch=monkeypatch)
    # Rows are laid out and get their parents; levels are at least as many as the map is long.
    assert 50 + 50 + 46 <= looks <= cells / 2


@pytest.mark.commit(8)
@pytest.mark.parametrize("name", OURS)
def test_a_call_that_is_stopped_before_it_starts(name: str) -> None:
    scene, stop = scene_of(), CancelToken()
    session = open_(name, scene)
    stop.set()
    plan = session.plan(None, Budget(stop=stop))
    assert (plan.status, plan.path, plan.sentence) == (
        Status.CANCELLED,
        None,
        "Stopped on request.",
    )
    again, fresh = session.plan(), open_(name, scene).plan()
    assert again.status is fresh.status
    assert again.status is Status.FOUND
    assert again.path is not None
    assert fresh.path is not None
    assert np.array_equal(again.path.cells, fresh.path.cells)


@pytest.mark.commit(2)
@pytest.mark.parametrize("name", OURS)
def test_a_session_after_calls_that_were_stopped_anywhere_answers_as_a_fresh_one(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The n-th look of the call stops it, whatever n is; each call brings a change, which is not lost."""
    scene = scene_of(18, terrain=name == "astar")
    wall = ((9, 9), (9, 10), (10, 9))
    as_told = open_(name, Scene(scene.grid, scene.start, scene.goal, moves=scene.moves))
    session, n, stopped = open_(name, scene), 0, 0
    change = Change(blocked=wall)
    looks: list[int] = [0]
    is_over = cancellation.CancelScope.is_over.fget
    assert is_over is not None

    def counted(self: cancellation.CancelScope) -> bool:
        looks[0] -= 1
        if looks[0] == 0:
            self.word[0] = 1
        return bool(is_over(self))

    real = Kernel._run

    def run(self: Kernel, args: tuple[Any, ...]) -> Any:
        if not self._halts:
            return real(self, args)
        assert args[-1] is cancellation.word(), self.__name__
        if cancellation.watch() is None:  # shielded, or a call without a limit: nothing stops it
            return real(self, args)
        looks[0] -= 1
        if looks[0] == 0:
            args[-1][0] = 1
        return real(self, args)

    monkeypatch.setattr(cancellation.CancelScope, "is_over", property(counted))
    monkeypatch.setattr(Kernel, "_run", run)
    for n in range(1, 12):
        looks[0] = n
        plan = session.plan(change, Budget(seconds=3600.0))
        change = Change()
        stopped += plan.status is Status.LIMIT
    looks[0] = -1
    assert stopped > 0, n
    fresh = as_told.plan(Change(blocked=wall))
    again = session.plan()
    assert again.status is fresh.status
    if again.path is not None and fresh.path is not None:
        blocked = scene.grid.blocked.copy()
        for x, y in wall:
            blocked[y, x] = True
        changed = Scene(Grid(blocked, terrain=scene.grid.terrain), scene.start, scene.goal, moves=scene.moves)
        assert check_plan(again, changed) is None
        if name not in FIRST_PATH:
            assert again.path.exact == fresh.path.exact
        if not registry.planner_class(name).traits.stochastic:
            assert np.array_equal(again.path.cells, fresh.path.cells)


def test_a_limit_ends_a_call_and_says_so() -> None:
    # A swarm that would go on for minutes.
    scene = scene_of(40)
    planner = registry.make("gso", {"iterations": 100_000, "swarm": 200, "seeded": False})
    plan = planner.open(scene, np.random.Generator(np.random.PCG64(1))).plan(None, Budget(seconds=0.05))
    assert plan.status is Status.LIMIT
    assert plan.sentence == "Stopped after 0.05 s, its limit, before the search was over."
    assert lampyris.plan(scene, planner, budget=Budget(seconds=0.05)).status is Status.LIMIT


def test_another_thread_stops_a_call() -> None:
    stop = CancelToken()
    planner = registry.make("mmas-dstar", {"iterations": 100_000, "swarm": 200})
    session = planner.open(scene_of(40), np.random.Generator(np.random.PCG64(1)))
    threading.Timer(0.1, stop.set).start()
    assert session.plan(None, Budget(stop=stop)).status is Status.CANCELLED
    assert stop.is_set


def test_an_outer_limit_stops_inner_calls_and_is_the_outer_ones_to_answer() -> None:
    stop = CancelToken()
    session = open_("astar", scene_of())
    with cancellation.watching(stop=stop):
        stop.set()
        with pytest.raises(cancellation.Cancelled):
            session.plan(None, Budget(seconds=60.0))
        with cancellation.shielded():
            assert session.plan().status is Status.FOUND
    assert session.plan().status is Status.FOUND


def clocks() -> int:
    """Threads that wait for a limit."""
    return sum(thread.name == "lampyris-limit" for thread in threading.enumerate())


def test_without_a_limit_there_is_no_thread_and_no_word() -> None:
    while clocks():
        time.sleep(0.001)  # those of tests before this one end by themselves
    with cancellation.watching() as watch:
        assert (watch, cancellation.watch(), cancellation.word() is cancellation._never(), clocks()) == (
            None,
            None,
            True,
            0,
        )
        cancellation.checkpoint()
    with cancellation.watching(seconds=50.0):
        assert clocks() == 1
    while clocks():
        time.sleep(0.001)


def test_ctrl_c_reaches_a_loop_that_reads_the_word_alone() -> None:
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        pytest.skip("Ctrl-C is ignored here")

    def interrupted() -> None:
        with cancellation.interrupts():
            signal.raise_signal(signal.SIGINT)
            cancellation.checkpoint()

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert cancellation.watch() is None
    assert signal.set_wakeup_fd(-1) == -1


def test_the_ctrl_c_that_a_study_takes_over_stops_no_loop_and_the_next_does() -> None:
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        pytest.skip("Ctrl-C is ignored here")

    def heard(interrupt: cancellation.CancelToken, seconds: float) -> bool:
        until = time.perf_counter() + seconds
        while not interrupt.is_set and time.perf_counter() < until:
            time.sleep(0.001)
        return interrupt.is_set

    def interrupted() -> None:
        watch = cancellation.watch()
        assert watch is not None
        with running._Calm(at_once=False) as calm:
            signal.raise_signal(signal.SIGINT)
            # The study has given the handler back before the thread that listens reads of the signal.
            assert not heard(watch.stops[-1], 0.05)
            cancellation.checkpoint()
            with pytest.raises(KeyboardInterrupt):
                calm.check()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert heard(watch.stops[-1], 10.0)

    for _ in range(10):
        with cancellation.interrupts():
            interrupted()


def test_a_study_without_ctrl_c_leaves_the_next_one_to_nobody() -> None:
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        pytest.skip("Ctrl-C is ignored here")
    with cancellation.interrupts():
        with running._Calm(at_once=False):
            listening = cancellation._listening
            assert listening is not None
            assert listening.is_left
        left = listening.is_left
    assert (left, cancellation._listening) == (False, None)


def test_a_planner_that_answers_whatever_goes_wrong_is_stopped_all_the_same() -> None:
    def guest() -> Plan:
        try:
            cancellation.checkpoint()
        except Exception:
            return Plan(Status.NO_PATH, "guest")
        return Plan(Status.FOUND, "guest")

    stop = CancelToken()
    stop.set()
    assert within(Budget(stop=stop), "guest", guest).status is Status.CANCELLED


def test_a_limit_that_cannot_be_watched_leaves_no_watch_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    stop = CancelToken()
    monkeypatch.setattr(threading.Thread, "start", full)
    with pytest.raises(RuntimeError, match="new thread"), cancellation.watching(1.0, stop):
        pass
    assert cancellation.watch() is None
    assert not stop._watches


@pytest.mark.parametrize("bad", [0, -1.0, float("nan"), float("inf"), True, "1"])
def test_seconds_are_a_number_above_0(bad: Any) -> None:
    with pytest.raises(SettingError, match="seconds"):
        Budget(seconds=bad)


def test_a_stop_is_a_stop() -> None:
    with pytest.raises(SettingError, match="stop"):
        Budget(stop=threading.Event())  # type: ignore[arg-type]
