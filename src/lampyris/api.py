"""The public functions: load_grid, plan, smooth, speed_profile, simulate, drive.

Each takes the scene first, then one planner or law (a name or an object), then keyword options. Nothing
leaves through them that the referee has not re-checked.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from lampyris import referee
from lampyris._core import defaults
from lampyris._core.cancellation import uninterrupted
from lampyris._core.defaults import (
    POINTS_SMOOTH,
    PROFILE_SMOOTH,
    SAMPLE_SMOOTH,
    SAMPLE_SPACING,
    SMOOTHING,
    Smooth,
)
from lampyris._core.limits import MAX_CELLS, NODES, PATH, TICKS, demand_memory
from lampyris._core.predicates import numbers
from lampyris._core.scalars import MAX_SEED, SEED_RANGE, in_range, is_whole, is_word
from lampyris._core.values import completed
from lampyris.errors import SettingError, UsageError, callable_or_none, of_kind, shown
from lampyris.io.maps.load import load_map
from lampyris.kernels import loading
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import Path
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.robot import LEAST, inscribed_disc
from lampyris.model.scene import Scene
from lampyris.model.traffic import ObstacleSpec, Recorded
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.profile import start_speed
from lampyris.planning.assess import assess
from lampyris.planning.base import Budget, Planner
from lampyris.planning.field.layers import free_space
from lampyris.planning.least_steps import demand_at_least, least_steps
from lampyris.planning.selection import chosen_planner
from lampyris.planning.session_limits import within
from lampyris.sim.world.endings import ending_sentence
from lampyris.typing import CellLike, Points

if TYPE_CHECKING:
    from lampyris.model.drive import Drive
    from lampyris.model.settings.sensor import Sensor
    from lampyris.model.trace import Trace
    from lampyris.sim.sensor import ObstacleSensor
    from lampyris.sim.traffic.motion_sources import MotionSource


MIN_SPACING = 1e-3
"""Least distance of two nodes of a sampled path, in cells."""


def load_grid(
    path_or_name: str | os.PathLike[str],
    *,
    values: str = defaults.VALUES,
    colour: str = defaults.COLOUR,
    resolution: float | None = None,
    max_cells: int = MAX_CELLS,
    allow_outside: bool = False,
    strict: bool = False,
) -> Grid:
    """The grid of a map file or of a bundled map.

    Parameters
    ----------
    path_or_name : a picture (PNG, BMP, PGM), a MovingAI ``.map``, text, a NumPy file, or a bundled name.
    values : what grey samples and numbers are: ``occupancy`` or ``costmap``.
    colour : what to do with a colour that is not of the legend: ``legend`` refuses it, ``luminance`` reads
        the picture as grey.
    resolution : metres a cell; None: the file's own, or 1.
    max_cells : maps of more cells are refused.
    allow_outside, strict : see :func:`lampyris.io.maps.load.load_map`, as for all of these.

    Raises
    ------
    FileError : it cannot be read as a map.
    LimitError : it is larger than a map may be.
    SettingError : an option out of its range, or one that does not go with the file.

    Examples
    --------
    >>> import lampyris
    >>> grid = lampyris.load_grid("env-1")
    >>> grid.width, grid.height, grid.resolution
    (50, 50, 1.0)
    """
    return load_map(
        path_or_name, values=values, colour=colour, resolution=resolution, max_cells=max_cells,
        allow_outside=allow_outside, strict=strict,
    ).grid  # fmt: skip


def plan(
    scene: Scene,
    planner: str | Planner = defaults.PLANNER,
    *,
    seed: int = 0,
    budget: Budget | None = None,
    record: bool = True,
    planner_settings: Mapping[str, Any] | None = None,
    **settings: Any,
) -> Plan:
    """Plan a path from the scene's start, through its via points, to its goal; re-checked and compared with the optimum.

    Parameters
    ----------
    scene : what to plan in, as it is at tick 0: later edits are ignored. Planners that see
        traffic (``sipp``) plan with its recorded obstacles; all others ignore traffic: see :func:`simulate`.
    planner : a name (see ``lampyris.list_planners()``) or a planner object.
    seed : seed of all random draws; the same seed gives the same plan.
    budget : when to give up. Its seconds cover opening, searching and assessing (a plan may be returned
        without its optimum and gates); the referee's check is additional.
    record : keep AD-GSO's per-iteration record in ``Plan.jumps``.
    planner_settings : the planner's settings by name, for those that have the name of an argument of this function.
    **settings : the planner's settings, such as ``choice="exact"``.

    Raises
    ------
    UsageError : no such planner; ``SETTING_CLASH``: an argument that is called as one of the planner's
        settings is, without ``planner_settings``; ``VIA``: via points, and a planner that plans times or poses.
    SettingError : a setting it does not have, or out of its range; settings together with a planner object.
    InternalFault : the referee refused the result; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> plan = lampyris.plan(scene, "astar")
    >>> plan.status.value, plan.path.cost, plan.gap
    ('found', 11.242640687119286, 0.0)
    """
    chosen = chosen_planner(
        plan, planner, planner_settings, settings, seed=seed, budget=budget, record=record
    )
    of_kind("scene", scene, Scene)
    _small_enough(scene, chosen, "planning")
    of_kind("budget", budget, Budget, none=True)
    of_kind("record", record, bool)
    poses = chosen.traits.plans_headings
    if not poses:
        demand_at_least(PATH, scene, least_steps(scene) + 1, "even a straight path")
    rng = np.random.Generator(np.random.PCG64(_seed(seed)))
    began, loaded = loading.wall(), loading.seconds()
    answers: list[tuple[Plan, float]] = []

    def search(scene: Scene, budget: Budget | None) -> Plan:
        # Nobody keeps the session: its memory is free for what comes after it.
        made = chosen.open(scene, rng, record=record).plan(None, budget)
        if made.path is not None:
            PATH.demand(len(made.path.cells), "the path")
        return made

    def judged(made: Plan, scene: Scene) -> Plan:
        made = assess(made, scene)
        return replace(made, detail=ending_sentence(made, scene))

    def answer() -> Plan:
        if scene.via:
            from lampyris.planning.through import plan_through  # with threads, which no other plan needs

            made = plan_through(scene, chosen, budget, lambda leg, left: judged(search(leg, left), leg))
            PATH.demand(0 if made.path is None else len(made.path.cells), "the path")
            return replace(made, detail=made.detail or ending_sentence(made, scene))
        made = search(scene, budget)
        answers.append((made, loading.wall()))
        return made if poses else judged(made, scene)

    found = within(budget, chosen.name, answer)
    assessed = loading.wall()
    first, planned = answers[0] if answers else (found, assessed)
    found = found if found.status is first.status else first  # no time was left to judge it
    if found.path is not None or not poses:
        referee.demand(referee.check_plan(found, scene))
    ended, loaded = loading.wall(), loading.seconds() - loaded
    timing = {"plan_s": planned - began, "assess_s": assessed - planned, "referee_s": ended - assessed}
    return replace(
        found,
        frame=scene.grid.frame,
        timing={**timing, "total_s": ended - began + loaded, "loading_s": loaded},
    )


def smooth(
    scene: Scene,
    path: Plan | Path | ArrayLike,
    *,
    method: Smooth | None = None,
    spacing: float | None = None,
) -> SampledPath:
    """A drivable path, sampled at the nodes where speeds are decided; re-checked by the referee.

    Parameters
    ----------
    scene : the map and the robot's radius and turning circle.
    path : a path, a plan that found one, or any polyline: float64 (n, 2), cells. The curve of a plan keeps the
        clearance that its attributes asked for, and is not straightened where they shape it.
    method : ``straight``: pulled straight where there is room, then its corners rounded. ``arcs``: the path's own
        lines, their corners rounded; what was sampled from circles becomes circles again. ``none``: its own
        lines; each corner is rounded within half a step, or a stop where walls or the turning circle leave
        no room for an arc. None: ``straight`` for a plan or a path of cells, a curve that is good to drive
        (:func:`speed_profile`, which keeps the cells, has another default); ``arcs`` for points.
    spacing : metres between two nodes, at most; None: a quarter of a cell
        (:data:`lampyris._core.defaults.SAMPLE_SPACING`). Where the room or a zone changes
        quickly they are closer together.

    Raises
    ------
    SettingError : a plan without a path; a path through a blocked cell or off the map; ``SPACING``.
    InternalFault : the referee refused the curve; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> curve = lampyris.smooth(scene, lampyris.plan(scene, "astar"))
    >>> curve.s.shape, bool(curve.s[0] == 0.0)
    ((45,), True)
    """
    return _smoothed(scene, path, method, spacing, "method")


def speed_profile(
    scene: Scene,
    path: Plan | Path | SampledPath,
    law: laws.SpeedLaw = "physical",
    *,
    v0: float = 0.0,
    smooth: Smooth = PROFILE_SMOOTH,
    spacing: float | None = None,
    obstacle_states: ObstacleStates | None = None,
    law_settings: Mapping[str, Any] | None = None,
    tick_seconds: float | None = None,
) -> Profile:
    """A speed for every node of a path, each with its cause, re-checked by the referee.

    Parameters
    ----------
    scene : the map, its speed zones and the robot's limits.
    path : a path, a plan that found one, or a sampled path (see :func:`smooth`).
    law : a name, such as ``physical`` (SI units) or ``dissertation`` (velocity units; m/s on a sampled path), or
        settings of a law.
    v0 : speed at the start, in the profile's units.
    smooth : of a path or a plan. ``none``: the nodes are the path's own cells; each corner is rounded within
        half a step of its node and driven as slowly as ``a_lat_max`` asks, or is a stop where the robot's
        ``turn_radius`` does not fit (see :func:`lampyris.motion.geometry.sampled_path.corners_of_path`). ``straight`` or
        ``arcs``: the path is made a curve first, as :func:`smooth` does. The default is that of ``lampyris
        plan`` and ``lampyris speed``, :data:`lampyris._core.defaults.PROFILE_SMOOTH`.
    spacing : as for :func:`smooth`, with ``straight`` or ``arcs``.
    obstacle_states : moving obstacles in continuous time, as sensed now.
    law_settings : settings of the law that is named, such as ``{"blind.reach": 4.0}``.
    tick_seconds : seconds of a tick of the scene's recorded obstacles: a plan's cells are driven among them,
        with waits, by ``physical`` from rest; without ``smooth``, ``spacing`` and ``obstacle_states``.

    Raises
    ------
    UsageError : no such law; settings given twice; ``OPTIONS``: ``smooth`` or ``spacing`` where they
        would have no effect.
    SettingError : a plan without a path; a setting it does not have; v0 too fast to stop in time.
    InternalFault : the referee refused the profile; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> profile = lampyris.speed_profile(scene, lampyris.plan(scene, "astar"))
    >>> float(profile.v.max()), profile.cause[0]
    (1.0, 'start')
    """
    of_kind("scene", scene, Scene)
    of_kind("obstacle_states", obstacle_states, ObstacleStates, none=True)
    of_kind("law_settings", law_settings, Mapping, none=True)
    if not is_word(smooth, tuple(SMOOTHING)):
        raise SettingError("SMOOTH", shown(smooth), where="smooth", allowed=", ".join(SMOOTHING))
    start_speed(v0)
    if law_settings:
        if not isinstance(law, str):
            raise UsageError("LAW", "settings given twice", where="law_settings", allowed="a law's name")
        law = laws.with_settings(law, law_settings)
    if tick_seconds is not None:
        plain = smooth == "none" and spacing is None and obstacle_states is None and v0 == 0.0
        made = _scheduled(path, scene, laws.settings_named(law), tick_seconds, plain)
        return replace(made, frame=scene.grid.frame)
    poses, whole = path.pose_path if isinstance(path, Plan) else None, scene
    if poses is not None:
        if smooth != "none":
            raise UsageError(
                "OPTIONS", "poses are driven as they are", where="smooth", allowed="a path of cells"
            )
        if obstacle_states is not None:  # kept clear of the circle around the robot, wherever it looks
            obstacle_states = replace(obstacle_states, radius=obstacle_states.radius + scene.robot.radius)
        from lampyris.motion.laws.pose_route import pose_route

        path, scene = pose_route(poses, scene, law, node_spacing(scene, spacing))
        smooth, spacing = "none", None
    along = path if isinstance(path, SampledPath) else _path(path)
    if isinstance(along, SampledPath) and (smooth != "none" or spacing is not None):
        given = "smooth" if smooth != "none" else "spacing"
        raise UsageError(
            "OPTIONS", "a sampled path is drawn already", where=given, allowed="a plan or a path"
        )
    if spacing is not None and smooth == "none":
        raise UsageError("OPTIONS", "the nodes are the path's cells", where="spacing", allowed="with smooth")
    if smooth != "none" and not isinstance(path, SampledPath):
        along = _smoothed(scene, path, smooth, spacing, "smooth")
    if isinstance(along, Path):
        made = laws.profile_on_cells(along, scene, law=law, obstacle_states=obstacle_states, v0=v0)
    else:
        made = laws.profile(along, scene, law=law, obstacle_states=obstacle_states, v0=v0)
    _judge(made, along, scene, laws.settings_named(law), v0, whole)
    return replace(made, frame=scene.grid.frame)


def _smoothed(
    scene: Scene, path: object, method: Smooth | None, spacing: float | None, option: str
) -> SampledPath:
    """See :func:`smooth`; ``option`` is what the caller calls the method."""
    from lampyris.motion.geometry.curve import polyline_of
    from lampyris.motion.geometry.smoothing import drawn, wanted_of
    from lampyris.motion.laws.node_refinement import refined
    from lampyris.referee.geometry.curve import check_curve

    usual: Smooth = SAMPLE_SMOOTH if isinstance(path, Plan | Path) else POINTS_SMOOTH
    drawing = usual if method is None else method
    if not is_word(drawing, tuple(SMOOTHING)):
        raise SettingError("SMOOTH", shown(method), where=option, allowed=", ".join(SMOOTHING))
    of_kind("scene", scene, Scene)
    step = node_spacing(scene, spacing)
    points = polyline_of(_path(path)) if isinstance(path, Plan | Path) else _points(path)
    few_nodes(points, scene, spacing)
    wanted = wanted_of(path, scene.grid.resolution) if isinstance(path, Plan) else None
    curve, lines = drawn(points, scene.grid, scene.robot, drawing, wanted)
    referee.demand(check_curve(curve, scene.grid, scene.robot, lines))
    return refined(sample_curve(curve, step), scene)


def _scheduled(
    path: Plan | Path | SampledPath, scene: Scene, chosen: Any, tick_seconds: float, plain: bool
) -> Profile:
    """A plan's schedule driven with real accelerations, past the referee."""
    if not (plain and isinstance(path, Plan) and isinstance(chosen, PhysicalLaw)):
        raise UsageError(
            "SCHEDULE",
            "tick_seconds together with options that a schedule does not support",
            where="tick_seconds",
            allowed="a plan, the law physical or a variant, no smooth, spacing, obstacle_states or v0",
        )
    from lampyris.motion.timing.scheduled import scheduled_profile

    _path(path)
    made = scheduled_profile(path, scene, tick_seconds, law=chosen)
    creep = chosen.creep if chosen.clearance else 1.0
    referee.demand(referee.check_profile(made, None, scene, v0=0.0, creep=creep, slowest=LEAST))
    return made


