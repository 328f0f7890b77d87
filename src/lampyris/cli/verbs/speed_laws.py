"""Speed laws compared on one path: the request, the profiles past the referee, and the record of the result."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lampyris import api, referee
from lampyris._core import elementary
from lampyris._core.defaults import POINTS_SMOOTH, PROFILE_SMOOTH, SMOOTHING
from lampyris.cli.option_errors import check_choice
from lampyris.cli.request import Request
from lampyris.cli.text import print_notes
from lampyris.errors import SettingError, UsageError
from lampyris.io.paths import UNITS, read_path_points
from lampyris.io.tracks.obstacle_states import read_obstacle_states
from lampyris.io.tracks.timed_tracks import read_any_track
from lampyris.kernels import loading
from lampyris.model.curve import PoseCurve
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates, Track
from lampyris.model.path import PosePath
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.robot import LEAST
from lampyris.model.scene import Scene, check_obstacle
from lampyris.motion.geometry.curve import polyline_of
from lampyris.motion.geometry.deviation import deviation, length_of
from lampyris.motion.geometry.sampled_path import SampledCellPath, SampledPath, sample_with_corners
from lampyris.motion.geometry.smoothing import rounded_alone
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.compare import LawResult, Make, compare
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.laws.pose_route import pose_route
from lampyris.motion.timing.obstacle_tracks import tracks_from_recorded
from lampyris.motion.timing.path_time import through_tracks
from lampyris.motion.timing.profile_on_nodes import with_nodes
from lampyris.planning import registry
from lampyris.report.data.metrics import cause_shares
from lampyris.report.data.serialize import grid_record, profile_record, robot_record, shares_record
from lampyris.typing import Points


@dataclass(frozen=True)
class TracksRequest:
    """The options of recorded obstacles, as they were typed."""

    files: tuple[Path, ...] = ()
    tick: float | None = None
    radius: float = 0.0

    def read(self, scene: Scene) -> tuple[Track, ...]:
        """The tracks in continuous time.

        Raises
        ------
        UsageError : a tick or a radius without a track.
        SettingError : TICK: out of its range.
        SceneError, FileError : a track that cannot be read, or is not on the map.
        """
        if not self.files:
            for option, given in (("--tick", self.tick), ("--obstacle-radius", self.radius or None)):
                if given is not None:
                    raise UsageError("OPTIONS", f"{option} without --track", allowed="a track it is of")
            return ()
        tick = scene.grid.resolution / scene.robot.v_max if self.tick is None else self.tick
        if not 1e-6 <= tick <= 1e6:
            raise SettingError("TICK", f"{tick!r}", where="--tick", allowed="1e-06 to 1e6 seconds")
        obstacles = [read_any_track(file, scene.grid, tick, radius=self.radius) for file in self.files]
        for k, obstacle in enumerate(obstacles):
            check_obstacle(scene.grid, k, obstacle)
        return tuple(tracks_from_recorded(obstacles, tick, scene.grid.resolution))


@dataclass(frozen=True)
class SpeedRequest:
    """The options of ``speed``, as they were typed."""

    base: Request
    path: Path | None
    units: str | None
    laws: str
    v0: float
    smooth: str | None
    spacing: float | None
    obstacle_states: Path | None
    tracks: TracksRequest = TracksRequest()

    @property
    def drawing(self) -> str:
        """How the path is driven: as given, or the default for its source."""
        return self.smooth or (PROFILE_SMOOTH if self.path is None else POINTS_SMOOTH)

    def check(self) -> tuple[str, ...]:
        """Reject options that contradict each other; return the laws to compare, the examined one among them."""
        law = self.base.law
        if self.path is None and registry.plans_poses(self.base.planner):
            self._check_of_poses()
        if self.smooth is not None:
            check_choice("SMOOTH", "--smooth", self.smooth, tuple(SMOOTHING))
        cells = self.path is None and not registry.plans_poses(self.base.planner)
        if cells and self.drawing == "none" and self.spacing is not None:
            raise UsageError(
                "OPTIONS",
                "the nodes are the planned cells",
                where="--spacing",
                allowed="with --smooth straight or --smooth arcs",
            )
        if self.units is not None:
            check_choice("UNITS", "--units", self.units, UNITS)
            if self.path is None:
                raise UsageError("OPTIONS", "--units without --path", allowed="a file whose units they are")
        ends = {f"--{name.replace('_', '-')}": value for name, value in asdict(self.base.ends).items()}
        both = [option for option, given in ends.items() if given is not None and self.path is not None]
        if both:
            raise UsageError("OPTIONS", f"--path and {both[0]}", allowed="one of them")
        names = [word.strip() for word in self.laws.split(",") if word.strip()]
        if names == ["all"]:
            names = list(laws.LAWS)
        for name in (*names, law):
            check_choice("LAW", "--laws" if name in names else "--law", name, laws.LAWS)
        if self.tracks.files and not isinstance(laws.named(law).settings, PhysicalLaw):
            ours = ", ".join(key for key, row in laws.LAWS.items() if isinstance(row.settings, PhysicalLaw))
            raise UsageError("OPTIONS", f"--track with the law {law}", allowed=ours)
        return tuple(dict.fromkeys((*names, law)))

    def _check_of_poses(self) -> None:
        """Reject what a path of poses does not have: it is driven as it is, without waits for recorded obstacles."""
        of_cells = {"--smooth": self.smooth is not None, "--track": bool(self.tracks.files)}
        for option in (option for option, given in of_cells.items() if given):
            what = f"{option} with {self.base.planner}, which plans poses"
            raise UsageError("OPTIONS", what, allowed="a planner on cells, such as astar")


@dataclass(frozen=True, eq=False)
class SpeedComparison:
    """Laws compared on one path: everything that is printed and written.

    Parameters
    ----------
    scene : map, zones, robot and ends.
    source : where the path is from: a file's name, or who planned it.
    given : the path as it was given, cells (n, 2).
    smooth : how it is driven.
    samples : where: a curve with its nodes, or the planned cells.
    entries : a row for each law that lets the robot drive.
    refused : the others, and why.
    chosen : which of them is examined.
    obstacle_states : moving obstacles.
    timing : seconds.
    notes : of the plan that the path is from: which settings it weakened.
    poses : the path of poses; None: a path of cells or points.
    """

    scene: Scene
    source: str
    given: Points
    smooth: str
    samples: SampledPath
    entries: tuple[LawResult, ...]
    refused: dict[str, str]
    chosen: int
    obstacle_states: ObstacleStates | None
    timing: dict[str, float]
    notes: tuple[str, ...] = ()
    poses: PosePath | None = None

    @property
    def entry(self) -> LawResult:
        """The law that is examined."""
        return self.entries[self.chosen]

    @property
    def given_m(self) -> float:
        """Length of the path as it was given, metres."""
        if self.poses is not None:
            return self.poses.length_m
        return length_of(self.given) * self.scene.grid.resolution

    @property
    def arcs(self) -> int:
        """How many arcs are driven."""
        if isinstance(self.samples, SampledCellPath):
            return int(np.count_nonzero(~self.samples.corners.stop))
        curve = self.samples.curve
        return 0 if curve is None else int(np.count_nonzero(curve.curvature))

    @property
    def deviation_m(self) -> float:
        """How far the path that is driven is from the one given at most, metres."""
        if self.poses is not None:
            return 0.0
        if isinstance(self.samples, SampledCellPath):
            return self.samples.corners.deviation
        return deviation(self.given, self.samples.xy, 0.25) * self.scene.grid.resolution


@dataclass(frozen=True)
class NoPath:
    """There is no path to compare laws on; the planner's sentence says why."""

    grid: Grid
    sentence: str


