"""One run: a job as plain data in, what came of it as plain data out. It is the same in every process.

:func:`work` takes a batch of jobs as JSON and gives their results as JSON, in the same order. It never raises
for what a job does: that is its ending. What it says is not believed: :mod:`lampyris.study.execution.verify` rebuilds
it.

Endings: ``done``, a result of whatever outcome. ``refused``, a typed error that the question deserves.
``timeout``, the budget in seconds was used up: looked at after each plan, each tick and each period, so a
planner that never answers is not stopped. ``failed``, a fault of ours or of a third-party planner, reported in one line.

Jobs of one world come one after the other, and what they share is kept: unpacked maps, fields and tracks. Nothing that
is kept changes a result.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lampyris._core.cancellation import uninterrupted
from lampyris.errors import InputError, InternalFault, LampyrisError
from lampyris.kernels import loading
from lampyris.kernels._jit import compiled_only
from lampyris.model.drive import Drive
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import LifelongTrace
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.trace import Trace
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.pose_route import pose_route
from lampyris.planning import registry
from lampyris.planning.base import Budget, Planner
from lampyris.planning.field.frame import SCRATCH
from lampyris.planning.spacetime.search_room import LASTING_STATES, ROOM
from lampyris.sim.grid import loop
from lampyris.study.design.serialize import unpacked_fleet
from lampyris.study.design.study import canonical
from lampyris.study.design.study_map import unpack
from lampyris.study.execution import site
from lampyris.study.execution.drive_evidence import drive_evidence
from lampyris.study.execution.evidence import plan_evidence, trace_evidence
from lampyris.study.execution.fleets import drive_evidence as fleet_drives
from lampyris.study.execution.fleets.fleet_evidence import fleet_evidence
from lampyris.study.execution.fleets.fleet_runs import fleet_of, load_planner, run_of_fleet
from lampyris.study.execution.pose_evidence import pose_plan_evidence
from lampyris.study.execution.site import RecentCache, StudyWorld, not_a_job, world_of

SCRATCH_KEPT = 1 << 19
"""Bytes of room for fields that are kept from job to job.

More is made again, which adds at most 2 % to a field of 192 to 512 cells a side.
"""
MAX_WORDS = 500
"""Characters of what is said of an error."""

_grids: RecentCache[Grid] = RecentCache(site.CELLS_KEPT)


class RunResult(NamedTuple):
    """What a job came to: a plan, with the speeds on it if it found a path; a trace; or a drive, of fleets with its plan."""

    noun: Plan | Trace | Drive | FleetPlan | FleetTrace | LifelongTrace
    profile: Profile | None = None
    driven: FleetPlan | None = None
    fleet: Fleet | None = None


class TimeUp(Exception):
    """The budget in seconds is used up."""


@dataclass
class _Clock:
    """The budget in seconds of this thread's CPU."""

    budget: float | None
    began: float
    plan_s: float | None = None
    cost_by_s: str = ""

    def look(self, *_: object) -> None:
        """Raise if it is used up."""
        if self.budget is not None and loading.cpu() - self.began > self.budget:
            raise TimeUp


def work(batch: bytes) -> bytes:
    """Run a batch of jobs.

    Parameters
    ----------
    batch : JSON: ``grounds``, packed maps by hash; ``jobs``, each job's plain data; ``memory``, whether to
        measure its peak in a second run of each job; of a study of fleets ``fleets``, packed fleets by hash.

    Returns
    -------
    JSON: ``results``, one for each job in their order: ``key``, ``ending``, ``error``, ``evidence`` (None
    unless done) and ``timing``.

    Raises
    ------
    InputError : ``BATCH``: it cannot be read as a batch.
    """
    grounds, jobs, memory, fleets = _read(batch)
    with compiled_only():
        results = []
        for plain in jobs:
            results.append(_result(plain, grounds, memory, fleets))
            SCRATCH.shrink(SCRATCH_KEPT)  # the next job's planner may have no use for it
            ROOM.shrink(LASTING_STATES)  # now, even if the job's session is still waiting for the collector
        return canonical({"results": results})