def _judge(
    made: Profile, along: Path | SampledPath, scene: Scene, chosen: Any, v0: float, whole: Scene
) -> None:
    """Have the referee look at a profile: the motion itself, and the caps that its law promises.

    ``whole`` is the scene with the robot as it is: on a path of poses the laws are given one without a radius.
    """
    robot = scene.robot
    if isinstance(along, SampledPath) and made.law == "dissertation":
        # It knows no limits of the robot but the top speed; how it is driven must still add up.
        free = {"a_max": 1e30, "d_max": 1e30, "v_max": robot.v_max * (1 + 1e-9), "v0": None}
        referee.demand(referee.check_motion(made.s, made.v, made.a, made.t, **free))  # type: ignore[arg-type]
        return
    ours = chosen if isinstance(chosen, PhysicalLaw) else PhysicalLaw()
    # A share of 1 asks nothing of the walls.
    creep = getattr(chosen, "creep", ours.creep) if ours.clearance else 1.0
    path = along if isinstance(along, Path) else None
    plain = ours == PhysicalLaw(creep=ours.creep) and scene.zones is None
    slowest = None if plain else LEAST
    corners = path is not None and ours.curvature
    curve = along.curve if isinstance(along, SampledPath) else None
    found = referee.check_profile(
        made,
        path,
        scene,
        v0=v0,
        creep=creep,
        slowest=slowest,
        corners=corners,
        stops=path is not None,
        curve=curve,
    )
    referee.demand(found)
    if isinstance(along, SampledPath) and along.curve is not None and made.law != "rpp":
        static = made.law != "optimum"
        from lampyris.referee.caps import check_caps

        found = check_caps(
            made,
            along.curve,
            whole,
            creep=creep,
            curvature=ours.curvature,
            clearance=static and ours.clearance,
            zones=static and ours.zones,
        )
        referee.demand(found)