def compare_laws(request: SpeedRequest, names: tuple[str, ...]) -> SpeedComparison | NoPath:
    """Find or read the path and compare the named laws on it; notes are printed as they arise."""
    began, loaded = loading.wall(), loading.seconds()
    # All files are read before anything is planned: a search may take long.
    scene, source, points, notes = _scene(request)
    obstacle_states = (
        None if request.obstacle_states is None else read_obstacle_states(request.obstacle_states, scene.grid)
    )
    tracks = request.tracks.read(scene)
    smooth: Any = request.drawing
    if points is None and smooth != "none":
        api.few_nodes(np.array([scene.start, scene.goal]), scene, request.spacing)
    path: Plan | Points | None = points
    if points is None:
        base = request.base
        planned = api.plan(scene, _planner(base), seed=base.seed, record=False)
        path, source = (None, planned.sentence) if planned.path is None else (planned, source)
        notes = (*notes, *planned.notes) if path is not None else notes
    print_notes(notes)
    if path is None:
        return NoPath(scene.grid, source)
    print_notes(_off_the_map(obstacle_states, scene.grid))
    poses = path.pose_path if isinstance(path, Plan) else None
    if poses is None:
        samples, drawn = _sampled(path, scene, smooth, request.spacing), loading.wall()
        entries, refused = _entries(names, request, path, samples, scene, obstacle_states, tracks)
    else:
        assert isinstance(path, Plan)
        step = api.node_spacing(scene, request.spacing)
        samples, seen = pose_route(poses, scene, request.base.law, step)
        drawn = loading.wall()
        make = partial(_pose_profile, path, scene, request, obstacle_states)
        entries, refused = _laws_on(names, request, samples, seen, make)
    chosen = next(k for k, e in enumerate(entries) if e.law == request.base.law)
    timing = {"path_s": drawn - began, "laws_s": loading.wall() - drawn}
    timing["loading_s"] = loading.seconds() - loaded
    unchanged = _kept_as_planned(path, smooth)
    print_notes(unchanged)
    return SpeedComparison(
        scene, source, _points(path), smooth, samples, entries, refused, chosen, obstacle_states, timing,
        (*(path.notes if isinstance(path, Plan) else ()), *unchanged), poses,
    )  # fmt: skip


