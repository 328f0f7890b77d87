"""Via points: that a run visits those of its scene, in an order that is allowed, and when it says that it does."""

from __future__ import annotations

from lampyris.model.drive import AT_GOAL, Drive
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.referee.verdict import Violation
from lampyris.typing import Cell


def trace_visits_violation(trace: Trace) -> Violation | None:
    """Each via point is reached at the first tick at which the robot is on it after the one before."""
    broken = _order(trace.scene, trace.via, len(trace.via_ticks), trace.arrived)
    if broken is not None:
        return broken
    if not trace.via and not trace.via_ticks:
        return None
    cells = [(int(x), int(y)) for x, y in trace.robot.tolist()]
    tick, found = 0, []
    for cell in trace.via:
        if cell not in cells[tick:]:
            break
        tick = cells.index(cell, tick)
        found.append(tick)
    if tuple(found) != trace.via_ticks:
        return Violation(
            "via", "trace", f"claims visits at ticks {trace.via_ticks}; they are at {tuple(found)}"
        )
    return None


def drive_visits_violation(drive: Drive) -> Violation | None:
    """At each time that is stated the robot stands on the via point; the times rise."""
    broken = _order(drive.scene, drive.via, len(drive.via_times), drive.arrived)
    if broken is not None:
        return broken
    before = 0.0
    for cell, t in zip(drive.via, drive.via_times, strict=False):
        if not before <= t <= drive.duration:
            return Violation(
                "via", f"{t:.6g} s", f"after a visit at {before:.6g} s, of {drive.duration:.6g} s"
            )
        before = t
        (at, *_), (v, *_) = drive.at([t])  # type: ignore[arg-type]
        if max(abs(float(at[0]) - cell[0]), abs(float(at[1]) - cell[1])) > AT_GOAL + 1e-9 or v > 1e-9:
            where = f"the robot is at ({at[0]:.6g}, {at[1]:.6g}) with {float(v):.6g} m/s"
            return Violation("via", f"{t:.6g} s", f"{where}; the via point is {cell}")
    return None


def _order(scene: Scene, via: tuple[Cell, ...], reached: int, arrived: bool) -> Violation | None:
    """Whether these are the scene's via points, in its order where that is given, all reached on arrival."""
    given = scene.via_order == "given"
    if (via != scene.via) if given else (sorted(via) != sorted(scene.via)):
        return Violation("via", "order of visits", f"{via}; the scene has {scene.via}")
    if reached > len(via) or (arrived and reached < len(via)):
        return Violation("via", "visits", f"{reached} of {len(via)}, and the outcome says otherwise")
    return None