def node_spacing(scene: Scene, spacing: float | None) -> float:
    """Metres between two nodes, as asked for or by default."""
    resolution = scene.grid.resolution
    step = SAMPLE_SPACING * resolution if spacing is None else spacing
    if not in_range(step, MIN_SPACING * resolution, 1e6):
        raise SettingError(
            "SPACING",
            f"{shown(spacing)} m",
            where="spacing",
            allowed=f"{MIN_SPACING * resolution:g} to 1e6 metres",
        )
    return float(step)


def few_nodes(points: Points, scene: Scene, spacing: float | None) -> None:
    """Refuse a polyline that is too long for its spacing before any of its lines is looked at.

    A curve along it is not longer; its pieces' borders are nodes besides.

    Parameters
    ----------
    points : (n, 2), cells.
    scene : whose cells they are.
    spacing : as for :func:`smooth`.

    Raises
    ------
    SettingError : ``SPACING``.
    LimitError : ``NODES``.
    """
    step = node_spacing(scene, spacing) / scene.grid.resolution
    xy = np.asarray(points, dtype=np.float64)
    if xy.ndim == 2 and xy.shape[1:] == (2,) and np.isfinite(xy).all():
        d = xy[1:] - xy[:-1]
        nodes = float(np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]).sum()) / step
        NODES.demand(int(min(nodes, 1e15)), "the path", instead="choose a larger spacing")


