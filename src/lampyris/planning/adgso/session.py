"""AD-GSO's memory of one scene: the field it walks on, the gates it found, the obstacles it had to wall in."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.kernels.adgso import walk as w
from lampyris.kernels.simulation.asking import ANSWERS, FROM, HEMMED_AT
from lampyris.model.change import Change
from lampyris.model.path import Path, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.adgso.next_steps import StepFinder
from lampyris.planning.adgso.settings import AdGsoSettings
from lampyris.planning.adgso.walk import NO_LIMIT, Flat, Walker, WalkState, walls
from lampyris.planning.base import AnswersInTicks, Budget, NextSteps, SensedNow, SessionBase
from lampyris.planning.field.frame import BorderedMap
from lampyris.planning.field.gates import gate_mask
from lampyris.planning.field.layers import moves_for
from lampyris.planning.field.repair import Padded
from lampyris.planning.field_cache import FieldCache
from lampyris.planning.graph.grid_graph import check_cells
from lampyris.planning.living_map import LivingMap
from lampyris.planning.session_limits import limited
from lampyris.typing import Cell

CUT_OFF = w.SPENT + 1
"""A trip's ending that no kernel tells: the field it would walk on does not reach where it stands."""

NAMED = 8
"""Gates that a sentence names; the plan has all."""
_NONE: frozenset[Cell] = frozenset()