def _kept_as_planned(route: Plan | Points, smooth: str) -> tuple[str, ...]:
    """A sentence where a path that was to be drawn straight is not."""
    if not isinstance(route, Plan) or smooth != "straight":
        return ()
    why = rounded_alone(route)
    return (f"--smooth straight without effect: {why}",) if why else ()


def _scene(request: SpeedRequest) -> tuple[Scene, str, Points | None, tuple[str, ...]]:
    """The scene, where the path is from, its points in cells if it is in a file, and remarks."""
    base = request.base
    if request.path is None:
        scenario = base.scenario()
        return scenario.scene, base.planner, None, scenario.notes
    document = base.load()
    grid, route = document.grid, read_path_points(request.path, request.units)
    points = route.on(grid)
    zones, notes = base.read_zones(grid)
    start, goal = (_cell_of(points[k], grid, str(request.path), k) for k in (0, len(points) - 1))
    moves: Any = base.preset_of()[0]
    scene = Scene(grid, start, goal, moves, base.robot(), zones=zones)
    return scene, str(request.path), points, (*document.notes, *notes, *route.notes)


def _sampled(route: Plan | Points, scene: Scene, smooth: Any, spacing: float | None) -> SampledPath:
    """Where it is driven: a curve with nodes, or the planned cells just as ``lampyris plan`` has them."""
    if isinstance(route, Plan) and smooth == "none":
        assert route.path is not None
        return sample_with_corners(route.path, scene.grid.resolution, scene.robot)
    return api.smooth(scene, route, method=smooth, spacing=spacing)


def _points(route: Plan | Points) -> Points:
    """The points of a path, cells (n, 2)."""
    if not isinstance(route, Plan):
        return route
    assert route.path is not None
    return polyline_of(route.path)


def _off_the_map(obstacle_states: ObstacleStates | None, grid: Grid) -> tuple[str, ...]:
    """A remark on obstacles that are off the map by more than themselves and a second's travel."""
    if obstacle_states is None:
        return ()
    reach = (obstacle_states.radius + obstacle_states.top_speed) / grid.resolution + 1.0
    far = np.array((grid.width - 0.5, grid.height - 0.5))
    off = np.maximum(np.maximum(-0.5 - obstacle_states.xy, obstacle_states.xy - far), 0.0)
    which = np.flatnonzero(np.sqrt((off * off).sum(axis=1)) > reach)
    if not len(which):
        return ()
    k = int(which[0])
    x, y = (float(v) for v in grid.to_metres(obstacle_states.xy[k : k + 1])[0])
    more = f" and {len(which) - 1} more" if len(which) > 1 else ""
    at = f"moving obstacle {k} at ({x:.6g}, {y:.6g}) m{more}"
    return (f"{at}: off the map; places are taken for metres of the map's frame",)