def _small_enough(scene: Scene, planner: Planner, doing: str) -> None:
    """Refuse a map on which a planner would take more memory than is allowed."""
    grid, border = scene.grid, scene.moves.reach
    what = f"{doing} with {planner.name}"
    demand_memory(grid.height, grid.width, border, what)


def _points(path: object) -> Points:
    """A polyline as an array, (n, 2)."""
    points = numbers(path, (None, 2))
    if points is None:
        raise SettingError(
            "PATH_POINTS", shown(path), where="path", allowed="a plan, a path, or numbers (n, 2)"
        )
    return points


def _path(given: object) -> Path:
    path = given.path if isinstance(given, Plan) else given
    if path is None:
        raise SettingError("PROFILE", "this plan holds no path", allowed="a plan whose status is found")
    of_kind("path", path, Path)
    assert isinstance(path, Path)
    return path


def simulate(
    scene: Scene, planner: str | Planner = defaults.PLANNER, *,
    traffic: ObstacleSpec | Sequence[ObstacleSpec] | None = None, seed: int = 0,
    ticks: int | None = None, law: str = "physical", patience: int | None = None, sensor: Sensor | None = None,
    goal_track: Recorded | Sequence[CellLike] | None = None, budget: Budget | None = None,
    progress: Callable[[int], None] | None = None, planner_settings: Mapping[str, Any] | None = None, **settings: Any,
) -> Trace:  # fmt: skip
    """Simulate a run among moving obstacles, tick by tick; every tick is re-checked by the referee.

    Parameters
    ----------
    scene : its edits take effect, its via points are visited one after the other.
    planner : a name or a planner object.
    traffic : moving obstacles; None: the scene's own.
    seed : seed of all random draws; the same seed gives the same trace.
    ticks : when to stop; None: a number that depends on the size of the map.
    law : the speed law.
    patience : consecutive ticks the robot waits before it gives up.
    sensor : of a robot that does not know the map: it plans by the walls that it has seen, takes all other cells for free,
        and replans where a wall comes into sight on its path. None: it knows the map.
    goal_track : the goal's cell at each tick from 0, which is the scene's goal; after the last it stays. Planners that see
        traffic know it all and plan the earliest meeting; others are given the goal's cell whenever it has moved. None:
        the goal stands still.
    budget : when each call of the planner gives up; the robot then waits, and asks again in the next tick.
    progress : called with each tick.
    planner_settings : the planner's settings by name. A planner may have a setting called as an argument here
        is (``patience`` of ``mmas-dstar``): the argument is then refused without this one, and with it, even
        empty, it is the simulation's.
    **settings : the planner's settings that are whose names are none of the above.

    Raises
    ------
    UsageError : ``SETTING_CLASH``: an argument that might be the planner's setting.
    SceneError : obstacles that do not fit the map; ``EDIT_TRACK``: an edit in a recorded lane.
    SceneError : ``GOAL_TRACK``: a track of the goal that leaves the map, meets a wall, jumps or begins elsewhere.
    SettingError : ``VIA``: via points and a goal that moves. ``SENSOR_EDITS``, ``GOAL_EDITS``: a sensor, or a goal that moves,
        together with edits.
    InternalFault : the referee refused the trace; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> trace = lampyris.simulate(scene, "ad-gso", traffic=lampyris.RandomWalk(3), seed=2)
    >>> trace.outcome.value, len(trace.robot)
    ('arrived', 13)
    """
    chosen = chosen_planner(
        simulate, planner, planner_settings, settings, traffic=traffic, seed=seed, ticks=ticks, law=law,
        patience=patience, sensor=sensor, goal_track=goal_track, budget=budget, progress=progress,
    )  # fmt: skip
    if "lampyris.sim.grid.loop" in sys.modules:
        from lampyris.sim.grid import loop
    else:
        with uninterrupted():
            from lampyris.sim.grid import loop

    of_kind("scene", scene, Scene)
    from lampyris.model.settings.sensor import Sensor

    of_kind("sensor", sensor, Sensor, none=True)
    _small_enough(scene, chosen, "simulating")
    scene = among(scene, traffic)
    of_kind("budget", budget, Budget, none=True)
    callable_or_none("progress", progress)
    if ticks is None:
        instead = "say how many ticks there are"
        demand_at_least(TICKS, scene, least_steps(scene), "even a straight path", instead=instead)
    trace = loop.run(
        scene, chosen, seed=_seed(seed), ticks=ticks, law=law, patience=patience, sensor=sensor, goal_track=goal_track,
        budget=budget, progress=progress,
    )  # fmt: skip
    began = time.perf_counter()
    referee.demand(referee.check_trace(trace))
    timing = {**trace.timing, "referee_s": time.perf_counter() - began}
    return completed(trace, detail=ending_sentence(trace, scene), timing=timing)