def run_job(plain: Mapping[str, Any], grid: Grid, fleets: Mapping[str, Any] | None = None) -> RunResult:
    """Run one job and give its nouns, not yet refereed.

    Parameters
    ----------
    plain : of a job (:class:`lampyris.study.design.study.Job`).
    grid : the map that it names.
    fleets : packed fleets by hash, of a study of fleets.

    Raises
    ------
    TimeUp : the budget in seconds is used up.
    LampyrisError : see the endings.
    """
    return _run(plain, grid, _Clock(plain["budget"]["seconds"], loading.cpu()), fleets)


# ---- a batch --------------------


def _read(batch: bytes) -> tuple[Mapping[str, Any], list[Any], bool, Mapping[str, Any]]:
    try:
        request = json.loads(batch)
        grounds, jobs, memory = request["grounds"], request["jobs"], request["memory"]
        fleets = request.get("fleets", {})
        tables = isinstance(grounds, Mapping) and isinstance(fleets, Mapping)
        if tables and isinstance(jobs, list) and isinstance(memory, bool):
            return grounds, jobs, memory, fleets
        wrong = "grounds, jobs or memory of another type"
    except (ValueError, TypeError, KeyError, RecursionError) as why:
        wrong = f"{type(why).__name__}: {why}"
    raise InputError("BATCH", wrong, where="batch", allowed="JSON with grounds, jobs and memory")


def _result(
    plain: Any, grounds: Mapping[str, Any], memory: bool, fleets: Mapping[str, Any]
) -> dict[str, Any]:
    """What came of a job."""
    out: dict[str, Any] = {"key": "", "ending": "failed", "error": "", "evidence": None, "timing": {}}
    wall, clock = time.perf_counter(), _Clock(None, loading.cpu())
    try:
        if not isinstance(plain, Mapping):
            raise InputError("JOB", f"a {type(plain).__name__}", where="job", allowed="a job of a study")
        out["key"] = hashlib.sha256(canonical(plain)).hexdigest()
        try:
            name, clock.budget = plain["map"], plain["budget"]["seconds"]
            grid = _grid(name, float(plain["resolution"]), grounds, plain.get("origin"))
        except (KeyError, TypeError, ValueError) as wrong:
            raise not_a_job(wrong) from None
        ran = _run(plain, grid, clock, fleets)
        out["timing"] = _timing(ran, clock, wall)
        out["evidence"] = _evidence(ran, plain, grid)
        out["ending"] = "done"
        if memory:
            out["timing"]["memory_b"] = _peak(plain, grid, fleets)
    except TimeUp:
        out["ending"], out["error"] = "timeout", f"SECONDS: more than {clock.budget:g} s of CPU"
    except InternalFault as fault:
        out["error"] = _line(fault)
    except LampyrisError as refusal:
        out["ending"], out["error"] = "refused", _line(refusal)
    except (Exception, SystemExit) as fault:  # a third-party planner may raise anything
        out["error"] = _line(fault)
    if out["ending"] != "done":
        out["evidence"], out["timing"] = None, _seconds(clock, wall)
    return out


def _line(wrong: BaseException) -> str:
    """Code and words in one line."""
    if isinstance(wrong, LampyrisError):
        words = str(wrong).removeprefix(f"error[{wrong.code}]: ")
        code = wrong.code
    else:
        code = "MEMORY" if isinstance(wrong, MemoryError) else "FAULT"
        words = f"{type(wrong).__name__}: {' '.join(str(wrong).split())}"
    text = "".join(c if c.isprintable() else "?" for c in f"{code}: {words}")
    return text if len(text) <= MAX_WORDS else f"{text[: MAX_WORDS - 4]} ..."