def _planner(request: Request) -> Any:
    return registry.make(request.planner, request.planner_settings())


def _cell_of(point: Points, grid: Grid, name: str, k: int) -> tuple[int, int]:
    """The cell that an end of a path is in."""
    x, y = (int(v) for v in np.floor(point + 0.5))
    if not grid.contains((x, y)):
        raise SettingError(
            "PATH_OUTSIDE",
            f"point {k}, ({point[0]:g}, {point[1]:g}) in cells, is outside the map",
            where=name,
            allowed=f"x -0.5 to {grid.width - 0.5:g}, y -0.5 to {grid.height - 0.5:g}",
            todo="give --units cells if these are cells, or the map's own origin and resolution",
        )
    return x, y


def _entries(
    names: tuple[str, ...],
    request: SpeedRequest,
    route: Plan | Points,
    samples: SampledPath,
    scene: Scene,
    obstacle_states: ObstacleStates | None,
    tracks: tuple[Track, ...],
) -> tuple[tuple[LawResult, ...], dict[str, str]]:
    """A row for each law, each profile past the referee; and why other laws do not let the robot drive.

    Raises
    ------
    SettingError : PROFILE_BLOCKED: the law that is looked at does not.
    """
    looked_at = request.base.law

    def make(law: laws.SpeedLaw) -> Profile:
        made = _profile(route, samples, scene, law, request.v0, obstacle_states)
        mine = tracks and laws.name_of(law) == looked_at
        return _through(made, samples, scene, law, tracks, request.v0) if mine else made

    return _laws_on(names, request, samples, scene, make)


def _pose_profile(
    plan: Plan,
    scene: Scene,
    request: SpeedRequest,
    obstacle_states: ObstacleStates | None,
    law: laws.SpeedLaw,
) -> Profile:
    """A law's profile on a path of poses, with the places of its nodes; past the referee."""
    return api.speed_profile(
        scene, plan, law, v0=request.v0, spacing=request.spacing, obstacle_states=obstacle_states
    )


def _laws_on(
    names: tuple[str, ...], request: SpeedRequest, samples: SampledPath, scene: Scene, make: Make
) -> tuple[tuple[LawResult, ...], dict[str, str]]:
    """See :func:`_entries`; ``make``: what makes the profile of a law."""
    looked_at = request.base.law
    settings = laws.with_settings(looked_at, request.base.law_settings())
    refused: dict[str, str] = {}
    chosen = [settings if name == looked_at else name for name in names]
    entries = compare(samples, scene, chosen, v0=request.v0, make=make, refused=refused)
    if looked_at in refused:
        make(settings)  # it says so itself
    return entries, refused


def _profile(
    route: Plan | Points,
    samples: SampledPath,
    scene: Scene,
    law: laws.SpeedLaw,
    v0: float,
    obstacle_states: ObstacleStates | None,
) -> Profile:
    """A law's profile in metres and seconds, with the places of its nodes; past the referee."""
    cells = isinstance(route, Plan) and isinstance(samples, SampledCellPath)
    if cells and laws.named(laws.name_of(law)).units == "m/s":
        # The very call that `lampyris plan` makes.
        made = api.speed_profile(scene, route, law, v0=v0, obstacle_states=obstacle_states)  # type: ignore[arg-type]
        return replace(made, xy=samples.xy)
    return api.speed_profile(scene, samples, law, v0=v0, obstacle_states=obstacle_states)


def _through(
    made: Profile, samples: SampledPath, scene: Scene, law: Any, tracks: tuple[Track, ...], v0: float
) -> Profile:
    """The fastest profile under the caps of another that meets no obstacle on known tracks; past the referee.

    Raises
    ------
    SettingError : PROFILE_BLOCKED: there is no path through.
    """
    cap = np.min([speeds for _, speeds in made.caps], axis=0)
    found = through_tracks(samples, cap, scene.robot, tracks, v0=v0, law=made.law)
    if np.array_equal(found.s, made.s) and np.array_equal(found.v, made.v):
        return made  # no obstacle is met, and this one knows which cap is which
    found = _caps_named(with_nodes(found, made, samples, scene.robot.a_max), made)
    creep = law.creep if law.clearance else 1.0
    # A path through tracks holds no limit on jerk; the comparison says that it breaks it.
    plain = replace(scene, robot=replace(scene.robot, jerk_max=None))
    referee.demand(referee.check_profile(found, None, plain, v0=v0, creep=creep, slowest=LEAST))
    return found


