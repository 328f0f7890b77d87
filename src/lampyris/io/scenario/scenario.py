"""Scenario: everything that decides a run, and where its map comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris._core import defaults
from lampyris.errors import SettingError, shown
from lampyris.io.maps.inflation import inflated
from lampyris.model.edit import Edit, applied, check_edits
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.settings.inflation import Inflation
from lampyris.model.settings.simulation import ALL_AROUND
from lampyris.typing import Cell

PRESETS = {"robot": ("octile", "physical"), "dissertation": ("dissertation", "dissertation")}
"""Moves and speed law by the name of the preset."""


@dataclass(frozen=True, slots=True)
class Bundled:
    """A bundled map, by its name."""

    name: str


@dataclass(frozen=True, slots=True)
class MapFile:
    """A map file: its path as it can be opened from here, and how it is read."""

    path: str
    values: str = defaults.VALUES
    colour: str = defaults.COLOUR


@dataclass(frozen=True, slots=True)
class Made:
    """A map made by a recipe."""

    recipe: str
    size: tuple[int, int]
    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)


MapSource: TypeAlias = Bundled | MapFile | Made


@dataclass(frozen=True, slots=True, eq=False)
class Scenario:
    """Everything that determines a run; equal scenarios give the same bytes.

    Parameters
    ----------
    scene : map, ends, moves, robot and moving obstacles.
    planner, settings : name of the planner, and its settings.
    law, law_settings : the speed law, by name, and its settings.
    seed : seed of all random draws.
    simulated : whether to simulate; otherwise to plan.
    ticks, patience : of a simulation; None: its own defaults.
    name : what to call it.
    map : where the map comes from; None: from its cells. Left out of comparisons, like the last two.
    notes : notes for the user.
    where : the file it was read from.
    zones : the file that the scene's speed zones are from; None: there are none, or they are in no file.
    drive : settings of a drive in continuous time; None: it is none.
    edits : walls that come and go, all of them, in order of time; None: those of the scene. The scene follows
        them: what is of tick 0 is in its grid, the later ones are its edits.
    ground : the map before the edit of tick 0 and inflation; None: the scene's grid. The scene's grid is made from it.
    inflation : costs of cells near walls, in the scene's terrain; walls that come later have none.
    sensor_range, field_of_view, unseen_cost : of a simulation whose robot has a sensor in place of the map: metres,
        degrees, what unseen cells cost. None: it knows the map.
    goal_track : of a simulation: the goal's cell at each tick; None: the goal stands still.

    Raises
    ------
    SettingError, SceneError, LimitError : as :func:`lampyris.model.edit.check_edits`.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> scenario = lampyris.Scenario(scene, planner="astar", seed=3)
    >>> scenario.planner, scenario.law
    ('astar', 'physical')
    """

    scene: Scene
    planner: str = defaults.PLANNER
    settings: Mapping[str, Any] = field(default_factory=dict)
    law: str = "physical"
    law_settings: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    simulated: bool = False
    ticks: int | None = None
    patience: int | None = None
    name: str = ""
    map: MapSource | None = None
    notes: tuple[str, ...] = ()
    where: str = ""
    zones: str | None = None
    drive: Mapping[str, Any] | None = None
    edits: tuple[Edit, ...] = None  # type: ignore[assignment]
    ground: Grid | None = None
    inflation: Inflation = field(default_factory=Inflation)
    sensor_range: float | None = None
    field_of_view: float = ALL_AROUND
    unseen_cost: float = defaults.UNSEEN_COST
    goal_track: tuple[Cell, ...] | None = None

    def __post_init__(self) -> None:
        for what, value, kind in (
            ("scene", self.scene, Scene), ("ground", self.ground, Grid), ("inflation", self.inflation, Inflation)
        ):  # fmt: skip
            if not isinstance(value, kind) and not (what == "ground" and value is None):
                raise SettingError("TYPE", shown(value), where=what, allowed=f"a {kind.__name__}")
        scene, given = self.scene, self.ground
        edits = scene.edits if self.edits is None else check_edits(scene.grid, self.edits)
        object.__setattr__(self, "edits", edits)
        now = edits[:1] if edits and edits[0].tick == 0 else ()
        later = edits[len(now) :]
        changed = bool(now) or self.inflation.inflation_radius > 0
        if changed and given is None:
            object.__setattr__(self, "ground", scene.grid)
        elif given is not None and not changed:
            object.__setattr__(self, "ground", None)
        grid = scene.grid if given is None and not now else applied(given or scene.grid, now)
        grid = inflated(grid, scene.robot, self.inflation)
        if grid is not scene.grid or later != scene.edits:
            object.__setattr__(self, "scene", replace(scene, grid=grid, edits=later))

    @property
    def drawn(self) -> Grid:
        """The map before any edit: what ``map`` and its hash are of."""
        return self.scene.grid if self.ground is None else self.ground

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Scenario):
            return NotImplemented
        a, b = self.scene, other.scene
        return (
            (a.start, a.goal, a.start_pose, a.goal_pose, a.via, a.via_order, a.moves, a.robot, a.traffic)
            == (b.start, b.goal, b.start_pose, b.goal_pose, b.via, b.via_order, b.moves, b.robot, b.traffic)
            and _decided(self) == _decided(other)
            and _same_map(self.drawn, other.drawn)
            and _same(a.zones, b.zones)
        )

    __hash__ = None  # type: ignore[assignment]


def _decided(one: Scenario) -> tuple[Any, ...]:
    who = (one.planner, dict(one.settings), one.law, dict(one.law_settings), one.seed)
    drive = None if one.drive is None else dict(one.drive)
    return (*who, one.simulated, one.ticks, one.patience, one.name, drive, one.edits, one.inflation)


def _same_map(a: Grid, b: Grid) -> bool:
    return (
        (a.resolution, a.origin, a.name) == (b.resolution, b.origin, b.name)
        and np.array_equal(a.blocked, b.blocked)
        and _same(a.unknown, b.unknown)
        and _same(a.terrain, b.terrain)
    )


def _same(a: NDArray[Any] | None, b: NDArray[Any] | None) -> bool:
    return np.array_equal(a, b) if a is not None and b is not None else a is b
