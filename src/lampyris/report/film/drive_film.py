"""Films of a drive in continuous time: the robot between cells, obstacles where they are, a trail by
speed."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from lampyris.model.drive import Drive
from lampyris.report.data.gaps import with_footprint
from lampyris.report.film import sprites
from lampyris.report.film.sheet import BAD, FLASH, GOOD, Sheet
from lampyris.report.film.sight import SensorRange
from lampyris.report.film.simulation_film import MAX_FRAMES, Shown, check, frame_ms, write_film
from lampyris.report.film.sprites import Colour, blend
from lampyris.report.style import OutFile, Rgb
from lampyris.typing import Points

FPS = 16.0

_FLASHES = 1.0
"""Seconds of the film (not of the drive) that a ring around the robot is seen after an event."""

_FINE = 6
"""Pieces of the trail a frame: bends stay round and speeds even."""


def film_drive(
    drive: Drive,
    out: OutFile,
    *,
    fps: float = FPS,
    scale: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> None:
    """Draw a drive as a film, WebP (lossless) or GIF by the file's suffix.

    It runs in real time where that takes at most 240 frames, and quicker by a whole factor otherwise, which
    its caption tells. The path driven stays behind as a line coloured by speed; below stand the time, the
    speed and what binds it. What a robot with a sensor has not seen is shaded. The same drive gives the same bytes.

    Parameters
    ----------
    fps : frames a second, 1 to 50.
    scale : pixels a cell; None: so many that the longer side has about 560.
    progress : called with the number of frames drawn so far.

    Raises
    ------
    UsageError : another suffix, or a number out of its range.
    FileError : the system refuses to write.
    """
    check(out, fps, scale)
    shown, quick = _moments(drive.duration, fps)
    write_film(DriveRenderer(drive, scale, quick, fps), shown, out, progress)


def _moments(duration: float, fps: float) -> tuple[Shown, int]:
    """The seconds that are shown, and how many times as quick the film is."""
    quick = max(1, -(-int(np.ceil(duration * fps)) // MAX_FRAMES))
    moments = (np.arange(int(duration * fps / quick) + 1) * (quick / fps)).tolist()
    if moments[-1] < duration:
        moments.append(duration)
    return Shown(tuple(moments), frame_ms(fps), quick), quick


class DriveRenderer:
    """Draws the moments of a drive, forward in time.

    Parameters
    ----------
    drive : shown.
    scale : pixels a cell; None: chosen by the map's size.
    quick : how many times as quick as the drive the film is.
    fps : frames a second.
    """

    def __init__(self, drive: Drive, scale: int | None, quick: int, fps: float) -> None:
        self.drive = drive
        self._quick, self._step = quick, quick / fps / _FINE
        scene = drive.scene
        kinds, senses = [b.kind for b in drive.obstacle_specs], drive.seen is not None
        self._sheet = sheet = Sheet(
            scene.grid, scene.goal, kinds, scale, own_goal=senses, unseen=senses, outlined=with_footprint(drive),
            planner=drive.planner, via=drive.via,
        )  # fmt: skip
        self._range = SensorRange(drive.sensor, scene.grid.resolution, sheet)
        looks = [sheet.look(b.kind) for b in drive.obstacle_specs]
        self._looks = [look for look, _ in looks]
        self._discs = [
            sheet.disc(track.radius, colour) if track.outline is None else None
            for track, (_, colour) in zip(drive.tracks, looks, strict=True)
        ]
        self._colours = [colour for _, colour in looks]
        self._robot_disc = sheet.disc(scene.robot.radius, sprites.ROBOT)
        self._outline = np.array(scene.robot.footprint) if with_footprint(drive) else None
        self._top_speed = float(drive.v.max(initial=0.0)) or 1.0
        self.rewind()

    def rewind(self) -> None:
        """Back to the first moment."""
        self._trail = self._sheet.paper.copy()
        self._drawn = 0.0

    def frame(self, moment: float) -> Rgb:
        """The picture at a moment, in seconds; moments must not run back without :meth:`rewind`."""
        sheet, drive = self._sheet, self.drive
        self._follow(moment)
        canvas = self._trail.copy()
        places = [
            sheet.at(*track.at(np.array([moment]))[0].tolist()) if moment >= track.t[0] else None
            for track in drive.tracks
        ]
        robot = sheet.at(*drive.at(np.array([moment]))[0][0].tolist())
        self._shade(canvas, moment, robot)
        sheet.places(canvas)
        for place, disc in zip(places, self._discs, strict=True):
            if place is not None and disc is not None:
                blend(canvas, disc, *place)
        for place, track, colour in zip(places, drive.tracks, self._colours, strict=True):
            if place is not None and track.outline is not None:
                yaw = float(track.heading(np.array([moment]))[0])
                blend(canvas, self._turned(np.array(track.outline), yaw, colour), *place)
        if self._robot_disc is not None and self._outline is None:
            blend(canvas, self._robot_disc, *robot)
        words = self._flash(canvas, moment, robot)
        for place, look in zip(places, self._looks, strict=True):
            if place is not None:
                blend(canvas, look, *place)
        if self._outline is None:
            blend(canvas, sheet.robot, *robot)
        else:
            blend(canvas, self._footprint(moment), *robot)
        self._caption(canvas, moment, words)
        return canvas

    def _shade(self, canvas: Rgb, moment: float, robot: tuple[float, float]) -> None:
        """What a robot with a sensor has not seen, how far it sees, and the goal on it."""
        drive = self.drive
        if drive.seen is None:
            return
        self._sheet.shade(canvas, (drive.seen < 0) | (drive.seen > int(moment / drive.period + 1e-9)))
        self._range.draw(canvas, *robot, self._sight(moment) if self._range.turns else None)
        self._sheet.star(canvas, *drive.scene.goal)

    def _sight(self, moment: float) -> float | None:
        """Where the sensor looks, radians clockwise on the picture; None: in all directions, until the robot has moved."""
        read = math.floor(moment / self.drive.period + 1e-9) * self.drive.period
        (first, last), _ = self.drive.at(np.array([0.0, read]))
        return -self._yaw(moment) if (first != last).any() else None

    def _footprint(self, moment: float) -> sprites.Sprite:
        """The robot's outline to scale, turned."""
        assert self._outline is not None
        return self._turned(self._outline, self._yaw(moment), sprites.ROBOT)

    def _yaw(self, moment: float) -> float:
        """Where the robot is headed, radians counterclockwise on the picture."""
        return float(self.drive.poses(np.array([moment]))[0, 2]) - self.drive.scene.grid.origin[2]

    def _turned(self, outline: Points, yaw: float, colour: Colour) -> sprites.Sprite:
        """An outline to scale, with a heading in the frame of the cells."""
        cos, sin = math.cos(yaw), math.sin(yaw)
        turn = np.array([[cos, -sin], [-sin, -cos]]) * (self._sheet.scale / self.drive.scene.grid.resolution)
        front = np.array([outline[:, 0].max(), 0.0])
        return sprites.outline(outline @ turn, front @ turn, colour)

    def palette_strip(self) -> Rgb:
        """Every colour a film may need."""
        return self._sheet.palette_strip()

    def exact_colours(self) -> Rgb:
        """Colours that the palette must hold as they are."""
        return self._sheet.exact_colours()

    def _follow(self, moment: float) -> None:
        """Draw the path driven since the last frame."""
        if moment <= self._drawn:
            return
        pieces = max(1, round((moment - self._drawn) / self._step))
        at, v = self.drive.at(self._drawn + (moment - self._drawn) * np.arange(pieces + 1) / pieces)
        share = ((v[:-1] + v[1:]) / (2 * self._top_speed)).tolist()
        for (ax, ay), (bx, by), part in zip(at[:-1].tolist(), at[1:].tolist(), share, strict=True):
            if (ax, ay) != (bx, by):
                self._sheet.leg(self._trail, (ax, ay), (bx, by), part)
        self._drawn = moment

    def _flash(self, canvas: Rgb, moment: float, robot: tuple[float, float]) -> list[str]:
        """Rings around the robot after events; the words of these events."""
        own = 0.0 if self._robot_disc is None else len(self._robot_disc.alpha) / 2
        words = []
        for event in self.drive.moments:
            age = (moment - event.t) / (self._quick * _FLASHES)
            if event.word in FLASH and 0 <= age < 1:
                self._sheet.flash(canvas, event.word, 1.5 * age, robot, own)
                words.append(event.word)
        return words

    def _caption(self, canvas: Rgb, moment: float, words: list[str]) -> None:
        """Time, speed and its cause, and what is going on."""
        drive = self.drive
        k = max(0, int(np.searchsorted(drive.t, moment, side="right")) - 1)
        speed = f"{float(drive.at(np.array([moment]))[1][0]):.2f} m/s  ({drive.why(k)})"
        every = f" ({self._quick}x)" if self._quick > 1 else ""
        now, longest = (f"{t:.1f} of {drive.duration:.1f} s{every}" for t in (moment, drive.duration))
        state, colour = " + ".join(dict.fromkeys(words)) or "driving", sprites.INK
        if moment >= drive.duration:
            state, colour = drive.outcome.value, GOOD if drive.arrived else BAD
        elif words:
            colour = FLASH[words[-1]]
        self._sheet.caption(canvas, now, longest, speed, state, colour)
