"""From the words of a call to a scenario, its traffic, settings and budget."""

from __future__ import annotations

import math
import os
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from dataclasses import fields as dataclass_fields
from pathlib import Path
from typing import Any

import numpy as np

from lampyris._core.defaults import VIA_ORDERS
from lampyris._core.limits import MAX_CELLS
from lampyris._core.scalars import MAX_SEED, SEED_RANGE
from lampyris.cli.option_errors import check_choice
from lampyris.cli.option_groups import (
    EndOptions,
    LawOptions,
    MapOptions,
    PlannerOptions,
    RobotOptions,
    RuleOptions,
    TrafficOptions,
    ViaOptions,
    settings_in,
)
from lampyris.errors import FileError, SceneError, SettingError, UnknownSettingError, UsageError
from lampyris.io.maps import library
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import COLOURS, VALUES, load_map
from lampyris.io.scenario.scenario import PRESETS, Bundled, MapFile, MapSource, Scenario
from lampyris.model.edit import Edit
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Polygon, Robot, rectangle_of
from lampyris.model.scene import Scene
from lampyris.model.settings.inflation import Inflation
from lampyris.model.traffic import ObstacleSpec
from lampyris.planning import registry
from lampyris.planning.base import Budget
from lampyris.planning.field.layers import moves_for
from lampyris.typing import Cell, FloatGrid


def load_document(one: MapOptions) -> MapDocument:
    """The map that the options name."""
    check_choice("VALUES", "--values", one.values, VALUES)
    check_choice("COLOUR", "--colour", one.colour, COLOURS)
    return load_map(
        one.map_,
        resolution=one.resolution,
        max_cells=MAX_CELLS if one.max_cells is None else one.max_cells,
        allow_outside=one.allow_outside,
        values=one.values,
        colour=one.colour,
    )