def drive(
    scene: Scene,
    planner: str | Planner = defaults.PLANNER,
    *,
    traffic: ObstacleSpec | Sequence[ObstacleSpec] | None = None,
    seed: int = 0,
    law: laws.SpeedLaw = "physical",
    sources: Sequence[MotionSource] = (),
    sensor: ObstacleSensor | None = None,
    budget: Budget | None = None,
    progress: Callable[[float], None] | None = None,
    planner_settings: Mapping[str, Any] | None = None,
    **settings: Any,
) -> Drive:
    """Drive among moving obstacles in continuous time; every moment is re-checked by the referee.

    Parameters
    ----------
    scene, planner, traffic, seed : as for :func:`simulate`; the scene's traffic moves from cell to cell.
    law : a speed law's name, or its settings.
    sources : obstacles in addition to the traffic, such as :class:`lampyris.sim.traffic.adversary.Adversary`.
    sensor : what reports obstacles to the robot (None: a perfect sensor), such as :class:`lampyris.sim.sensor.FaultySensor`.
    budget : when each call of the planner gives up.
    progress : called with the elapsed seconds.
    planner_settings : the planner's settings by name; needed for names that are also settings of a drive, see
        :func:`simulate`.
    **settings : those of :class:`lampyris.model.settings.drive.DriveSettings`; all others are the planner's.

    Raises
    ------
    UsageError : ``SETTING_CLASH``: a setting that might be the drive's or the planner's; ``CONTROLLER``: a controller that
        steers, and a planner that plans no headings; ``VIA``: via points and a planner of poses.
    SceneError : obstacles that do not fit the map.
    SettingError : a setting that neither a drive nor the planner has, or out of its range; ``EDITS``: walls
        change; ``OBSTACLE_SPEED``: traffic that passes more than 100 cells between two decisions.
    InternalFault : the referee refused the drive; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> drive = lampyris.drive(scene, "astar", traffic=lampyris.RandomWalk(2), seed=1)
    >>> drive.outcome.value
    'arrived'
    """
    # Loaded here, and by simulate: who plans has no use for a simulator.
    with uninterrupted():
        from lampyris.model.settings.drive import split_settings
        from lampyris.sim.steering import controller_choice as driving

    ours, rest = split_settings(settings)
    chosen = chosen_planner(
        drive, planner, planner_settings, rest, traffic=traffic, seed=seed, law=law, sources=sources,
        sensor=sensor, budget=budget, progress=progress, **ours,
    )  # fmt: skip
    of_kind("scene", scene, Scene)
    _small_enough(scene, chosen, "driving")
    scene = among(scene, traffic, poses=chosen.traits.plans_headings)
    of_kind("budget", budget, Budget, none=True)
    callable_or_none("progress", progress)
    _with_method("sensor", () if sensor is None else (sensor,), "tell")
    _with_method("sources", sources, "open")
    made = driving.drive(
        scene, chosen, law=law, seed=_seed(seed), sources=sources, sensor=sensor, budget=budget,
        progress=progress, **ours,
    )  # fmt: skip
    began = time.perf_counter()
    referee.demand(referee.check_drive(made))
    timing = {**made.timing, "referee_s": time.perf_counter() - began}
    return replace(made, detail=ending_sentence(made, scene), timing=timing)