def _grid(name: str, resolution: float, grounds: Mapping[str, Any], origin: Any = None) -> Grid:
    """The map of a job, with the cells, the resolution and (where there are poses) the origin that the job says."""

    def make() -> Grid:
        if name not in grounds:
            raise InputError("BATCH", f"no map {name!r}", where="batch", allowed="the maps of its jobs")
        return unpack(grounds[name], name)

    grid = _grids.get((name, resolution, canonical(origin)), make, 250_000)
    if grid.resolution != resolution:
        what = f"{grid.resolution:g} metres a cell"
        raise InputError("BATCH", what, where=f"map {name}", allowed=f"{resolution:g}, as its job says")
    if origin is not None and list(grid.origin) != origin:
        what = f"the origin {list(grid.origin)}"
        raise InputError("BATCH", what, where=f"map {name}", allowed=f"{origin}, as its job says")
    return grid


def _seconds(clock: _Clock, wall: float) -> dict[str, Any]:
    out: dict[str, Any] = {
        "cpu_s": loading.cpu() - clock.began,
        "wall_s": max(time.perf_counter() - wall, 0.0),
    }
    if clock.plan_s is not None:
        out["plan_s"] = clock.plan_s
    if clock.cost_by_s:
        out["cost_by_s"] = clock.cost_by_s
    return out


def _timing(ran: RunResult, clock: _Clock, wall: float) -> dict[str, Any]:
    planning_s = ran.noun.timing.get("planning_s")
    if planning_s is not None:
        clock.plan_s = float(planning_s)
    return _seconds(clock, wall)


def _evidence(ran: RunResult, plain: Mapping[str, Any], grid: Grid) -> dict[str, Any]:
    noun = ran.noun
    if isinstance(noun, FleetPlan):
        return fleet_evidence(noun)
    if isinstance(noun, FleetTrace):
        return fleet_drives.drive_evidence(noun, ran.driven)
    if isinstance(noun, LifelongTrace):
        return fleet_drives.lifelong_evidence(noun)
    if isinstance(noun, Plan):
        form = pose_plan_evidence if world_of(plain, grid).place.poses else plan_evidence
        return form(noun, ran.profile)
    if isinstance(noun, Drive):
        return drive_evidence(noun)
    return trace_evidence(noun, replayed=world_of(plain, grid).replayed)


def _peak(plain: Mapping[str, Any], grid: Grid, fleets: Mapping[str, Any]) -> int:
    """Peak of the memory that a run of its own takes, bytes: nothing that is kept is used."""
    import gc
    import tracemalloc

    site.forget()
    gc.collect()
    tracemalloc.start()
    try:
        _run(plain, grid, _Clock(None, loading.cpu()), fleets)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        site.forget()


# ---- a job --------------------


def _run(
    plain: Mapping[str, Any], grid: Grid, clock: _Clock, fleets: Mapping[str, Any] | None = None
) -> RunResult:
    if plain.get("kind") == "fleet":
        return _fleet(plain, grid, clock, fleets or {})
    world = world_of(plain, grid)
    try:
        planner_plain, law_plain = plain["planner"], plain["law"]
        planner = registry.make(planner_plain["name"], planner_plain["settings"])
        law = laws.with_settings(law_plain["name"], law_plain["settings"])
        budget = Budget(plain["budget"]["expansions"])
        run = _KINDS[plain["kind"]]
        ticks, patience, driven = plain["ticks"], plain["patience"], dict(plain["drive"])
    except (KeyError, TypeError) as wrong:
        raise not_a_job(wrong) from None
    return run(_Task(plain, world, planner, law, budget, ticks, patience, driven, clock))


@dataclass
class _Task:
    """A job with everything made that its words name."""

    plain: Mapping[str, Any]
    world: StudyWorld
    planner: Planner
    law: Any
    budget: Budget
    ticks: int | None
    patience: int | None
    drive: dict[str, Any]
    clock: _Clock

    @property
    def last_tick(self) -> int:
        return self.world.last_tick(self.ticks)

    @property
    def given(self) -> Budget | None:
        """The budget as a planner is given it."""
        return None if self.budget.expansions is None else self.budget