@dataclass(frozen=True)
class Request:
    """What a run is of: the options that several verbs share, as they were typed."""

    map: MapOptions
    ends: EndOptions
    robot_options: RobotOptions
    rules: RuleOptions
    planning: PlannerOptions
    law_options: LawOptions

    @property
    def planner(self) -> str:
        """The planner's name."""
        return self.planning.planner

    @property
    def law(self) -> str:
        """The law's name: the one given, or the preset's."""
        return self.preset_of()[1]

    @property
    def seed(self) -> int:
        """Root of every draw."""
        return self.rules.seed

    def robot(self) -> Robot:
        """Shape, drive and limits."""
        given, path = settings_in(self.robot_options, Robot), self.robot_options.robot_file
        if path is not None:
            from lampyris.io.scenario.robot_file import read_robot

            given["footprint"] = read_robot(path).get("footprint")
            if given["footprint"] is not None and given["radius"]:
                raise UsageError(
                    "OPTIONS", "--radius together with the footprint of --robot", allowed="one of them"
                )
        return Robot(**given)

    def planner_settings(self) -> dict[str, Any]:
        """Settings of the planner, as it declares them."""
        return parse_settings(self.planner, self.planning.settings or [])

    def law_settings(self) -> dict[str, Any]:
        """Settings of the law."""
        return parse_law(self.law, self.law_options.set_law or [])

    def read_zones(self, grid: Grid) -> tuple[FloatGrid | None, tuple[str, ...]]:
        """The speed zones, and notes on them."""
        zones = self.law_options.zones
        if zones is None:
            return None, ()
        from lampyris.io.maps.zones import read_zones

        return read_zones(zones, grid, self.robot().v_max, allow_outside=self.map.allow_outside)

    def kept_out(self, grid: Grid) -> tuple[Grid, tuple[Edit, ...], tuple[str, ...]]:
        """The map with the costs of a keepout mask, the mask's cells as an edit before the first plan, and notes."""
        file = self.law_options.keepout
        if file is None:
            return grid, (), ()
        from lampyris.io.maps.keepout import read_keepout

        kept, costs, notes = read_keepout(file, grid, allow_outside=self.map.allow_outside)
        if costs.any():
            terrain = costs if grid.terrain is None else np.maximum(costs, grid.terrain)
            grid = replace(grid, terrain=terrain)
        cells = np.argwhere(kept)[:, ::-1].tolist()
        return grid, (Edit(0, blocked=cells),) if cells else (), notes

    def load(self) -> MapDocument:
        """The map."""
        return load_document(self.map)

    def preset_of(self) -> tuple[str, str]:
        """Moves and speed law: those given, or the preset's."""
        moves, law = PRESETS[check_choice("PRESET", "--preset", self.rules.preset, PRESETS)]
        moves = check_choice("MOVES", "--moves", self.rules.moves or moves, MOVES)
        return moves, self.law_options.law or law

    def scenario(self) -> Scenario:
        """Build the scenario of the options; its traffic is what is drawn in the map."""
        moves, law = self.preset_of()
        if not 0 <= self.seed <= MAX_SEED:
            raise SettingError.of("SEED", "seed", f"{self.seed}", allowed=SEED_RANGE)
        settings, law_settings = self.planner_settings(), self.law_settings()
        if self.planner == "fastest-time" and (self.law_options.law or self.law_options.set_law):
            from lampyris.travel_time.of_law import fastest_time_settings

            settings = {**fastest_time_settings(law, law_settings), **settings}
        robot, document = self.robot(), self.load()
        zones, notes = self.read_zones(document.grid)
        grid, edits, kept_notes = self.kept_out(document.grid)
        scene = Scene(
            grid,
            **self._end("start", self.ends.start, self.ends.start_m, document),
            **self._end("goal", self.ends.goal, self.ends.goal_m, document),
            moves=moves,
            robot=robot,
            traffic=document.traffic(),
            zones=zones,
        )
        name, where = self.map.map_, self.law_options.zones
        bundled = name in library.names()
        source: MapSource | None = (
            Bundled(name) if bundled else MapFile(name, self.map.values, self.map.colour)
        )
        if grid is not document.grid:  # the costs of the mask are in no file of the map
            source = None
        return Scenario(
            scene, self.planner, settings, law, law_settings, self.seed, map=source,
            notes=(*document.notes, *notes, *kept_notes), zones=None if where is None else str(where),
            inflation=Inflation(**settings_in(self.map, Inflation)), edits=edits,
        )  # fmt: skip

    def through(self, scenario: Scenario, options: ViaOptions) -> Scenario:
        """The scenario with the via points of the options."""
        order = check_choice("VIA_ORDER", "--via-order", options.via_order, VIA_ORDERS)
        if options.via and options.via_m and order == "given":
            what = "--via and --via-m both given, which have no order together"
            raise UsageError("OPTIONS", what, allowed="one of them, or --via-order best")
        if order != "given" and not (options.via or options.via_m):
            raise UsageError(
                "OPTIONS", f"--via-order {order} without via points", allowed="with --via or --via-m"
            )
        scene, grid = scenario.scene, scenario.scene.grid
        cells: list[Any] = [_pair(word, "--via", int) for word in options.via or ()]
        for cell in cells:
            if not grid.contains(cell):
                allowed = f"x 0 to {grid.width - 1}, y 0 to {grid.height - 1}"
                raise SceneError("VIA_OUTSIDE", f"{cell} is outside the map", where="--via", allowed=allowed)
        for word in options.via_m or ():
            x, y = _pair(word, "--via-m", float)
            cells.append(grid.to_cell(x, y))
            if not grid.contains(cells[-1]):
                raise _outside("via", (x, y), grid)
        return replace(scenario, scene=scene.through(cells, options.via_order)) if cells else scenario

    def _end(self, what: str, cell: str | None, metres: str | None, document: MapDocument) -> dict[str, Any]:
        """An end as the argument of a scene: a cell, or a pose."""
        if cell is not None and metres is not None:
            raise UsageError("OPTIONS", f"--{what} and --{what}-m both given", allowed="one of them")
        if cell is not None:
            x, y = _pair(cell, f"--{what}", int)
            return {what: (x, y)}
        if metres is not None:
            x, y, *yaw = _numbers(metres, f"--{what}-m")
            found = document.grid.to_cell(x, y)
            if not document.grid.contains(found):
                raise _outside(what, (x, y), document.grid)
            return {f"{what}_pose": (x, y, *yaw)} if yaw else {what: found}
        own = getattr(document, what)
        if own is None and document.queries:
            own = getattr(document.queries[0], what)
        if own is None:
            raise UsageError(
                "OPTIONS",
                f"{self.map.map_} has no {what} of its own",
                todo=f"give --{what} X,Y (a cell) or --{what}-m X,Y (metres)",
            )
        return {what: own}


