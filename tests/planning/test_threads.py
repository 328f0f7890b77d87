"""One session, many threads: a session serves one call at a time and refuses the others.

Two threads on one session crashed the process (bidirectional A*, 400 x 400), never ended (A*), or were given
a cell off the map.
"""

from __future__ import annotations

import copy
import pickle
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Barrier, Lock, Thread
from typing import Any, ClassVar

import numpy as np
import pytest

from lampyris._core.cancellation import Cancelled
from lampyris._core.exclusive import Exclusive, one_call
from lampyris.errors import BusyError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning import registry
from lampyris.planning.base import Planner, Session, SessionBase, Traits
from lampyris.planning.field.layers import moves_for
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.graph.astar import AStar
from lampyris.planning.swarm.optimisers.box import Box
from lampyris.planning.swarm.optimisers.glowworm import GSO
from lampyris.planning.swarm.optimisers.particle import PSO
from lampyris.referee import check_plan
from lampyris.sim.continuous.drive import DriveSimulation
from lampyris.sim.grid.loop import Simulation
from lampyris.testing.overlap import Meanwhile, check_overlap
from lampyris.testing.questions import Failures
from sizes import sized

THREADS = 10
COPIES: dict[str, Callable[[Any], Any]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda one: pickle.loads(pickle.dumps(one)),
}


def small(name: str) -> Planner:
    known = registry.settings_of(registry.planner_class(name))
    return registry.make(name, {k: v for k, v in (("swarm", 5), ("iterations", 2)) if k in known})


def scene_of(side: int, share: float = 0.1, **more: Any) -> Scene:
    blocked = np.random.default_rng(3).random((side, side)) < share
    blocked[0, 0] = blocked[-1, -1] = False
    return Scene(Grid(blocked), (0, 0), (side - 1, side - 1), **more)


