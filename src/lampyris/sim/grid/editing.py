"""Editing: walls that come and go while a simulation runs, and all that follows from the map with them.

At the beginning of tick t, before obstacles move, the cells of that tick's edit turn. A cell that an obstacle
covers, the robot or an obstacle where it stood at t - 1, stays free, and so does the goal; it is not tried again.
What is a wall already, or free already, does not turn. So the same edits give the same walls as long as the
run before them is the same, and no obstacle is ever walled in where it stands.

All obstacles step by the new map from that tick on. A patrol or a crossing obstacle takes a wall on its route
for the route's end: it turns round there, and drives on when the wall has gone. (A new path around the wall
would have to be redrawn with every edit, and would hide what was painted.) No lane of a recorded track may
be walled: a replay asks nobody.

The planner hears of what turned when it is asked next. It is asked in the same tick if a step of its path is
no longer allowed, or if anything turned free. Terrain is that of the map as given, wherever a cell is free.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lampyris.errors import SceneError, SettingError
from lampyris.model.change import Change
from lampyris.model.edit import Edit, applied
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.model.trace import Event
from lampyris.model.traffic import Recorded
from lampyris.planning.field.layers import free_cells
from lampyris.sim.traffic.traffic import Traffic
from lampyris.sim.world.cell_index import Shape
from lampyris.sim.world.seen_map import FOUND, PRICED, SeenMap
from lampyris.sim.world.world import Occupancy
from lampyris.typing import BoolGrid, Cell

_CUT = "Walls now block the path; replanned."
_OPENED = "Walls are gone; replanned."


@dataclass(frozen=True, slots=True)
class Turned:
    """What an edit did.

    Parameters
    ----------
    events : reported in the trace.
    why : why the planner has to be asked in this tick; empty: it need not be.
    """

    events: tuple[Event, ...]
    why: str


class Walls:
    """The map of a simulation as it stands, and the edits that are still to come.

    Parameters
    ----------
    scene : as given.
    world, traffic : whose shapes follow the map; the traffic is at tick 0.
    sensor : of a robot that does not know the map; None: it does.

    Attributes
    ----------
    scene : the scene as it stands, as far as walls go: without its traffic, and terrain lost under walls. With a
        sensor, as far as it has been seen.
    seen : what has been seen; None: the map is known.
    known : the scene as planners are given it: nobody can look at what is still to come.
    done : what has turned.

    Raises
    ------
    SceneError : ``EDIT_TRACK``: a wall in the lane of a recorded obstacle.
    SettingError : ``SENSOR_EDITS``: a sensor, and edits.
    """

    def __init__(
        self, scene: Scene, world: Occupancy, traffic: Traffic, sensor: Sensor | None = None
    ) -> None:
        if sensor is not None and scene.edits:
            raise SettingError.of(
                "SENSOR_EDITS", "sensor", "walls that come and go during the run", where="scene.edits",
                allowed="a sensor, or edits after tick 0; not both",
            )  # fmt: skip
        self.seen = None if sensor is None else SeenMap(scene, sensor)
        self.known = replace(scene, edits=()) if scene.edits else scene
        self.scene = replace(self.known, traffic=()) if scene.edits else scene
        if self.seen is not None:
            self.known, self.scene = self.seen.given, self.seen.scene
        self.done: list[Edit] = []
        self._given, self._world = scene, world
        self._left = deque(scene.edits)
        self._news: dict[Cell, bool] = {}
        self._ground: dict[Cell, int] = {}
        self._shapes: list[tuple[Shape, float]] = []
        if scene.edits:
            shapes = [(world.robot_shape, scene.robot.radius)]
            shapes += [(s, one.radius) for one, s in zip(traffic.obstacles, world.shapes, strict=True)]
            shapes += [(walkers.shape, walkers.spec.radius) for walkers in traffic.walkers]
            # Each shape once, in the order in which they are met.
            once = {id(shape): (shape, radius) for shape, radius in shapes}  # bits: only tells them apart
            self._shapes = list(once.values())
            self._keep_lanes(traffic)

    @property
    def may_open(self) -> bool:
        """Whether an edit that is still to come frees a cell."""
        return any(edit.freed for edit in self._left)

    @property
    def next_tick(self) -> int | None:
        """The tick of the next edit; None: there is none."""
        return self._left[0].tick if self._left else None

    @property
    def reported(self) -> bool:
        """Whether all that has turned has been reported to the planner."""
        return not self._news

    def _keep_lanes(self, traffic: Traffic) -> None:
        """Refuse walls in the lanes of recorded tracks."""
        if traffic.recording is None:
            return
        specs = [k for k, one in enumerate(self._given.traffic) if isinstance(one, Recorded)]
        lanes: dict[int, int] = {}
        number = self._world.space.number
        for (obstacle, track), k in zip(traffic.recording.tracks, specs, strict=True):
            for cell in dict.fromkeys(track.track):
                lanes |= dict.fromkeys(self._world.shapes[obstacle].cover(number(cell)), k)
        for edit in self._given.edits:
            for cell in edit.blocked:
                if (met := lanes.get(number(cell))) is not None:
                    raise SceneError(
                        "EDIT_TRACK",
                        f"a wall at {cell} from tick {edit.tick} on is in the lane of obstacle {met}",
                        allowed="walls off the cells that recorded obstacles ever cover",
                    )

    # ---- one tick --------------------

    def turn(self, tick: int, route: Sequence[Cell]) -> Turned | None:
        """Do the edit of a tick, before anything moves; None if there is none.

        Parameters
        ----------
        route : the robot's cell and those that it means to enter.
        """
        if not self._left or self._left[0].tick != tick:
            return None
        edit = self._left.popleft()
        blocked, number = self.scene.grid.blocked, self._world.space.number
        taken, own = self._world.taken, self._world.robot_cover
        walls: list[Cell] = []
        held: list[Cell] = []
        for cell in edit.blocked:
            if not blocked[cell[1], cell[0]]:
                c = number(cell)
                stays = c in taken or c in own or cell == self._given.goal
                (held if stays else walls).append(cell)
        freed = [cell for cell in edit.freed if blocked[cell[1], cell[0]]]
        if walls or freed:
            self._build(Edit(tick, tuple(walls), tuple(freed)))
        cut = bool(walls) and self._cuts(route, walls)
        return Turned(_story(tick, walls, held, freed), _CUT if cut else _OPENED if freed else "")

    def _build(self, done: Edit) -> None:
        """The map, and the shapes by which obstacles step."""
        self.done.append(done)
        grid = applied(self.scene.grid, (done,))
        if self._given.grid.terrain is not None:  # a cell that was a wall for a while has its terrain again
            grid = replace(grid, terrain=self._given.grid.terrain)
        self.scene = replace(self.scene, grid=grid)
        free: dict[float, BoolGrid] = {}
        for shape, radius in self._shapes:
            if radius not in free:
                free[radius] = free_cells(grid, radius)
            shape.renew(free[radius])
        self._news |= dict.fromkeys(done.freed, False) | dict.fromkeys(done.blocked, True)

    def _cuts(self, route: Sequence[Cell], walls: Sequence[Cell]) -> bool:
        """Whether new walls forbid a step of a path. Only steps near them are looked at."""
        if len(route) < 2:
            return False
        shape, number = self._world.robot_shape, self._world.space.number
        # A footprint, and two cells for what a knight's step passes.
        reach = 2 + max(max(abs(dx), abs(dy)) for dx, dy in shape.offsets)
        cells, new = np.array(route, dtype=np.int64), np.array(walls, dtype=np.int64)
        near = (cells >= new.min(axis=0) - reach) & (cells <= new.max(axis=0) + reach)
        for k in np.flatnonzero(near.all(axis=1)[:-1]).tolist():
            to = number(route[k + 1])
            if all(step[0] != to for step in shape.steps(number(route[k]))):
                return True
        return False

    def look(self, robot: Cell, heading: Cell, tick: int, route: Sequence[Cell]) -> str:
        """Let the robot look around at the end of a tick; why the planner has to be asked in the next, or nothing.

        Parameters
        ----------
        heading : the robot's last move.
        route : the path that it is on.
        """
        assert self.seen is not None
        walls = self.seen.look(robot, heading, tick)
        if not (walls or self.seen.ground):
            return ""
        self.known, self.scene = self.seen.given, self.seen.scene
        self._news |= dict.fromkeys(walls, True)
        self._ground |= dict(self.seen.ground)
        cut = bool(walls) and self.seen.cuts(walls, route)
        return FOUND if cut else PRICED if self.seen.prices else ""

    def as_reported(self, change: Change) -> Change:
        """The change with what has turned since the planner was last asked."""
        if not (self._news or self._ground):
            return change
        blocked = tuple(cell for cell, wall in self._news.items() if wall)
        freed = tuple(cell for cell, wall in self._news.items() if not wall)
        terrain = self._given.grid.terrain
        ground = () if terrain is None else tuple(((x, y), int(terrain[y, x])) for x, y in freed)
        ground += tuple(self._ground.items())
        self._news, self._ground = {}, {}
        return replace(change, blocked=blocked, freed=freed, terrain=ground)


def _story(
    tick: int, walls: Sequence[Cell], held: Sequence[Cell], freed: Sequence[Cell]
) -> tuple[Event, ...]:
    events = []
    if walls or held:
        sentence = f"{_cells(len(walls))} turned into {'a wall' if len(walls) == 1 else 'walls'}."
        if held:
            sentence += f" {_cells(len(held))} stayed free: occupied, or the goal."
        events.append(Event(tick, "wall", (*walls, *held)[0], sentence))
    if freed:
        events.append(Event(tick, "opened", freed[0], f"{_cells(len(freed))} turned free."))
    return tuple(events)


def _cells(count: int) -> str:
    return f"{count:,} cell" + "s" * (count != 1)