def scene_notes(scene: Scene) -> tuple[str, ...]:
    """Notes on how a scene is understood where this differs from what was given."""
    driven, given = moves_for(scene), scene.moves
    if (driven.offsets, driven.corner_cutting) == (given.offsets, given.corner_cutting):
        return ()
    return (f"a robot with a radius drives {scene.moves.name} moves without cut corners or knight's steps",)


def drive_notes(scenario: Scenario) -> tuple[str, ...]:
    """Notes to print before a scenario is driven."""
    from lampyris import scenarios
    from lampyris.planning.registry import pose_names

    moved = () if scenario.planner in pose_names() else scene_notes(scenario.scene)
    return (*scenario.notes, *moved, *scenarios.without_effect(scenario))


def budget_of(option: str, seconds: float | None) -> Budget | None:
    """The budget of a call of the planner, as an option gives it.

    Raises
    ------
    SettingError : not a number of seconds.
    """
    if seconds is None:
        return None
    try:
        made = Budget(seconds=seconds)
    except SettingError as fault:
        fault.where = option
        raise
    return made


def _outside(what: str, point: tuple[float, float], grid: Grid) -> SceneError:
    """A point in metres that is off the map; the corners say where the map is, turned or not."""
    corners = grid.to_metres(
        [(0, 0), (grid.width - 1, 0), (0, grid.height - 1), (grid.width - 1, grid.height - 1)]
    )
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    turned = " (the map is turned)" if grid.origin[2] else ""
    return SceneError(
        f"{what.upper()}_OUTSIDE",
        f"({point[0]:g}, {point[1]:g}) metres is outside the map",
        where=f"--{what}-m",
        allowed=f"x {x0:g} to {x1:g}, y {y0:g} to {y1:g}{turned}",
    )


def track_speed(options: TrafficOptions) -> float:
    """The maximum speed of the tracks in metres and seconds along an axis, m/s; 0: there are none."""
    if not options.tracks:
        return 0.0
    from lampyris.io.tracks.timed_tracks import timed_track

    found = [timed_track(path) for path in options.tracks]
    return max((one.top_speed for one in found if one is not None), default=0.0)


def traffic_of(
    options: TrafficOptions, scene: Scene, seed: int, obstacle_speed: float | None = None
) -> tuple[ObstacleSpec, ...]:
    """All obstacles of a scene: those drawn in its map, recorded ones, and generated ones.

    Parameters
    ----------
    options, seed : as they were typed.
    scene : where.
    obstacle_speed : m/s of a step: a tick is the time that it takes; None: the robot's top speed.

    Raises
    ------
    SceneError : ``OBSTACLE_ROOM``: patrols that do not fit the scene.
    """
    from lampyris.io.tracks.timed_tracks import read_any_track
    from lampyris.sim.traffic.mobility import MOBILITIES, drawn_traffic

    mobility, rate, radius = options.mobility, options.rate, options.obstacle_radius
    check_choice("MOBILITY", "--mobility", mobility, MOBILITIES)
    if rate is not None and mobility not in ("random-walk", "mixed"):
        raise UsageError("OPTIONS", f"--rate with --mobility {mobility}", allowed="random walkers")
    outline = _obstacle_outline(options)
    made: list[ObstacleSpec] = [replace(one, radius=radius, footprint=outline) for one in scene.traffic]
    tick = scene.grid.resolution / (obstacle_speed or scene.robot.v_max)
    more_speed = "use lampyris drive --obstacle-speed, or a robot with a greater --v-max"
    made += [
        read_any_track(p, scene.grid, tick, radius=radius, footprint=outline, faster=more_speed)
        for p in options.tracks
    ]
    fit = replace(scene, traffic=tuple(made))
    shape: dict[str, Any] = {"radius": radius, "footprint": outline}
    more = drawn_traffic(mobility, options.obstacles, scene.grid, seed, rate=rate, fit=fit, **shape)
    return (*made, *more)