def _caps_named(found: Profile, made: Profile) -> Profile:
    """The same with the caps of another profile of the path, each under its own name, at its nodes."""
    names, speeds = [cause for cause, _ in made.caps], np.stack([v for _, v in made.caps])
    behind = np.clip(np.searchsorted(made.s, found.s), 0, len(made.s) - 1)
    before = np.maximum(behind - 1, 0)
    least = speeds.min(axis=0)
    node = np.where(least[before] < least[behind], before, behind)
    which = speeds.argmin(axis=0)[node]
    cause = (names[w] if word == "limit" else word for word, w in zip(found.cause, which, strict=True))
    return replace(found, cause=tuple(cause), caps=tuple(zip(names, speeds[:, node], strict=True)))


def samples_at(profile: Profile, samples: SampledPath) -> SampledPath:
    """The sampled path with the nodes of a profile; where it waits there are two at one place."""
    n = len(profile.s)
    if samples.curve is None:
        assert profile.xy is not None
        edge = np.clip(np.searchsorted(samples.s, profile.s, side="right") - 1, 0, len(samples) - 1)
        xy, heading = profile.xy, samples.heading[edge]
    else:
        xy, heading = samples.curve.at(profile.s)
        if isinstance(samples.curve, PoseCurve):
            yaw = samples.curve.yaw_at(profile.s)
            heading = np.column_stack((elementary.cos(yaw), -elementary.sin(yaw)))
    none = np.zeros(n, dtype=np.bool_)
    return SampledPath(profile.s, xy, heading, np.zeros(n), none, samples.resolution, samples.curve)


def runs(profile: Profile, every: bool) -> list[tuple[int, int]]:
    """(first, last) node of each stretch that one cause limits; every node alone if ``every``."""
    cause, cause_index = profile.cause, profile.cause_index.tolist()
    n = len(cause)
    cuts = [
        k for k in range(1, n) if every or (cause[k], cause_index[k]) != (cause[k - 1], cause_index[k - 1])
    ]
    return [(a, b - 1) for a, b in zip([0, *cuts], [*cuts, n], strict=True)]


def record_of(comparison: SpeedComparison, timing: bool) -> dict[str, Any]:
    """What ``--json`` prints; all of it but ``timing`` is decided by the files and the options."""
    scene, samples, profile = comparison.scene, comparison.samples, comparison.entry.profile
    assert profile.xy is not None
    metres = scene.grid.to_metres(profile.xy)
    return {
        "map": grid_record(scene.grid),
        "robot": robot_record(scene),
        "path": {
            "from": comparison.source,
            "points": len(comparison.given),
            "nodes": len(samples),
            "smooth": comparison.smooth,
            "given_m": comparison.given_m,
            "length_m": float(samples.s[-1]),
            "deviation_m": comparison.deviation_m,
            "arcs": comparison.arcs,
            "stops": int(np.count_nonzero(samples.stop)),
            "reversals": None if comparison.poses is None else comparison.poses.reversals,
            "bound": None if comparison.poses is None else comparison.poses.bound,
            "poses": None if comparison.poses is None else comparison.poses.poses.tolist(),
            "notes": list(comparison.notes),
        },
        "law": comparison.entry.law,
        "laws": [entry_record(e) for e in comparison.entries],
        "refused": [{"law": law, "sentence": why} for law, why in comparison.refused.items()],
        "limited_by": shares_record(cause_shares(profile)),
        "speed": {
            **profile_record(profile, caps=True),
            "x_m": metres[:, 0].tolist(),
            "y_m": metres[:, 1].tolist(),
        },
        "timing": comparison.timing if timing else {},
    }


def entry_record(e: LawResult) -> dict[str, Any]:
    """One law of a comparison."""
    return {
        "law": e.law,
        "duration_s": e.duration_s,
        "mean": e.mean,
        "ratio_to_optimum": e.ratio,
        "peak_acceleration": e.peak_accel,
        "peak_braking": e.peak_braking,
        "peak_lateral": e.peak_lateral,
        "broken": list(e.broken),
    }
