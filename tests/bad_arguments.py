"""What a caller may hand in by mistake, and arguments that are right, for every public class and function."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import math
import pkgutil
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np

import lampyris
from lampyris.errors import LampyrisError, shown
from lampyris.model.path import path_of
from lampyris.planning import registry

ROOMS = ("model", "planning", "motion", "sim")
"""Rooms whose public classes with checks of their own are found by themselves."""

HUGE = 10**400

SCALARS: tuple[Any, ...] = (
    HUGE, -HUGE, 10**5000, 2**64, -(2**64), 2**63, 10**9, -1, 0, 1, 0.5, -0.0, 1e308, 5e-324,
    math.nan, math.inf, -math.inf, True, False, None, "x", "", "1", b"x", 1j, object(), int, len,
    Ellipsis, NotImplemented, Decimal("NaN"), Decimal(1), Fraction(1, 3), Fraction(HUGE),
    np.float64(math.nan), np.float64(1), np.float32(2), np.int64(-1), np.int8(3),
    np.uint64(2**64 - 1), np.bool_(True), np.str_("x"), np.datetime64("2026-01-01"),
)  # fmt: skip
"""Numbers of every size and kind, and what is no number."""


class Odd:
    """Has a length and items, and both fail."""

    def __len__(self) -> int:
        raise RuntimeError("no length")

    def __getitem__(self, key: object) -> object:
        raise RuntimeError("no items")


def bad_values() -> list[Any]:
    """Scalars, and collections of one, two, three and four of them."""
    within = (HUGE, -(2**64), math.nan, "x", None, 1j, True, 0.5, -1, ())
    made: list[Any] = [*SCALARS, [], (), {}, set(), "abc", range(3), iter(()), {"x": 1}, Odd()]
    for value in within:
        made += [(value,), [value] * 2, (value,) * 3, [value] * 4, ((value, value),), [(0, 0), (value, 1)]]
        made += [{"a_max": value}, {value: value} if value != () else {}, frozenset({value})]
    made += [
        np.zeros(0), np.zeros((0, 2)), np.zeros((2, 2)), np.full((2, 2), math.nan), np.full((3, 2), 1e308),
        np.array("x"), np.array(["x", "y"]), np.array([None, 1]), np.zeros((2, 2), complex), np.array(7),
        np.zeros((1, 2, 3)), np.array([[0, 0], [2**62, 1]]), np.array([HUGE, 1], dtype=object),
        np.zeros((4, 5), dtype="datetime64[s]"), np.zeros(3, dtype=[("a", "i4")]),
    ]  # fmt: skip
    return made


BAD = bad_values()


def grid() -> lampyris.Grid:
    blocked = np.zeros((4, 5), dtype=bool)
    blocked[1, 1:4] = True
    return lampyris.Grid(blocked)


def scene() -> lampyris.Scene:
    return lampyris.Scene(grid(), (0, 0), (4, 3))


def fleet() -> lampyris.Fleet:
    return lampyris.Fleet(grid(), [lampyris.Agent((0, 0), (4, 3)), lampyris.Agent((4, 3), (0, 0))])


def chain() -> lampyris.Chain:
    return lampyris.Chain((1.5, 1.2), (0.5,))


def path() -> lampyris.Path:
    return path_of(np.array([(0, 0), (0, 1), (0, 2)]), scene().moves)


def motion() -> lampyris.Motion:
    return lampyris.Motion(0, 0, 0, (1, 0), [(0, 0, 0), (1, 0, 0)])


def samples() -> dict[str, dict[str, Any]]:
    """Right arguments for the parameters without a default, by class or function."""
    xy, where = np.array([[0.0, 0.0], [1.0, 0.0]]), scene()
    plan, trace, driven = (
        lampyris.plan(where, "astar"),
        lampyris.simulate(where, "astar"),
        lampyris.drive(where),
    )
    field, speeds = lampyris.solve_field(where), lampyris.speed_profile(where, plan)
    made = {kind: {f.name: getattr(one, f.name) for f in dataclasses.fields(one) if f.init} for kind, one in (
        ("Path", path()), ("Plan", plan), ("Trace", trace), ("Drive", driven), ("Field", field),
        ("Profile", speeds), ("Curve", driven.curves[0]),
        ("SampledPath", lampyris.smooth(where, plan)), ("Moves", where.moves),
        ("SwarmTrace", lampyris.swarm_robots(where.grid, robots=2, iterations=2)),
        ("FleetTrace", lampyris.simulate_fleet(fleet())), ("LifelongTrace", lampyris.lifelong_fleet(fleet(), 3)),
        ("SegmentedPhoto", lampyris.segment_photo(np.array([[9, 250]], dtype=np.uint8))),
        ("PoseCurve", lampyris.drive(where, "lattice").curves[0]),
    )}  # fmt: skip
    return {
        **made,
        "Grid": {"blocked": np.zeros((4, 5), dtype=bool)},
        "Scene": {"grid": where.grid, "start": (0, 0), "goal": (4, 3)},
        "Scenario": {"scene": where},
        "Gate": {"cell": (0, 0), "axis": "x", "width_m": 0.5, "dead_end": False},
        "Study": {"name": "x", "kind": "plan", "worlds": (), "planners": (), "laws": ()},
        "RandomWalk": {"count": 1}, "Crossing": {"count": 1},
        "Patrol": {"waypoints": ((0, 0),)}, "Recorded": {"track": ((0, 0),)},
        "Edit": {"tick": 1}, "Sensor": {"range_m": 1.0}, "ObstacleTrack": {"obstacle": 0, "track": ((0, 0),)},
        "ObstacleStates": {"xy": xy, "radius": np.ones(2), "top_speed": np.ones(2)},
        "Track": {"t": np.array([0.0, 1.0]), "xy": xy, "radius": 1.0, "top_speed": 1.0},
        "Adversary": {"top_speed": 1.0}, "FaultySensor": {"kind": "stops", "at": 1.0},
        "PosePath": {"poses": np.zeros((2, 3)), "gears": np.zeros(1, dtype=int), "cost_m": 0.0, "lower_bound_m": 0.0},
        "Agent": {"start": (0, 0), "goal": (4, 3)},
        "FleetScenario": {"fleet": lampyris.Fleet(where.grid, (lampyris.Agent((0, 0), (4, 3)),))},
        "Fleet": {"grid": where.grid, "robots": (lampyris.Agent((0, 0), (4, 3)),)},
        "FleetPlan": {"status": lampyris.Status.FOUND, "planner": "lacam", "paths": (np.array([(0, 0), (0, 1)]),)},
        "simulate_fleet": {"fleet": fleet(), "drive_settings": {"drive_limit": 5.0}},
        "lifelong_fleet": {"fleet": fleet(), "ticks": 3},
        "FleetTask": {"stops": ((0, 0),)}, "load_tasks": {"path": "tasks.csv", "grid": where.grid},
        "plan_fleet": {"fleet": fleet()}, "random_fleet": {"grid": where.grid, "robots": 2},
        "load_fleet": {"path": "agents.csv", "map_": where.grid},
        "export_fleet": {"plan": lampyris.plan_fleet(fleet()), "fleet": fleet(), "path": "fleet.scen"},
        "Box": {"low": [0.0], "high": [1.0]},
        "Cloud": {"ex": 0.5, "en": 0.1, "he": 0.01},
        "plan": {"scene": where}, "simulate": {"scene": where, "ticks": 3}, "drive": {"scene": where},
        "smooth": {"path": plan, "scene": where}, "speed_profile": {"path": plan, "scene": where},
        "propagate_uncertainty": {
            "scene": where, "vary": {"v_max": (0.8, 1.2)}, "runs": 20, "held_out": 5, "monte_carlo_runs": 20,
        },
        "fastest_time_settings": {"law": "blind"},
        "solve_field": {"scene": where}, "solve_fields": {"scene": where, "goals": [(0, 0)]},
        "load_grid": {"path_or_name": "env-1"}, "load_scenario": {"path": "right.yaml"},
        "save_scenario": {"scenario": lampyris.Scenario(where), "path": "saved.yaml"},
        "run": {"scenario": lampyris.Scenario(where)},
        "Motion": {"number": 0, "start": 0, "end": 0, "cell": (1, 0), "poses": [(0, 0, 0), (1, 0, 0)]},
        "MotionPrimitives": {"resolution": 1.0, "headings": (0.0,), "motions": (motion(),)},
        "load_primitives": {"path": "right.mprim"},
        "save_primitives": {"primitives": lampyris.MotionPrimitives(1.0, (0.0,), (motion(),)), "path": "saved.mprim"},
        "motion_primitives": {"robot": lampyris.Robot(), "resolution": 0.1},
        "ThreePeaks": {"centre": (1.0, 2.0)}, "InverseSquare": {"at": (1.0, 2.0)}, "Plume": {"at": (1.0, 2.0)},
        "segment_photo": {"photo": np.array([[9, 9, 250, 240]] * 2, dtype=np.uint8)},
        "swarm_robots": {"grid": where.grid, "robots": 2, "swarm_settings": {"iterations": 2}},
        "drawn_sources": {"grid": where.grid}, "load_sources": {"path": "sources.yaml"},
        "inflate": {"grid": where.grid, "robot": lampyris.Robot(), "inflation_radius": 1.0},
        "inflation_costs": {"grid": where.grid, "inscribed_radius": 0.0, "inflation_radius": 1.0},
        "load_study": {"path": "study.yaml"}, "run_study": {"study": "study.yaml"},
        "PlannedTimes": {"s": [0.0, 1.0], "reach": [0.0, 1.0], "leave": [0.5, 1.0]},
        "node_table": {"scene": scene(), "path": path()},
        "Chain": {"base": (2.5, 1.5), "links": (0.5,)}, "MapModel": {"kind": "quadtree"},
        "ChainPlan": {
            "status": lampyris.Status.LIMIT, "planner": "rrt", "grid": where.grid, "chain": chain(),
            "start": [0.0], "goal": [0.0],
        },
        "plan_chain": {"grid": where.grid, "chain": chain(), "start": [0.0], "goal": [0.1]},
        "draw_chain": {"plan": lampyris.plan_chain(where.grid, chain(), [0.0], [0.1]), "out": "chain.svg"},
        "dissertation_speeds": {"cells": path().cells, "ring1": [0, 0, 0], "ring2": [0, 0, 0]},
    }  # fmt: skip


NOT_FOR_CALLERS = frozenset(("SafeController", "RobotShape", "SimulatedMotions", "TaskQueue"))
"""Classes with checks of their own that a drive makes, of what was checked."""


def public_classes() -> Iterator[tuple[str, type]]:
    """Every class that a caller makes: public names, planners, laws' settings, and what checks itself."""
    seen: set[type] = set()

    def new(kind: Any) -> bool:
        fresh = inspect.isclass(kind) and dataclasses.is_dataclass(kind) and kind not in seen
        seen.add(kind) if fresh else None
        return fresh

    for name in lampyris.__all__:
        kind = getattr(lampyris, name)
        if new(kind):
            yield name, kind
    for name in registry.names():
        kind = registry.planner_class(name)
        if new(kind):
            yield kind.__name__, kind
    for room in ROOMS:
        package = importlib.import_module(f"lampyris.{room}")
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if any(part.startswith("_") for part in found.name.split(".")):
                continue
            module = importlib.import_module(found.name)
            for name, kind in sorted(vars(module).items()):
                own = inspect.isclass(kind) and kind.__module__ == found.name and not name.startswith("_")
                abstract = room == "planning" and hasattr(kind, "open") and not hasattr(kind, "name")
                wanted = own and hasattr(kind, "__post_init__") and not abstract
                if wanted and name not in NOT_FOR_CALLERS and new(kind):
                    yield name, kind


def public_functions() -> Iterator[tuple[str, Callable[..., Any]]]:
    for name in lampyris.__all__:
        call = getattr(lampyris, name)
        if inspect.isfunction(call):
            yield name, call


def required(kind: Any) -> list[str]:
    given = inspect.signature(kind).parameters.values()
    open_ended = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    return [p.name for p in given if p.default is p.empty and p.kind not in open_ended]


def names_of(call: Callable[..., Any]) -> list[str]:
    given = inspect.signature(call).parameters.values()
    open_ended = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    return [p.name for p in given if p.kind not in open_ended]


def what_comes(call: Callable[..., Any], given: dict[str, Any]) -> BaseException | None:
    """What is raised that is none of ours."""
    try:
        call(**given)
    except LampyrisError as error:
        str(error)
    except Exception as error:
        return error
    return None


__all__ = [
    "BAD",
    "names_of",
    "public_classes",
    "public_functions",
    "required",
    "samples",
    "shown",
    "what_comes",
]
