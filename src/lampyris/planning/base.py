"""The planner contract: a planner is frozen settings plus traits; a session is its memory.

Adding a planner is one file and one line: see CONTRIBUTING.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import CancelToken
from lampyris._core.exclusive import Exclusive, one_call
from lampyris._core.scalars import MOST_WHOLE, is_real, is_whole
from lampyris.errors import SettingError, shown
from lampyris.kernels._jit import Kernel
from lampyris.model.change import Change
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene

FOUR = "four-connected"
BOTH = (FOUR, "octile")
"""The step sets that fleets may use."""


@dataclass(frozen=True, slots=True)
class FleetTraits:
    """What a planner of fleets promises. None is free of conflicts by promise: the referee judges every plan.

    Parameters
    ----------
    complete : it finds a plan if there is one, given time and memory, and says that there is none only if so.
    reaches : every robot comes to its goal after finitely many ticks, though not all are there at once, on maps where
        neighbouring free cells always lie on a common cycle; with four-connected moves and the settings that its docstring
        names.
    optimal : its plans have the least sum of costs.
    bounded : they cost at most ``weight`` times the lower bound that comes with them.
    anytime : it goes on to cheaper plans until the budget is used.
    stochastic : plans depend on the seed.
    sizes : it plans for discs of several sizes, larger than cells among them. The others take robots that fit in their
        cells (:func:`lampyris.model.fleet.fleet.most_radius`).
    moves : the step sets that it knows: ``four-connected``, ``octile``.
    """

    complete: bool = False
    reaches: bool = False
    optimal: bool = False
    bounded: bool = False
    anytime: bool = False
    stochastic: bool = False
    sizes: bool = False
    moves: tuple[str, ...] = (FOUR,)


@dataclass(frozen=True, slots=True)
class Traits:
    """What code may ask of a planner instead of its class name.

    Parameters
    ----------
    optimal : every path it finds in a static map has the least cost.
    incremental : a session reuses earlier work after a Change.
    stochastic : answers depend on the random generator given to ``open``.
    sees_traffic : it plans with where obstacles will be, not only where they are.
    plans_headings : it plans poses (``Plan.pose_path``) for the robot's footprint and drive; the scene's moves and
        terrain are not for it.
    """

    optimal: bool
    incremental: bool = False
    stochastic: bool = False
    sees_traffic: bool = False
    plans_headings: bool = False


@dataclass(frozen=True, slots=True)
class Budget:
    """Limits of one call of a planner.

    Parameters
    ----------
    expansions : greatest number of cells expanded by one call of ``plan``; None: no limit.
    seconds : wall time for one call of ``plan``, > 0; None: no limit. A call that exceeds it
        returns the status ``limit``, within 50 ms, or 5 % of the limit if that is more. Time for loading or compiling
        kernels does not count. Which calls exceed it depends on the machine; nothing else does.
    stop : stops the call when it is set, from any thread; the status is then ``cancelled``.

    Raises
    ------
    SettingError : ``BUDGET``.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> plan = lampyris.plan(scene, "astar", budget=lampyris.Budget(expansions=3))
    >>> plan.status.value
    'limit'
    """

    expansions: int | None = None
    seconds: float | None = None
    stop: CancelToken | None = None

    def __post_init__(self) -> None:
        e = self.expansions
        if e is not None and not is_whole(e, 1):
            allowed = f"a whole number, 1 to {MOST_WHOLE}, or None"
            raise SettingError.of("BUDGET", "expansions", shown(e), allowed=allowed)
        s = self.seconds
        if s is not None and not (is_real(s) and s > 0):
            raise SettingError.of(
                "BUDGET", "seconds", shown(s), allowed="a finite number > 0, or None (no limit)"
            )
        if self.stop is not None and not isinstance(self.stop, CancelToken):
            raise SettingError.of(
                "BUDGET", "stop", shown(self.stop), allowed="a lampyris.CancelToken, or None"
            )


@runtime_checkable
class Session(Protocol):
    """A planner's memory of one scene.

    A session serves one call at a time: what derives from :class:`SessionBase` refuses a second one with
    :class:`lampyris.errors.BusyError`. Threads that plan at once open a session each; several sessions of one
    planner do not disturb each other.
    """

    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """A path from where the robot is to the goal, given what is new.

        A search that fails is a Plan whose status says so; it never raises for that. The plan starts at
        ``change.robot`` (or where the robot was last known to be, at first the scene's start).

        Raises
        ------
        BusyError : another call is at work on this session, in another thread or around this one.
        """
        ...


@dataclass(slots=True)
class SensedNow:
    """What a simulation knows when it asks for next steps alone, in arrays that it goes on to write to.

    Cells are numbers of the map with a border one cell wide: ``(y + 1) * (width + 2) + x + 1``.

    Parameters
    ----------
    robot : the robot's cell.
    tick, now : when it stands there, and of when the obstacles' places are: ``tick``, or ``tick + 1``.
    closed, count : cells that obstacles close to its next step, and how many there are; its own is not among them.
    where, step_x, step_y, new : int64, of each obstacle: its cell, its last step, whether it has just appeared.
    obstacles : how many there are.
    live : whether all of them are of one cell, and nothing is known of their future.
    limit : greatest number of states expanded by this call; None: no limit. An answer that would take more has to be
        asked for as a plan.
    """

    robot: int
    tick: int
    now: int
    closed: NDArray[np.int64]
    count: int
    where: NDArray[np.int64]
    step_x: NDArray[np.int64]
    step_y: NDArray[np.int64]
    new: NDArray[np.int64]
    obstacles: int
    live: bool
    limit: int | None = None


@dataclass(slots=True)
class NextSteps:
    """A plan as far as a simulation needs it, in the numbers of :class:`SensedNow`.

    Parameters
    ----------
    path : int64; its first cells are the path, as far as it was asked for. Overwritten by the next answer.
    steps : of the whole path; -1: hemmed in.
    commit : how many of them are committed to; with ``enter``, ticks.
    expansions : states expanded.
    enter : int64, when each cell is to be entered; None: one step a tick.
    """

    path: NDArray[np.int64]
    steps: int
    commit: int
    expansions: int
    enter: NDArray[np.int64] | None = None


@dataclass(slots=True)
class AnswersInTicks:
    """How a kernel that does ticks asks a session by itself: see :mod:`lampyris.kernels.simulation.asking`.

    Parameters
    ----------
    kernel : in place of :func:`lampyris.kernels.simulation.ticks.advance`, with its arguments, and ``asked`` and ``rest``
        after them.
    asked : int64, as there.
    rest : arguments of the kernel.
    path, enter : as in :class:`NextSteps`.
    """

    kernel: Kernel
    asked: NDArray[np.int64]
    rest: tuple[Any, ...]
    path: NDArray[np.int64]
    enter: NDArray[np.int64] | None = None


class SessionBase(Exclusive):
    """What sessions derive from, built in or brought along: it keeps their ``plan`` to one call at a time.

    A second call is refused with :class:`lampyris.errors.BusyError`, at once and without an effect.
    ``copy.copy``, ``copy.deepcopy`` and pickling give a session that answers as the original would and shares
    nothing with it; a copy cannot be taken during a call.
    """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        owner = next((kind for kind in cls.__mro__ if "plan" in kind.__dict__), None)
        # A mixin that is no session itself may bring the method.
        if owner is cls or (owner is not None and not issubclass(owner, SessionBase)):
            guarded = one_call(owner.__dict__["plan"])
            setattr(cls, "plan", guarded)  # noqa: B010 - a type checker knows no assigned methods

    def share_map(self) -> None:
        """Take what the map as given comes to from an earlier session that had the same, or leave it to the next.

        Asked for before the first plan, by simulations on a map that nobody edits. Answers are the same; a session need not
        share anything.
        """


@runtime_checkable
class Planner(Protocol):
    """Frozen settings that can open sessions: a frozen dataclass, its fields are the settings."""

    name: ClassVar[str]
    traits: ClassVar[Traits]
    summary: ClassVar[str]
    """One line for tables and menus."""
    source: ClassVar[str]
    """The publication, and what is ours."""

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> Session:
        """Start a session.

        Parameters
        ----------
        scene : what to plan in.
        rng : every draw comes from it.
        record : keep a per-iteration record in ``Plan.jumps``, if the planner has one.
        """
        ...
