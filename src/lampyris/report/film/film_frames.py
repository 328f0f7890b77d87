"""The stage of a film: a trail that grows and obstacles that move, tick by tick, on a :class:`Sheet`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lampyris.model.edit import applied
from lampyris.model.trace import Event, Trace
from lampyris.report.film import sprites
from lampyris.report.film.sheet import BAD, FLASH, GOOD, Sheet
from lampyris.report.film.sight import SensorRange
from lampyris.report.film.sprites import blend
from lampyris.report.style import Rgb
from lampyris.typing import FloatGrid


@dataclass(frozen=True, slots=True)
class Landscape:
    """A layer beneath a film.

    Parameters
    ----------
    name : in the legend.
    values : (height, width) at a tick, infinity where there is none. Asked for at tick 0 and whenever walls
        come or go.
    moves : whether it is another one at every tick.
    """

    name: str
    values: Callable[[int], FloatGrid]
    moves: bool = False


class TraceRenderer:
    """Draws the moments of a trace, forward in time.

    Parameters
    ----------
    trace : shown.
    scale : pixels a cell; None: chosen by the map's size.
    stride : ticks between frames, stated in the caption when more than one.
    landscape : the layer beneath; None: none.
    """

    def __init__(
        self, trace: Trace, scale: int | None, stride: int = 1, landscape: Landscape | None = None
    ) -> None:
        self._landscape = landscape
        self.trace = trace
        self.stride = stride
        scene = trace.scene
        self._sheet = sheet = Sheet(
            scene.grid,
            scene.goal,
            [b.kind for b in trace.obstacle_specs],
            scale,
            None if landscape is None else landscape.values(0),
            "" if landscape is None else landscape.name,
            own_goal=trace.seen is not None or trace.goal_track is not None,
            unseen=trace.seen is not None,
            planner=trace.planner,
            via=trace.via,
        )
        self._range = SensorRange(trace.sensor, scene.grid.resolution, sheet)
        looks = [sheet.look(b.kind) for b in trace.obstacle_specs]
        self._looks = [look for look, _ in looks]
        self._discs = [
            sheet.disc(b.radius, colour) for b, (_, colour) in zip(trace.obstacle_specs, looks, strict=True)
        ]
        self._robot_disc = sheet.disc(scene.robot.radius, sprites.ROBOT)
        self._top_speed = float(trace.speed.max(initial=0.0)) or 1.0
        self._events: dict[int, list[Event]] = {}
        for event in trace.events:
            self._events.setdefault(event.tick, []).append(event)
        self.rewind()

    def rewind(self) -> None:
        """Back to the first moment."""
        self._trail = self._sheet.paper.copy()
        self._grid, self._edits = self.trace.scene.grid, list(self.trace.edits)
        self._drawn = self._layered = 0
        self._captioned = -1

    def _turn(self, tick: int) -> None:
        """Redraw the map, and the path driven upon it, where walls or the layer have changed."""
        due = [edit for edit in self._edits if edit.tick <= tick]
        below = self._landscape
        if due:
            self._edits = self._edits[len(due) :]
            self._grid = applied(self._grid, due)
            if self.trace.scene.grid.terrain is not None:
                self._grid = replace(self._grid, terrain=self.trace.scene.grid.terrain)
        if due or (below is not None and below.moves and tick != self._layered):
            self._layered = tick
            self._trail = self._sheet.paper_of(self._grid, None if below is None else below.values(tick))
            self._drawn, self._captioned = 0, -1

    def frame(self, moment: float) -> Rgb:
        """The picture at a moment, in ticks; whole, or between two.

        Moments must not run back without :meth:`rewind`: the trail and the caption are kept from frame to
        frame.
        """
        tick, sheet = int(moment), self._sheet
        self._turn(tick)
        for t in range(self._drawn, tick):
            self._leg(self._trail, t, 1.0)
        self._drawn = max(self._drawn, tick)
        if tick != self._captioned:
            self._caption(tick)
            self._captioned = tick
        canvas = self._trail.copy()
        if moment > tick:
            self._leg(canvas, tick, moment - tick)
        places = [_place(t, moment - t0) for t, t0 in zip(self.trace.tracks, self.trace.appears, strict=True)]
        robot = sheet.at(*_between(self.trace.robot, moment))
        self._shade(canvas, moment, robot)
        sheet.places(canvas)
        for place, disc in zip(places, self._discs, strict=True):
            if place is not None and disc is not None:
                blend(canvas, disc, *sheet.at(*place))
        if self._robot_disc is not None:
            blend(canvas, self._robot_disc, *robot)
        self._flash(canvas, moment, robot)
        for place, look in zip(places, self._looks, strict=True):
            if place is not None:
                blend(canvas, look, *sheet.at(*place))
        blend(canvas, sheet.robot, *robot)
        return canvas

    def _shade(self, canvas: Rgb, moment: float, robot: tuple[float, float]) -> None:
        """What has not been seen, how far the robot sees, and a goal that lies there or moves."""
        trace = self.trace
        if trace.seen is not None:
            self._sheet.shade(canvas, (trace.seen < 0) | (trace.seen > int(moment)))
            self._range.draw(canvas, *robot, self._heading(int(moment)) if self._range.turns else None)
        if trace.goal_track is not None:
            self._sheet.star(canvas, *_between(trace.goal_track, moment))
        elif trace.seen is not None:
            self._sheet.star(canvas, *trace.scene.goal)

    def _heading(self, tick: int) -> float | None:
        """Direction of the robot's last move, as a sensor reads it; None before the first."""
        moves = np.diff(self.trace.robot[: tick + 1].astype(np.int64), axis=0)
        last = moves[moves.any(axis=1)][-1:].tolist()
        return math.atan2(last[0][1], last[0][0]) if last else None

    def palette_strip(self) -> Rgb:
        """Every colour a film may need."""
        return self._sheet.palette_strip()

    def exact_colours(self) -> Rgb:
        """Colours that the palette must hold as they are."""
        return self._sheet.exact_colours()

    def _leg(self, canvas: Rgb, tick: int, part: float) -> None:
        """The step after a tick, or a first part of it, coloured by the speed it led to."""
        a, b = self.trace.robot[tick].tolist(), self.trace.robot[tick + 1].tolist()
        if a == b:
            return
        end = (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]))
        self._sheet.leg(canvas, a, end, float(self.trace.speed[tick + 1]) / self._top_speed)

    def _flash(self, canvas: Rgb, moment: float, robot: tuple[float, float]) -> None:
        """Rings around the robot after events."""
        own = 0.0 if self._robot_disc is None else len(self._robot_disc.alpha) / 2
        for tick in range(max(0, int(moment) - 1), int(moment) + 1):
            for event in self._events.get(tick, ()):
                self._sheet.flash(canvas, event.word, moment - tick, robot, own)

    def _caption(self, tick: int) -> None:
        """Tick, speed and its cause, and what is going on; written into the ground until the next tick."""
        trace = self.trace
        every = f" (1 in {self.stride} shown)" if self.stride > 1 else ""
        words = [e.word for e in self._events.get(tick, ()) if e.word in FLASH]
        state, colour = " + ".join(dict.fromkeys(words)) or "driving", sprites.INK
        if tick == trace.ticks:
            state, colour = trace.outcome.value, GOOD if trace.arrived else BAD
        elif words:
            colour = FLASH[words[-1]]
        speed = f"{trace.speed[tick]:.3g} {trace.units}  ({trace.cause[tick]})"
        now, longest = (f"tick {k} of {trace.ticks}{every}" for k in (tick, trace.ticks))
        self._sheet.caption(self._trail, now, longest, speed, state, colour)


def _place(track: Any, since: float) -> tuple[float, float] | None:
    """Where an obstacle is so many ticks after its first; None before."""
    return _between(track, since) if since >= 0 else None


def _between(track: Any, moment: float) -> tuple[float, float]:
    """A place on a track, in a straight line between two ticks."""
    k = min(int(moment), len(track) - 1)
    x, y = track[k].tolist()
    part = moment - k
    if part > 0 and k + 1 < len(track):
        x1, y1 = track[k + 1].tolist()
        return x + part * (x1 - x), y + part * (y1 - y)
    return float(x), float(y)