def _obstacle_outline(options: TrafficOptions) -> Polygon | None:
    """The footprint of ``--obstacle-rectangle``; None: the obstacles are discs."""
    text = options.obstacle_rectangle
    if text is None:
        return None
    if options.obstacle_radius:
        raise UsageError(
            "OPTIONS", "--obstacle-radius together with --obstacle-rectangle", allowed="one of them"
        )
    return rectangle_of(
        _pair(text, "--obstacle-rectangle", float), "--obstacle-rectangle", "TRAFFIC_FOOTPRINT"
    )


def _numbers(text: str, where: str) -> tuple[float, ...]:
    """``X,Y`` or ``X,Y,YAW``."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
        if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
            raise ValueError
    except ValueError:
        allowed = "two or three finite numbers: X,Y (metres) or X,Y,YAW (radians)"
        raise UsageError("TYPE", f"{text!r}", where=where, allowed=allowed) from None
    return numbers


def _pair(text: str, where: str, kind: type[Any]) -> tuple[Any, Any]:
    parts = text.split(",")
    try:
        if len(parts) != 2:
            raise ValueError
        x, y = kind(parts[0]), kind(parts[1])
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ValueError
        return x, y
    except (ValueError, OverflowError):
        allowed = "two whole numbers X,Y" if kind is int else "two finite numbers X,Y"
        raise UsageError("TYPE", f"{text!r}", where=where, allowed=allowed) from None


def parse_controllers(names: Sequence[str], words: Sequence[str]) -> dict[str, dict[str, Any]]:
    """``KEY=VALUE`` words as settings of controllers, by the names of these.

    A key such as ``mppi.samples`` is that controller's; another is a setting of all.

    Raises
    ------
    UsageError : a word without ``=``; a setting that a controller does not have, or a controller that is not named.
    SettingError : a value out of its range, or no such controller.
    """
    from lampyris.model.settings.steering import check_name, controller_settings

    given: dict[str, dict[str, Any]] = {}
    for name in names:
        check_name(name)
        given[name] = {}
    for word in words:
        key, equals, value = (part.strip() for part in word.partition("="))
        if not equals or not key:
            raise UsageError("SET", f"{word!r}", where="--set-controller", allowed="KEY=VALUE")
        owner, dot, own = key.partition(".")
        if dot and owner not in given:
            raise UsageError("SET", f"{word!r}", where="--set-controller", allowed=", ".join(given))
        for name in (owner,) if dot else tuple(given):
            key_of = (own if dot else key).replace("-", "_")
            given[name][key_of] = _plain_value(value, f"--set-controller {key}")
    try:
        for name, settings in given.items():
            controller_settings(name, settings)
    except UnknownSettingError as unknown:
        raise UsageError(
            unknown.code, unknown.what, where="--set-controller", allowed=unknown.allowed, todo=unknown.todo
        ) from None
    return given


def parse_law(name: str, words: Sequence[str]) -> dict[str, Any]:
    """``KEY=VALUE`` words as settings of a speed law: true, false and none, then numbers, else text.

    Raises
    ------
    UsageError : no such law; a word without ``=``; a setting the law does not have.
    SettingError : a value out of its range.
    """
    from lampyris.motion.laws import registry as laws

    given: dict[str, Any] = {}
    for word in words:
        key, equals, value = (part.strip() for part in word.partition("="))
        if not equals or not key:
            raise UsageError("SET", f"{word!r}", where="--set-law", allowed="KEY=VALUE")
        given[key.replace("-", "_")] = _plain_value(value, f"--set-law {key}")
    try:
        laws.with_settings(name, given)
    except UnknownSettingError as unknown:
        raise UsageError(
            unknown.code, unknown.what, where="--set-law", allowed=unknown.allowed, todo=unknown.todo
        ) from None
    return given


def _plain_value(text: str, where: str) -> Any:
    words = {"true": True, "false": False, "none": None, "null": None}
    if text.lower() in words:
        return words[text.lower()]
    for kind in (int, float):
        try:
            return _number(kind, text, where)
        except ValueError:
            continue
    return text


def _number(kind: type[Any], text: str, where: str) -> Any:
    """A number of 64 bits; text that is none is a ValueError.

    Raises
    ------
    UsageError : TYPE: a whole number that is too long to be any setting's.
    """
    try:
        value = kind(text)
        fits = not isinstance(value, int) or abs(value) < 2**64
    except ValueError:
        digits = text.lstrip("+-").replace("_", "")
        if not (kind is int and digits.isascii() and digits.isdigit()):  # Python reads 4,300 digits at most
            raise
        fits = False
    if not fits:
        raise UsageError("TYPE", f"a number of {len(text):,} characters", where=where, allowed="64 bits")
    return value


def parse_settings(planner: str, words: list[str], table: Any = registry) -> dict[str, Any]:
    """``KEY=VALUE`` words as the types the planner's settings declare.

    Parameters
    ----------
    planner : its name.
    words : as they were typed.
    table : the module that knows the planners of this kind by name (``planner_class``, ``make``).

    Raises
    ------
    UsageError : a word without ``=``, a setting the planner does not have, a value of the wrong type.
    """
    kind = table.planner_class(planner)
    declared = typing.get_type_hints(kind)
    hints = {f.name: declared[f.name] for f in dataclass_fields(kind)}
    given: dict[str, Any] = {}
    for word in words:
        key, equals, value = word.partition("=")
        key = key.strip().replace("-", "_")
        if not equals or not key:
            raise UsageError("SET", f"{word!r}", where="--set", allowed="KEY=VALUE")
        given[key] = _value(planner, key, value.strip(), hints, table)
    return given


def _value(planner: str, key: str, text: str, hints: Mapping[str, Any], table: Any) -> Any:
    if key not in hints:
        try:
            table.make(planner, {key: None})  # raises, naming the settings there are
        except UnknownSettingError as unknown:
            raise UsageError(
                unknown.code, unknown.what, where="--set", allowed=unknown.allowed, todo=unknown.todo
            ) from None
    options = _plain_types(hints[key])
    if type(None) in options and text.lower() in ("none", "null"):
        return None
    if bool in options and text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        if kind in options:
            try:
                return _number(kind, text, f"--set {key}")
            except ValueError:
                continue
    if str in options:
        return text
    words = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}
    allowed = " or ".join(words.get(k, k.__name__) for k in sorted(options, key=str) if k is not type(None))
    raise UsageError("TYPE", f"{text!r}", where=f"--set {key}", allowed=allowed)


def _plain_types(hint: Any) -> set[type]:
    """The plain types in an annotation: int | None -> {int, NoneType}; Literal["a"] -> {str}."""
    origin = typing.get_origin(hint)
    if origin is typing.Literal:
        return {type(v) for v in typing.get_args(hint)}
    if origin in (typing.Union, types.UnionType):
        return set().union(*(_plain_types(h) for h in typing.get_args(hint)))
    return {hint} if isinstance(hint, type) else {str}


def read_goal_track(file: Path) -> tuple[Cell, ...]:
    """The goal's cell at each tick.

    Raises
    ------
    FileError : it cannot be read, or the goal jumps.
    """
    from lampyris.io.tracks.csv_tracks import read_track
    from lampyris.model.traffic import Recorded

    with file_errors(file, ("OBSTACLE_SPEED",)):
        return Recorded(read_track(file)).track


def with_goal(ends: EndOptions, track: Sequence[Cell] | None) -> tuple[EndOptions, list[str]]:
    """The ends, the goal where the track begins if none is given; codes of the errors that are about the file then."""
    codes = ["GOAL_TRACK"]
    if track is not None and ends.goal is None and ends.goal_m is None:
        ends = replace(ends, goal=f"{track[0][0]},{track[0][1]}")
        codes.append("GOAL_OUTSIDE")
    return ends, codes


@contextmanager
def file_errors(file: Path | None, codes: Sequence[str]) -> Iterator[None]:
    """Errors of these codes are about what a file holds, and name it."""
    try:
        yield
    except (SceneError, SettingError) as problem:
        if file is None or problem.code not in codes:
            raise
        raise FileError(problem.code, problem.what, where=os.fspath(file), allowed=problem.allowed) from None
