"""AD-GSO with more criteria than length: the dissertation's suggestions for future work.

The planner itself is left as it is. It is given another map: terrain to which the density of walls and the
heat of traffic are added, and walls that are a margin thicker; its path is then expressed in terms of the map as
it really is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lampyris.model.change import Change
from lampyris.model.grid import MAX_TERRAIN, TERRAIN_UNIT
from lampyris.model.path import path_of, step_costs
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import disc
from lampyris.model.scene import Scene
from lampyris.planning.adgso.session import AdGsoSession
from lampyris.planning.adgso.settings import AdGsoSettings
from lampyris.planning.base import Budget, SessionBase
from lampyris.planning.edits import edited
from lampyris.planning.field.attributes import blend, cut_off, kept_away
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.solve import solve
from lampyris.planning.graph.grid_graph import check_cells
from lampyris.planning.session_limits import limited
from lampyris.typing import ByteGrid, Cell, FloatGrid

COOLING = 0.9
"""What is left of a cell's heat from one call to the next."""
WEAKEST = 1.0 / 16.0
"""Below this share of what was asked for the attributes are left out altogether."""


class LayeredSession(SessionBase):
    """A session of AD-GSO over attributes.

    How much they count for is settled at the first plan, on the map without moving obstacles: if the path is
    longer than the bound allows, all of them are halved, and so on. The margin is taken back cell by cell
    until there is a path; both are settled again when the map changes. ``Plan.attributes`` holds what is
    in effect, ``Plan.notes`` what was weakened, and why.

    Parameters
    ----------
    settings : with attributes.
    scene, rng, record : as for :meth:`lampyris.planning.adgso.ad_gso.AdGso.open`.
    """

    def __init__(
        self, settings: AdGsoSettings, scene: Scene, rng: np.random.Generator, *, record: bool
    ) -> None:
        check_cells(scene.grid.blocked.size)
        self._settings = settings
        self._bare = replace(
            settings, obstacle_density_weight=0.0, traffic_density_weight=0.0, min_clearance=0
        )
        self._rng = rng
        self._record = record
        self._scene = scene
        self._robot = scene.start
        self._under_walls: dict[Cell, int] = {}
        self._heat: FloatGrid | None = None
        self._strength = 1.0
        self._margin = settings.min_clearance
        self._given: Scene | None = None
        self._inner: AdGsoSession | None = None
        self._settled = False
        self._closed = False

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`. The planner inside has let go by itself."""
        if anywhere or not self._settled:
            self._inner = None
        return self._bare.name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """As :meth:`AdGsoSession.plan`; the path's cost, and what it is compared with, are the real map's.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        change = change or Change()
        scene = edited(self._scene, change, self._under_walls)
        if change.robot is not None:
            self._robot = (int(change.robot[0]), int(change.robot[1]))
        altered = scene is not self._scene
        self._scene = scene
        spent = 0
        if self._inner is None or altered or self._is_shut(self._robot):
            self._settled = False
            spent = self._settle()
            self._settled = True
        if self._settings.traffic_density_weight > 0:
            self._warm(change.obstacles)
        assert self._inner is not None
        if budget is not None and budget.expansions is not None and spent:
            if spent >= budget.expansions:
                return Plan(Status.LIMIT, self._bare.name, expansions=spent)  # settled, for the next call
            budget = Budget(budget.expansions - spent)
        plan = self._inner.plan(self._for_planner(change), budget)
        if spent:
            plan = replace(plan, expansions=plan.expansions + spent)
        return self._in_real_terms(plan)

    def _is_shut(self, cell: Cell) -> bool:
        """Whether the margin has taken a cell that is free: the caller has put the robot there."""
        x, y = cell
        given = self._given
        return given is not None and bool(given.grid.blocked[y, x] and not self._scene.grid.blocked[y, x])

    # ---- how much the attributes count for --------------------

    def _settle(self) -> int:
        """Find the margin and the strength that leave a path, and one not too long; what that expanded."""
        settings = self._settings
        self._strength, self._margin = 1.0, settings.min_clearance
        self._closed = False
        free, moves, goal = free_space(self._scene), moves_for(self._scene), self._scene.goal
        field = solve(free, moves, goal, stop=self._robot, terrain=self._scene.grid.terrain)
        best = int(field.exact[self._robot[1], self._robot[0]])
        spent = int(field.expansions)
        while True:
            self._open()
            assert self._given is not None
            if best < 0:
                return spent  # no path at all, and the planner will say so
            given = self._given
            led = solve(free_space(given), moves_for(given), goal, terrain=given.grid.terrain)
            spent += int(led.expansions)
            if led.exact[self._robot[1], self._robot[0]] < 0:
                self._margin -= 1
                self._closed = True
                continue
            cells = [self._robot]
            x, y = self._robot
            while (x, y) != goal:
                dx, dy = led.moves.offsets[int(led.step[y, x])]
                x, y = x + dx, y + dy
                cells.append((x, y))
            path_costs = step_costs(np.array(cells, dtype=np.int32), moves, self._scene.grid.terrain)
            if settings.max_extra is None or int(path_costs.sum()) <= best * (1.0 + settings.max_extra):
                return spent
            if self._strength > 0:
                self._strength = self._strength / 2 if self._strength > WEAKEST else 0.0
            elif self._margin > 0:
                self._margin -= 1
            else:
                return spent

    def _open(self) -> None:
        self._given = self._derived()
        self._inner = AdGsoSession(self._bare, self._given, self._rng, record=self._record)

    def _derived(self) -> Scene:
        """The scene as the planner is given it.

        Where a margin is kept its walls are all cells that the robot's centre may not enter, so the robot is
        no larger than a cell in it.
        """
        scene = self._scene
        grid, robot = scene.grid, scene.robot
        if self._margin > 0:
            ends = (self._robot, scene.goal)
            blocked = ~kept_away(grid, robot.radius, self._margin, ends)
            grid = replace(grid, blocked=blocked)
            robot = disc(robot, min(robot.radius, 0.5 * grid.resolution))
        return replace(scene, start=self._robot, robot=robot, grid=replace(grid, terrain=self._terrain()))

    def _terrain(self) -> ByteGrid | None:
        """Terrain with the attributes in effect."""
        s = self._settings
        return blend(
            self._scene.grid,
            obstacle_density_weight=s.obstacle_density_weight * self._strength,
            window=s.window,
            heat=self._heat,
            traffic_density_weight=s.traffic_density_weight * self._strength,
        )

    def _in_effect(self) -> dict[str, float]:
        """The attributes as they are in effect."""
        s = self._settings
        found = {
            "obstacle_density_weight": s.obstacle_density_weight * self._strength,
            "traffic_density_weight": s.traffic_density_weight * self._strength,
        }
        return {"min_clearance": self._margin, **found, "window": s.window}

    def _weakened(self) -> tuple[str, ...]:
        """Sentences on what is less in effect than was asked for, and why."""
        s, now = self._settings, self._in_effect()
        longer = "the best path under it would be longer than max_extra allows"
        notes = []
        if self._margin < s.min_clearance:
            why = "no path to the goal keeps more" if self._closed else longer
            if self._closed and self._strength < 1.0:
                why = f"{why}, or {longer}"
            notes.append(f"min_clearance {s.min_clearance} was weakened to {self._margin} cells: {why}")
        for name, asked in (
            ("obstacle_density_weight", s.obstacle_density_weight),
            ("traffic_density_weight", s.traffic_density_weight),
        ):
            if now[name] < asked:
                notes.append(f"{name} {asked:g} was weakened to {now[name]:g}: {longer}")
        cells = cut_off(
            self._scene.grid,
            obstacle_density_weight=now["obstacle_density_weight"],
            window=s.window,
            heat=self._heat,
            traffic_density_weight=now["traffic_density_weight"],
        )
        if cells:
            most = (TERRAIN_UNIT + MAX_TERRAIN) // TERRAIN_UNIT
            notes.append(f"{cells} cells cost {most} times plain ground, the most there is, in place of more")
        return tuple(notes)

    # ---- from one map to the other --------------------

    def _warm(self, obstacles: frozenset[Cell]) -> None:
        """Let the cells cool, and warm those with an obstacle on them; heat stays within 0 to 1."""
        heat = np.zeros(self._scene.grid.blocked.shape) if self._heat is None else COOLING * self._heat
        for x, y in sorted(obstacles):
            if self._scene.grid.contains((x, y)):
                heat[y, x] += 1.0 - COOLING
        heat[heat < 1e-3] = 0.0
        self._heat = heat

    def _for_planner(self, change: Change) -> Change:
        """The change as passed to the planner: of the map it was given, only what the heat has altered."""
        given = self._given
        assert given is not None
        graded: tuple[tuple[Cell, int], ...] = ()
        if self._settings.traffic_density_weight > 0:
            now = self._terrain()
            old = given.grid.terrain
            zero = np.zeros(given.grid.blocked.shape, dtype=np.uint8)
            now, old = zero if now is None else now, zero if old is None else old
            ys, xs = np.nonzero((now != old) & ~given.grid.blocked)
            graded = tuple(((int(x), int(y)), int(now[y, x])) for y, x in zip(ys, xs, strict=True))
            self._given = edited(given, Change(terrain=graded))
        return Change(robot=self._robot, obstacles=change.obstacles, terrain=graded, tick=change.tick)

    def _in_real_terms(self, plan: Plan) -> Plan:
        plan = replace(plan, attributes=self._in_effect(), notes=self._weakened())
        if plan.path is None:
            occupied = (Status.START_OCCUPIED, Status.GOAL_OCCUPIED)
            return plan if plan.status in occupied else replace(plan, optimal_exact=None)
        moves, terrain = moves_for(self._scene), self._scene.grid.terrain
        path = path_of(plan.path.cells, moves, terrain)
        return replace(plan, path=path, optimal_exact=None, sum_cost_to_go=None)