def _plan(task: _Task) -> RunResult:
    """A plan, and the law's speeds on it."""
    world, clock = task.world, task.clock
    scene = world.place.scene
    if world.replayed and task.planner.traits.sees_traffic:
        scene = world.among(task.last_tick)
    began = loading.cpu()
    seed = np.random.Generator(np.random.PCG64(world.seed))
    plan = task.planner.open(scene, seed, record=False).plan(None, task.given)
    clock.plan_s = loading.cpu() - began
    clock.look()
    if plan.path is None:
        return RunResult(plan)
    if plan.pose_path is not None:
        route, seen = pose_route(plan.pose_path, scene, task.law)
        return RunResult(plan, laws.profile(route, seen, law=task.law))
    return RunResult(plan, laws.profile_on_cells(plan.path, scene, law=task.law))


def _fleet(plain: Mapping[str, Any], grid: Grid, clock: _Clock, fleets: Mapping[str, Any]) -> RunResult:
    """Many robots. Their seconds are the planner's own limit: it may answer with what it has."""
    try:
        packed = fleets[plain["fleet"]]
        asked = fleet_of(plain, grid, unpacked_fleet(packed, grid))
        if clock.budget is not None:
            load_planner(plain)
    except (KeyError, TypeError, ValueError) as wrong:
        if isinstance(wrong, LampyrisError):
            raise
        raise not_a_job(wrong) from None
    made = run_of_fleet(plain, asked)
    clock.plan_s, clock.cost_by_s = made.plan_s, made.cost_by_s
    return RunResult(made.noun, None, made.plan, asked)


def _simulate(task: _Task) -> RunResult:
    """A simulation in ticks."""
    world, last = task.world, task.last_tick
    if not world.replayed:
        return RunResult(_simulated(task, world.scene))
    if task.planner.traits.sees_traffic:
        return RunResult(_simulated(task, world.among(last)))
    # Nobody else can tell how far the tracks go before the run gets there. What they do not need is not
    # drawn: on maps of 50 x 50 cells a run takes 70 ticks, and the last is the 1200th.
    far = task.world.place.far
    ticks = min(last, far + far // 4 + 16)
    while True:
        try:
            return RunResult(_simulated(task, world.among(ticks), ticks))
        except _Outlasted:
            ticks = min(last, 4 * ticks)


class _Outlasted(Exception):
    """A run is longer than the tracks that were drawn for it."""


def _simulated(task: _Task, scene: Scene, drawn: int | None = None) -> Trace:
    """By the loop; ``drawn``: ticks of tracks."""
    clock = task.clock

    def look(tick: int) -> None:
        clock.look()
        if drawn is not None and tick > drawn:
            raise _Outlasted

    watched = drawn is not None or clock.budget is not None
    return loop.run(
        scene, task.planner, seed=task.world.seed, ticks=task.last_tick, law=task.law, patience=task.patience,
        sensor=site.sensor_of(task.plain), goal_track=site.goal_track_of(task.plain), budget=task.given,
        progress=look if watched else None,
    )  # fmt: skip


def _drive(task: _Task) -> RunResult:
    """A drive in continuous time."""
    world = task.world
    scene = world.scene
    if world.replayed:
        scene = world.among(world.drive_ticks(DriveSettings.of(task.drive)))
    with uninterrupted():  # loaded here: most runs steer nothing
        from lampyris.sim.steering import controller_choice as driving

    made = driving.drive(
        scene, task.planner, law=task.law, seed=world.seed, budget=task.given, progress=task.clock.look,
        **task.drive,
    )  # fmt: skip
    return RunResult(made)


_KINDS: Mapping[str, Callable[[_Task], RunResult]] = {"plan": _plan, "simulate": _simulate, "drive": _drive}
