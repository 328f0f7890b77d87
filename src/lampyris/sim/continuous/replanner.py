"""The replanner of a drive: asks the planner, and turns its answers into paths to drive."""

from __future__ import annotations

from collections.abc import Sequence

from lampyris._core.defaults import DRIVE_SPACING, Smooth
from lampyris.errors import SettingError
from lampyris.kernels import loading
from lampyris.model.change import Change
from lampyris.model.curve import Curve
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.motion.geometry.smoothing import rounded_alone
from lampyris.planning.base import Budget, Planner
from lampyris.planning.field.layers import free_space
from lampyris.sim.continuous.leg import (
    Ceiling,
    Leg,
    closed_cells,
    comfort,
    curve_from,
    leg_of,
    nearest_cell,
    standing,
)
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.traffic.motion_sources import stream
from lampyris.sim.world.notes import Notes
from lampyris.sim.world.targets import aimed
from lampyris.typing import Cell, Floats


def spacing_of(spacing: float | None, scene: Scene) -> float:
    """Metres between two nodes, as asked for or by default."""
    return DRIVE_SPACING * scene.grid.resolution if spacing is None else spacing


class Replanner:
    """A planner's session with what it has cost.

    Attributes
    ----------
    replans, expansions : of the planner.
    seconds : spent by it.
    blocked : cells that the map's updates have blocked, in order.
    """

    def __init__(
        self,
        scene: Scene,
        planner: Planner,
        seed: int,
        smooth: Smooth,
        spacing: float | None,
        budget: Budget | None = None,
    ) -> None:
        self.scene, self.planner, self.seed, self.smooth = scene, planner, seed, smooth
        self.spacing = spacing_of(spacing, scene)
        self.budget = budget
        self.session = planner.open(self.scene, stream(seed, 0))
        self.replans = self.expansions = 0
        self.seconds = 0.0
        self.blocked: list[Cell] = []
        self._free = free_space(scene)
        self._unreported: list[Cell] = []
        self._ground: dict[Cell, int] = {}
        self.notes = Notes()

    def first(self, message: ObstacleMessage) -> Plan:
        """The first plan, with the obstacles where they are."""
        return self._ask(self.scene.start, closed_cells(self.scene, message))

    def without_traffic(self) -> Plan:
        """What a fresh session says of the bare map: walls in the way are an ending, obstacles are not."""
        began = loading.cpu()
        session = self.planner.open(self._bare(), stream(self.seed, 0))
        plan = session.plan(self._start(), self.budget)
        self._count(plan, began)
        return plan

    def _bare(self) -> Scene:
        """The scene as a planner sees it without obstacles."""
        return self.scene

    def _start(self) -> Change:
        """Where the robot stands at first, for a new session."""
        return Change(robot=self.scene.start)

    def again(
        self, leg: Leg, s: float, message: ObstacleMessage | None, reaction: float
    ) -> tuple[Plan, Curve | None]:
        """A plan from where the robot stands, and its path; None if there is none that can be driven.

        First one that passes the obstacles around it at a distance at which it need not crawl; if there is
        none, at half of that; or else one that only misses them.

        Parameters
        ----------
        leg, s : the present path and where on it the robot is.
        message : the obstacles.
        reaction : seconds until the next decision has an effect.
        """
        self.replans += 1
        xy = leg.route.at(s)
        wide = comfort(self.scene, message, xy, reaction)
        for more in (wide, 0.5 * wide, None) if wide is not None else (None,):
            shut = closed_cells(self.scene, message, more)
            cell = nearest_cell(self.scene, self._free, xy, shut)
            plan = self._ask(cell, shut)
            curve = self.curve(plan, xy, message, more) if plan else None
            if curve is not None:
                break
        return plan, curve

    def update(self, cells: list[Cell]) -> bool:
        """Take in blocked cells of the map; whether any is new."""
        fresh = [c for c in cells if c not in self.blocked and self.scene.grid.contains(c)]
        self.blocked += fresh
        self._unreported += fresh
        if fresh:
            self._free = self._free.copy()
            for x, y in fresh:
                self._free[y, x] = False
        return bool(fresh)

    def aim(self, target: Cell) -> None:
        """Plan to another target from now on, by a new session."""
        self.scene = aimed(self.scene, target)
        self.session = self.planner.open(self.scene, stream(self.seed, 0))
        self._unreported = list(self.blocked)

    def learn(self, known: Scene, walls: list[Cell], ground: Sequence[tuple[Cell, int]]) -> None:
        """Take in what a robot without the map has seen.

        Parameters
        ----------
        known : the scene as it is known now.
        walls, ground : new walls, and free cells with their terrain value where unseen cells cost more.
        """
        self.scene = aimed(known, self.scene.goal)
        self._unreported += walls
        self._ground |= dict(ground)
        if walls:
            self._free = free_space(known)

    def curve(
        self, plan: Plan, xy: tuple[float, float], message: ObstacleMessage | None, more: Floats | None = None
    ) -> Curve | None:
        """The path of a plan from where the robot stands; None if it cannot be driven from there."""
        try:
            curve = curve_from(plan, self.scene, xy, message, self.smooth, self.blocked, more)
        except SettingError:
            return None
        if self.smooth == "straight" and (why := rounded_alone(plan)):
            self.notes.add((f"the path is not pulled straight: {why}",))
        return curve

    def leg(self, curve: Curve, ceiling: Ceiling) -> Leg:
        """The path with its ceiling of speeds."""
        return leg_of(curve, self.scene, ceiling, self.spacing)

    def nowhere(self, ceiling: Ceiling, verdict: Plan | None = None) -> Leg:
        """Standing on the start.

        Parameters
        ----------
        verdict : what the planner says of the map without obstacles, if it was asked.
        """
        x, y = self.scene.start
        return self.leg(standing(self.scene, (float(x), float(y))), ceiling)

    def _ask(self, robot: Cell, shut: frozenset[Cell]) -> Plan:
        ground = tuple(self._ground.items())
        return self._answer(
            Change(robot=robot, obstacles=shut - {robot}, blocked=self._news(), terrain=ground)
        )

    def _news(self) -> tuple[Cell, ...]:
        """Cells that the map's updates have blocked since the planner was last asked."""
        return tuple(self._unreported)

    def _answer(self, change: Change) -> Plan:
        began = loading.cpu()
        plan = self.session.plan(change, self.budget)
        self.notes.add(plan.notes)
        self._unreported.clear()
        self._ground.clear()
        self._count(plan, began)
        return plan

    def _count(self, plan: Plan, began: float) -> None:
        self.seconds += loading.cpu() - began
        self.expansions += plan.expansions