class AdGsoSession(SessionBase):
    """A session of :class:`lampyris.planning.adgso.ad_gso.AdGso`; see :class:`lampyris.planning.base.Session`.

    Cells in ``Change.obstacles`` are cells the robot's centre may not enter; for a robot with a radius the
    caller widens them. ``Plan.expansions`` counts the cells that fields cost in this call, solved or repaired,
    plus window cells looked at; a field wanted only to report the optimum is not counted. ``Plan.commit`` is
    the length of the first sub-path: the rest is a preview, to be requested again.

    Hemmed in: where obstacles leave nothing to accept, the answer is ``hemmed-in``, and the caller lets a
    step pass. Asked again at the same cell, and still hemmed in, the session walls in every obstacle it
    sees, repairs the field and walks on that, so as not to turn back at the next jump, until those cells are
    left: each is freed exactly when no obstacle covers it any more.
    """

    def __init__(
        self, settings: AdGsoSettings, scene: Scene, rng: np.random.Generator, *, record: bool
    ) -> None:
        check_cells(scene.grid.blocked.size)
        self._settings = settings
        self._scene = scene
        self._rng = rng
        self._robot = scene.start
        self._moves = moves_for(scene)
        self._map = LivingMap(scene)
        ends = (scene.start, scene.goal)
        self._gates = (
            _NONE if settings.gates == "ignore" else _cells(gate_mask(scene.grid, scene.robot), ends)
        )
        self._closed = self._gates if settings.gates == "close" else _NONE
        self._walled: frozenset[Cell] = _NONE
        self._hemmed: Cell | None = None
        self._shares = False
        self._grounds = self._new_grounds()
        self._spent = 0
        self._finder: tuple[int, int, StepFinder] | None = None
        self._recorded = record
        self._walker = Walker(
            BorderedMap(self._map.free, self._moves, terrain=self._map.has_terrain),
            scene.goal,
            self._moves,
            choice=settings.choice,
            nt=settings.nt,
            mvr=settings.mvr,
            rng=rng,
            record=record,
        )
        self._keep()

    def share_map(self) -> None:
        """See :class:`lampyris.planning.base.SessionBase`: the field of the map."""
        self._shares = True
        self._grounds = self._new_grounds()

    def _keep(self) -> None:
        """Remember what a call changes as it goes along."""
        self._before = self._closed, self._walled, self._hemmed, self._walker.drawn

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`."""
        if anywhere:
            self._grounds = self._new_grounds()
        self._closed, self._walled, self._hemmed, self._walker.drawn = self._before
        return self._settings.name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """A path from where the robot is to the goal; see :meth:`lampyris.planning.base.Session.plan`.

        Raises
        ------
        SceneError : the robot, or a cell said to have turned blocked or free, is outside the map.
        """
        change = Change() if change is None else change
        self._take(change)
        self._keep()
        self._spent = 0
        here, goal = self._robot, self._scene.goal
        if not self._is_free(here):
            return self._answer(Status.START_OCCUPIED)
        if not self._is_free(goal):
            return self._answer(Status.GOAL_OCCUPIED)
        height, width = self._map.free.shape
        occupied = frozenset(
            c for c in change.obstacles if 0 <= c[0] < width and 0 <= c[1] < height and c != here
        )
        look = NO_LIMIT if budget is None or budget.expansions is None else budget.expansions
        self._walled &= occupied
        trip = self._travel(occupied, look)
        if trip.code == CUT_OFF and self._walled:
            # What still stands there closes every path: wall nothing in and look at the map alone once more.
            self._walled = _NONE
            trip = self._travel(occupied, look)
        if trip.code == w.HEMMED and self._hemmed == here:
            return self._repair(occupied, look)
        self._hemmed = here if trip.code == w.HEMMED else None
        return self._conclude(trip)

    def next_steps(self, seen: SensedNow, wanted: int) -> NextSteps | None:
        """What :meth:`plan` would answer, as far as ``wanted`` steps beyond what it commits to; None: it has to be asked.

        The map must be as it was reported last. An answer counts as a call of :meth:`plan`.
        """
        finder = self._find(wanted)
        if finder is None:
            return None
        found = finder.find(seen.robot, seen.closed, seen.count)
        if found is None or (seen.limit is not None and found.expansions > seen.limit):
            return None
        here = self._walker.cell(seen.robot)
        if found.steps < 0 and self._hemmed == here:
            return None
        self._robot = here
        self._hemmed = here if found.steps < 0 else None
        return found

    def answers(self, wanted: int, limit: int | None, obstacles: int, live: bool) -> AnswersInTicks | None:
        """For a kernel that asks as :meth:`next_steps` is asked, among so many obstacles at most; None: it cannot.

        Before any other call :meth:`answered` takes in what it has answered.
        """
        finder = self._find(wanted)
        if finder is None:
            return None
        hemmed = -1 if self._hemmed is None else self._walker.flat(self._hemmed)
        return finder.answers(hemmed, -1 if limit is None else limit, obstacles + 8)

    def first_answers(
        self, wanted: int, limit: int | None, obstacles: int, live: bool
    ) -> tuple[AnswersInTicks, int] | None:
        """The same before the first call, with the cells that the field has cost."""
        if not (self._is_free(self._robot) and self._is_free(self._scene.goal)):
            return None
        self._spent = 0
        self._ground(_NONE)
        left = None if limit is None else limit - self._spent
        found = None if left is not None and left < 0 else self.answers(wanted, left, obstacles, live)
        return None if found is None else (found, self._spent)

    def answered(self, asked: NDArray[np.int64]) -> None:
        """Take in what a kernel has answered."""
        if self._finder is not None:
            self._finder[2].answered()
        hemmed = int(asked[HEMMED_AT])
        self._hemmed = None if hemmed < 0 else self._walker.cell(hemmed)
        if asked[ANSWERS]:
            self._robot = self._walker.cell(int(asked[FROM]))

    def _find(self, wanted: int) -> StepFinder | None:
        """The finder of next steps on the map as it is; None: answers take more than that."""
        settings = self._settings
        if self._walled or self._closed or self._recorded or self._map.has_terrain:
            return None
        if self._finder is None or self._finder[:2] != (self._map.revision, wanted):
            plain = settings.gates != "replan" and settings.choice != "roulette" and settings.iter_max is None
            if not plain or self._moves.reach > 1:
                return None
            before = self._grounds.spent
            ground = self._grounds.sealed(_NONE)
            if self._grounds.spent != before:
                return None
            spare = self._grounds.spare(ground, (settings.choice, settings.nt, settings.mvr, wanted))
            here = self._walker.flat(self._robot)
            finder = StepFinder(self._walker, ground, here, self._moves, wanted, spare)
            self._finder = self._map.revision, wanted, finder
        return self._finder[2]

    def whole_plan(self, change: Change) -> Plan:
        """The plan that the last answer of :meth:`next_steps` is a part of, given what it was asked."""
        self._hemmed = None
        return self.plan(change)

    def _repair(self, occupied: frozenset[Cell], look: int) -> Plan:
        """Hemmed in for the second time: wall in what is seen, and walk on the field that results."""
        goal = self._scene.goal
        self._walled = occupied - {goal}  # one that stands on the goal has to be waited for, near the goal
        trip = self._travel(occupied, look)
        if trip.code == CUT_OFF:
            self._walled = _NONE
            detail = (
                f"Hemmed in: the {len(occupied)} cells under moving obstacles close every path to the goal."
            )
            return self._answer(Status.HEMMED_IN, trip, detail)
        if trip.code == w.HEMMED:
            covered = "Hemmed in: a moving obstacle stands on the goal." if goal in occupied else ""
            return self._answer(Status.HEMMED_IN, trip, covered)
        self._hemmed = None
        return self._conclude(trip)

    def _travel(self, occupied: frozenset[Cell], look: int) -> WalkState:
        """Walk from the robot's cell as far as it goes, finding gates on the way if the policy says so.

        A gate that the preview finds is sealed for this plan only. It stays sealed in the session once the
        robot itself stands before it.
        """
        settings = self._settings
        discover = settings.gates == "replan"
        here = self._robot
        trip = self._walker.start(self._walker.flat(here))
        sealed = self._closed | self._walled
        while True:
            ground = self._ground(sealed - {here})
            if ground.cost[trip.at(w.AT)] < 0:
                trip.code = CUT_OFF
                break
            if self._spent > look:
                trip.code = w.SPENT
                break
            shut = walls(ground)
            self._mark(shut, occupied, w.OBSTACLE)
            if discover:
                self._mark(shut, self._gates - {here}, w.GATE)
            most = settings.iter_max or NO_LIMIT
            code = self._walker.go(trip, ground, shut, jumps=most, look=look - self._spent)
            if code != w.MET_GATE:
                break
            gate = self._walker.cell(trip.at(w.GATE_AT))
            trip.gates_met.append(gate)
            sealed |= {gate}
            if trip.at(w.LENGTH) == 1:
                self._closed |= {gate}
        self._spent += trip.at(w.LOOKED)
        return trip

    def _ground(self, sealed: frozenset[Cell], *, counted: bool = True) -> Padded:
        """The field with these cells sealed."""
        before = self._grounds.spent
        ground = self._grounds.sealed(sealed)
        if counted:
            self._spent += self._grounds.spent - before
        return ground

    def _new_grounds(self) -> FieldCache:
        s = self._settings
        return FieldCache(
            self._map, self._moves, self._scene.goal, rho=s.rho, gamma=s.gamma, shared=self._shares
        )

    def _mark(self, shut: Flat, cells: frozenset[Cell], bit: int) -> None:
        flat = self._walker.flats(cells)
        for k in range(0, len(flat), 4096):
            checkpoint()
            shut[flat[k : k + 4096]] |= bit

    def _take(self, change: Change) -> None:
        """Take in where the robot is and what of the map has changed permanently."""
        altered = self._map.take(change)
        if change.robot is not None:
            self._robot = (int(change.robot[0]), int(change.robot[1]))
        self._gates -= frozenset(change.freed)  # gates are found once, on the map as given
        self._closed -= frozenset(change.freed)
        if self._map.has_terrain == (self._moves.scale == 1):
            # The first terrain on the map, or the last of it gone: costs have another unit now.
            self._moves = self._moves.weighed() if self._map.has_terrain else self._moves.plain()
            self._walker.take(self._moves)
            self._grounds = self._new_grounds()
        self._grounds.altered(altered)

    def _is_free(self, cell: Cell) -> bool:
        return bool(self._map.free[cell[1], cell[0]])

    def _conclude(self, trip: WalkState) -> Plan:
        """The plan that a trip's ending makes."""
        if trip.code == CUT_OFF:
            return self._answer(Status.NO_PATH, trip, self._why_cut_off(trip))
        if trip.code == w.HEMMED:
            return self._answer(Status.HEMMED_IN, trip)
        if trip.code == w.SPENT:
            return self._answer(Status.LIMIT, trip)
        if trip.code == w.PAUSED:
            return self._answer(Status.ITERATION_LIMIT, trip)
        return self._answer(Status.FOUND, trip)

    def _why_cut_off(self, trip: WalkState) -> str:
        """Whether it is walls or gates that leave no path."""
        gates = self._closed | frozenset(trip.gates_met)
        if not gates or self._ground(_NONE, counted=False).cost[self._walker.flat(self._robot)] < 0:
            return f"No path: walls separate {self._robot} from {self._scene.goal}."
        if self._settings.gates == "close":
            return f"No path with the {len(gates)} gates closed: every path leads through one of them."
        named = ", ".join(str(c) for c in sorted(gates)[:NAMED])
        if len(gates) > NAMED:
            named += f" and {len(gates) - NAMED:,} more"
        return f"No path: every path leads through a gate, and each one met was sealed: {named}."

    def _answer(self, status: Status, trip: WalkState | None = None, detail: str = "") -> Plan:
        """The plan of that status, with what the trip can tell."""
        name = self._settings.name
        if trip is None:
            return Plan(status, name, detail=detail)
        path, optimal, to_go = self._measured(trip) if status else (None, None, None)
        return Plan(
            status,
            name,
            path,
            iterations=trip.at(w.JUMPS),
            expansions=self._spent,
            commit=trip.at(w.FIRST) if status else None,
            jumps=tuple(trip.jumps),
            gates_met=tuple(trip.gates_met),
            optimal_exact=optimal,
            sum_cost_to_go=to_go,
            repaired=bool(status) and bool(self._walled),
            detail=detail,
        )

    def _measured(self, trip: WalkState) -> tuple[Path, int, float]:
        """The path of a trip that arrived, the best one's exact cost, the sum of cost-to-go (gates open)."""
        flat = trip.cells
        terrain = self._map.terrain if self._map.has_terrain else None
        path = path_of(self._walker.cells(flat), self._moves, terrain)
        checkpoint()
        bare = self._ground(_NONE, counted=False).cost[flat]
        values = self._moves.values(bare)
        checkpoint()
        return path, int(bare[0]), math.fsum(values.tolist())


def _cells(mask: Flat, but: tuple[Cell, ...]) -> frozenset[Cell]:
    ys, xs = np.nonzero(mask)
    return frozenset(zip(xs.tolist(), ys.tolist(), strict=True)) - frozenset(but)
