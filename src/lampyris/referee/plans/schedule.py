"""Schedules: ticks that rise, and a drive that no obstacle whose track is known gets in the way of."""

from __future__ import annotations

from itertools import pairwise

from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.referee.geometry.shapes import disc_cells
from lampyris.referee.verdict import Violation
from lampyris.typing import Cell


def schedule_violation(plan: Plan, scene: Scene, *, from_the_start: bool) -> Violation | None:
    """The first rule that a plan's schedule breaks: ``schedule``, ``together``, ``swap`` or ``cross``.

    Recorded obstacles are judged if the plan was made at the scene's start and commits to the end of its
    schedule; one that asks again on the way may have guessed.

    Parameters
    ----------
    plan : with a path.
    scene : its recorded obstacles replay their tracks from tick 0 and stay where these end.
    from_the_start : whether the robot was asked where the scene begins.
    """
    if plan.schedule is None or plan.path is None:
        return None
    ticks = [int(t) for t in plan.schedule]
    cells = [(int(x), int(y)) for x, y in plan.path.cells]
    if len(ticks) != len(cells):
        return Violation("schedule", "plan", f"{len(ticks)} ticks for {len(cells)} cells")
    if ticks[0] < 0 or any(b <= a for a, b in pairwise(ticks)):
        return Violation("schedule", "plan", "the ticks do not rise")
    tracks = [one for one in scene.traffic if isinstance(one, Recorded)]
    if not from_the_start or plan.commit is not None or not tracks:
        return None
    where = dict(zip(ticks, cells, strict=True))
    own = _disc(scene.robot.radius, scene)
    before = cells[0]
    for t in range(ticks[0] + 1, ticks[-1] + 1):
        now = where.get(t, before)
        for k, one in enumerate(tracks):
            last = len(one.track) - 1
            rule = _clash(before, now, one.track[min(t - 1, last)], one.track[min(t, last)], own,
                          _disc(one.radius, scene))  # fmt: skip
            if rule:
                return Violation(rule, f"tick {t}", f"the robot, at {now}, and recorded obstacle {k}")
        before = now
    return None


def _disc(radius: float, scene: Scene) -> list[Cell]:
    return [(int(x), int(y)) for x, y in disc_cells(radius, scene.grid.resolution)]


def _clash(a0: Cell, a1: Cell, b0: Cell, b1: Cell, own: list[Cell], other: list[Cell]) -> str:
    """What two obstacles do wrong while one goes from a0 to a1 and the other from b0 to b1."""
    new = {(a1[0] + x, a1[1] + y) for x, y in own}
    now = {(b1[0] + x, b1[1] + y) for x, y in other}
    if new & now:
        return "together"
    old = {(a0[0] + x, a0[1] + y) for x, y in own}
    was = {(b0[0] + x, b0[1] + y) for x, y in other}
    if new & was and old & now:
        return "swap"
    (dx, dy), (ex, ey) = (a1[0] - a0[0], a1[1] - a0[1]), (b1[0] - b0[0], b1[1] - b0[1])
    if dx and dy and ex and ey and (dx * ex + dy * ey) == 0:
        # Twice the middle of each step, in cells: diagonals of one block meet there.
        middles = {(2 * x + dx, 2 * y + dy) for x, y in old}
        if any((2 * x + ex, 2 * y + ey) in middles for x, y in was):
            return "cross"
    return ""