def from_ten_threads(call: Callable[[], bool]) -> int:
    """Call from ten threads, which begin at once, until each was told True; how many calls were refused."""
    refused, raised, begin = [0] * THREADS, list[BaseException](), Barrier(THREADS)

    def work(k: int) -> None:
        try:
            begin.wait()
            over = False
            while not over:
                try:
                    over = call()
                except BusyError:
                    refused[k] += 1
                    time.sleep(0)
        except BaseException as error:
            raised.append(error)

    threads = [Thread(target=work, args=(k,), daemon=True) for k in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(240)
    assert not any(thread.is_alive() for thread in threads), "some thread never ends"
    assert not raised, raised
    return sum(refused)


def ten_threads_on_one_session(planner: Planner, scene: Scene, calls: int) -> None:
    """``calls`` answers from one session, asked for by ten threads, each right."""
    session = planner.open(scene, np.random.default_rng(0))
    first = session.plan()
    assert first.path is not None
    answers: list[Plan] = []

    def call() -> bool:
        answers.append(session.plan())
        return len(answers) >= calls

    from_ten_threads(call)
    for plan in answers:
        assert plan.path is not None
        assert not check_plan(plan, scene)
        if not planner.traits.stochastic:
            assert plan.path.cells.tolist() == first.path.cells.tolist()
    assert len(answers) >= calls


# ---- sessions --------------------


@pytest.mark.parametrize("name", registry.names())
def test_a_call_during_another_is_refused_by_every_planner(name: str) -> None:
    failures = Failures(name)
    check_overlap(small(name), failures)
    assert failures.report() == ""


@pytest.mark.commit(2)
@sized("cases", 15, 30)
@pytest.mark.parametrize("name", registry.names())
def test_ten_threads_on_one_session_get_right_answers(name: str, cases: int) -> None:
    ten_threads_on_one_session(small(name), scene_of(24), cases)


@pytest.mark.nightly
@pytest.mark.parametrize("name", registry.names())
def test_ten_threads_on_one_session_a_thousand_calls(name: str) -> None:
    ten_threads_on_one_session(small(name), scene_of(60), 1000)


@pytest.mark.commit(24)
@pytest.mark.parametrize("name", registry.names())
@pytest.mark.parametrize(
    "error", [KeyboardInterrupt, Cancelled, MemoryError, BusyError("BUSY", "of another")]
)
def test_a_call_that_raises_leaves_the_session_usable(name: str, error: Any) -> None:
    def fail() -> None:
        raise error

    scene = scene_of(12)
    session = small(name).open(scene, np.random.default_rng(0))
    with pytest.raises(error if isinstance(error, type) else type(error)):
        session.plan(Meanwhile(fail, robot=scene.start))
    plan = session.plan()
    assert plan
    assert not check_plan(plan, scene)


@pytest.mark.commit(4)
@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize("name", registry.names())
def test_a_copy_during_a_call_is_refused_and_a_copy_is_not_busy(name: str, way: str) -> None:
    scene, came = scene_of(12), list[object]()
    session = small(name).open(scene, np.random.default_rng(0))

    def take() -> None:
        try:
            came.append(COPIES[way](session))
        except BusyError as error:
            came.append(error)

    session.plan(Meanwhile(take, robot=scene.start))
    assert isinstance(came[0], BusyError)
    assert COPIES[way](session).plan()


def test_a_method_may_call_the_one_it_overrides() -> None:
    scene = scene_of(8)
    base: Any = type(AStar().open(scene, np.random.default_rng(0)))

    class Longer(base):  # type: ignore[misc]
        def plan(self, change: Any = None, budget: Any = None) -> Plan:
            with pytest.raises(BusyError):
                copy.copy(self)
            return super().plan(change, budget)  # type: ignore[no-any-return]

    session = AStar().open(scene, np.random.default_rng(0))
    session.__class__ = Longer
    assert session.plan()
    assert session.plan()


@dataclass(frozen=True)
class Heedless:
    """A planner whose sessions let everybody in."""

    name: ClassVar[str] = "astar"
    traits: ClassVar[Traits] = Traits(optimal=True)
    summary: ClassVar[str] = "Wrong on purpose."
    source: ClassVar[str] = "This test."

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> Session:
        class Open:
            def plan(self, change: Any = None, budget: Any = None) -> Plan:
                robot = None if change is None else change.robot
                return AStar().open(scene, rng).plan(Change(robot=robot), budget)

        return Open()


def test_the_contract_refuses_a_session_that_lets_two_calls_in() -> None:
    failures = Failures("astar")
    check_overlap(Heedless(), failures)
    assert "not a BusyError; derive the session from" in failures.report()


# ---- whatever else has a memory --------------------


def crowded() -> Scene:
    return scene_of(16, 0.05, traffic=RandomWalk(count=3))


def test_ten_threads_drive_one_simulation_to_the_end_of_one_thread() -> None:
    alone = Simulation(crowded(), AStar(), seed=5)
    while alone.outcome is None:
        alone.tick()
    shared = Simulation(crowded(), AStar(), seed=5)

    def call() -> bool:
        shared.tick()
        shared.trace()
        return shared.outcome is not None

    from_ten_threads(call)
    one, other = alone.trace(), shared.trace()
    assert one.robot.tolist() == other.robot.tolist()
    assert [t.tolist() for t in one.tracks] == [t.tolist() for t in other.tracks]


def test_ten_threads_drive_one_drive_to_the_end_of_one_thread() -> None:
    alone = DriveSimulation(crowded(), AStar(), seed=5)
    while alone.outcome is None:
        alone.step()
    shared = DriveSimulation(crowded(), AStar(), seed=5)

    def call() -> bool:
        shared.step()
        return shared.outcome is not None

    from_ten_threads(call)
    one, other = alone.drive(), shared.drive()
    assert one.t.tolist() == other.t.tolist()
    assert one.s.tolist() == other.s.tolist()


def test_ten_threads_repair_one_field() -> None:
    scene = scene_of(40)
    repairer = FieldRepairer(~scene.grid.blocked, moves_for(scene), scene.goal)
    want, cell = repairer.snapshot(), (20, 21)
    turns, count = Lock(), [0]

    def call() -> bool:
        with turns:
            count[0] += 1
        repairer.repair(blocked=[cell])
        repairer.snapshot()
        repairer.copy()
        return count[0] > 200

    from_ten_threads(call)
    got = repairer.repair(freed=[cell]) if not scene.grid.blocked[cell[1], cell[0]] else repairer.field
    assert got.exact.tolist() == want.exact.tolist()
    assert got.luciferin.tolist() == want.luciferin.tolist()


@pytest.mark.parametrize("settings", [GSO(n=20), PSO(n=20)])
def test_ten_threads_tell_one_swarm(settings: Any) -> None:
    box = Box([0.0, 0.0], [1.0, 1.0])
    alone, shared = (settings.start(box, np.random.default_rng(1)) for _ in range(2))
    told = [0]

    def call() -> bool:
        shared.tell(np.ones(20))
        told[0] = shared.iteration
        return told[0] >= 40

    from_ten_threads(call)
    while alone.iteration < shared.iteration:
        alone.tell(np.ones(20))
    assert alone.positions.tolist() == shared.positions.tolist()


# ---- the guard itself --------------------


class Counter(Exclusive):
    def __init__(self) -> None:
        self.inside = 0

    @one_call
    def enter(self, again: Callable[[], object] | None = None) -> int:
        self.inside += 1
        assert self.inside == 1, "two calls are inside"
        if again is not None:
            again()
        self.inside -= 1
        return self.inside


def test_a_call_from_within_is_refused_and_the_first_goes_on() -> None:
    counter, came = Counter(), list[object]()

    def again() -> None:
        with pytest.raises(BusyError) as caught:
            counter.enter()
        came.append(caught.value)

    assert counter.enter(again) == 0
    assert str(came[0]) == (
        "error[BUSY]: Counter: enter was called during another call; allowed: one call at a time; "
        "use one object for each thread, or a lock around the calls"
    )
    assert counter.enter() == 0


def test_signals_at_any_moment_never_leave_it_busy() -> None:
    """KeyboardInterrupt comes between any two steps of the interpreter, on the way in and out as well."""
    counter, hits = Counter(), [0]

    def interrupt(*_: object) -> None:
        hits[0] += 1
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        for k in range(600):
            counter.inside = 0
            try:
                signal.setitimer(signal.ITIMER_REAL, 2e-5 + 1e-7 * (k % 97))
                while True:
                    for _ in range(10_000):
                        counter.enter()
                        counter.inside = 0
                    # CPython 3.11 can overlook a signal until the next one, or until another thread wants to run.
                    signal.raise_signal(signal.SIGALRM)
            except KeyboardInterrupt:
                pass
            counter.inside = 0
            assert counter.enter() == 0, f"busy after interrupt {k}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert hits[0] == 600


def test_every_session_of_ours_derives_from_the_base() -> None:
    scene = scene_of(6)
    for name in registry.names():
        session = registry.make(name).open(scene, np.random.default_rng(0))
        assert isinstance(session, SessionBase), name


def test_a_plan_that_a_mixin_brings_is_guarded_too() -> None:
    class Answers:
        def plan(self, change: Change | None = None, budget: Any = None) -> str:
            return self.ask()  # type: ignore[attr-defined, no-any-return]

    class First(Answers, SessionBase):
        def ask(self) -> str:
            return self.plan()

    class Last(SessionBase, Answers):
        def ask(self) -> str:
            return self.plan()

    for kind in (First, Last):
        with pytest.raises(BusyError):
            kind().plan()