def among(
    scene: Scene, traffic: ObstacleSpec | Sequence[ObstacleSpec] | None, *, poses: bool = False
) -> Scene:
    """The scene with this traffic, if any is given.

    Parameters
    ----------
    poses : whether the robot has a heading: then it may stand where the circle around it does not fit.
    """
    if traffic is not None:
        given: Any = traffic if isinstance(traffic, tuple | list) else (traffic,)
        scene = replace(scene, traffic=tuple(given))
    free = free_space(replace(scene, robot=inscribed_disc(scene.robot)) if poses else scene)
    if scene.traffic and not (free[scene.start[1], scene.start[0]] and free[scene.goal[1], scene.goal[0]]):
        # A blocked end is the answer; whether the obstacles would have fitted is no longer the question.
        scene = replace(scene, traffic=())
    return scene


def _with_method(where: str, given: object, method: str) -> None:
    """Refuse what is no sequence of objects with a method."""
    found = given if isinstance(given, tuple | list) else (None,)
    for one in found:
        if isinstance(one, type) or not callable(getattr(one, method, None)):
            raise SettingError("TYPE", shown(given), where=where, allowed=f"objects with a method {method}")


def _seed(seed: int) -> int:
    if not is_whole(seed, 0, MAX_SEED):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    return int(seed)
