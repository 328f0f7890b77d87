"""Fail-safe: whatever is wrong with what the robot is told, it stands within v / d, or says why it stopped.

A fault begins at a random moment of a drive among moving obstacles. The robot must notice it within a period,
stand ``v / d_max`` seconds after that for as long as it lasts, touch nobody meanwhile, and end in a typed
outcome with a sentence. ``garbage`` spoils single fields of messages; there the drive must be lawful, and no
exception may come.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.drive import Drive, Moment
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.trace import Outcome
from lampyris.model.traffic import ObstacleSpec, Patrol, RandomWalk
from lampyris.referee import check_drive
from lampyris.sim.continuous.drive import drive
from lampyris.sim.sensor import FAULTS, FaultySensor, ObstacleMessage, ObstacleSensor
from lampyris.sim.traffic.adversary import Adversary
from lampyris.sim.world.cell_index import EIGHT
from lampyris_selfcheck.check import Ask, Check, Kind, Part, Tally, each
from lampyris_selfcheck.check import Outcome as Seen
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes

_WHAT = {
    "stops": "no message comes any more",
    "jumps": "an obstacle is said to be elsewhere at once",
    "duplicates": "the last message comes again and again",
    "back-in-time": "stamps run backwards",
    "nan": "a coordinate is no number",
    "in-robot": "an obstacle is said to be where the robot is",
    "goal-gone": "an update of the map takes the goal away",
    "late": "messages come seconds late",
    "missing": "obstacles are left out",
}

KINDS = {
    **{kind: Kind(_WHAT[kind], 4, 1_250, 10_000, 10, least={"noticed": 0.8}) for kind in FAULTS},
    "garbage": Kind("fields of messages spoilt: a lawful drive and no exception", 3, 2_500, 20_000, 20),
}

_ABOUT_A_BODY = ("jumps", "nan", "missing")
"""Faults that there is no telling of while the obstacle they are about is not there."""

_DUST = 1e-9


def _run(ask: Ask, part: Part) -> Seen:
    return each(part, partial(_garbage, ask) if part.kind == "garbage" else partial(_fault, ask, part.kind))


# ---- faults that are noticed ----


def _fault(ask: Ask, kind: str, number: int, tally: Tally) -> None:
    rng = ask.rng("faults", kind, number)
    scene = _scene(rng)
    at = float(rng.uniform(0.0, 9.0))
    lasts = float(rng.uniform(0.2, 4.0)) if rng.random() < 0.3 else math.inf
    sensor = FaultySensor(kind, at, lasts, obstacle=int(rng.integers(3)), goal=scene.goal)
    made = _driven(rng, scene, number, sensor)
    if made is None:
        tally.count("refused: obstacles do not fit")
        return
    tally.count(made.outcome.value)
    tally.count("for good" if math.isinf(lasts) else "for a while")
    fault = _judged(made, sensor, tally)
    if fault:
        tally.fail(number, fault, at=at, lasts=None if math.isinf(lasts) else lasts, law=made.law)


def _scene(rng: np.random.Generator) -> Scene:
    """A room with some walls, walkers in it, and a robot with limits of its own."""
    blocked = rng.random((16, 16)) < rng.choice([0.0, 0.0, 0.1])
    blocked[:3, :3] = blocked[-3:, -3:] = False
    robot = Robot(
        radius=float(rng.choice([0.0, 0.2, 0.4])),
        v_max=float(rng.uniform(0.5, 2)),
        a_max=float(rng.uniform(0.3, 2)),
        d_max=float(rng.uniform(0.5, 2)),
    )
    spec: list[ObstacleSpec] = [RandomWalk(3, radius=float(rng.choice([0.0, 0.3])))]
    if rng.random() < 0.5 and not blocked[3, 8:13].any():
        spec.append(Patrol(((8, 3), (12, 3))))
    return Scene(Grid(blocked), (0, 0), (15, 15), robot=robot, traffic=tuple(spec))


def _driven(rng: np.random.Generator, scene: Scene, seed: int, sensor: ObstacleSensor) -> Drive | None:
    law = scenes.PROMISE[int(rng.integers(len(scenes.PROMISE)))] if rng.random() < 0.5 else "physical"
    cutters = [Adversary(0.5, count=2, wait=4.0)] if rng.random() < 0.3 else []
    settings: dict[str, Any] = {
        "obstacle_speed": float(rng.uniform(0.2, 0.8)),
        "obstacle_info": str(rng.choice(["positions", "velocities"])),
        "period": float(rng.choice([0.05, 0.1, 0.2])),
        "give_up": 8.0,
        "time_limit": 40.0,
    }
    who = scenes.planner(("astar", "ad-gso")[int(rng.integers(2))])
    try:
        return drive(scene, who, law=law, seed=seed, sources=cutters, sensor=sensor, **settings)
    except SceneError as refused:
        if refused.code not in scenes.REFUSED:
            raise
        return None


def _judged(made: Drive, sensor: FaultySensor, tally: Tally) -> str:
    """What is wrong with a drive in which the sensor failed; empty: nothing."""
    broken = check_drive(made)
    if broken is not None:
        return str(broken)
    if made.outcome is Outcome.COLLISION and made.law != "blind":
        return f"it drove into somebody: {made.detail}"
    if not made.arrived and ((made.v[-1] != 0.0 and made.outcome is Outcome.STOPPED) or not made.sentence):
        return f"{made.outcome.value} without standing, or without a word"
    noticed = next((m for m in made.moments if m.word == "fault" and m.t >= sensor.at - _DUST), None)
    if noticed is None:
        return _unnoticed(made, sensor, tally)
    # One who is told anew of an obstacle in its own disc had not moved before: there was nothing to notice.
    since = _since(made, sensor)
    until = min(noticed.t, sensor.at + sensor.lasts)
    late = since is not None and noticed.t > since + _late(made, sensor.kind) + _DUST
    if since is not None and late and _moves(made, since, until, sensor.kind):
        return f"noticed at {noticed.t!r} s what began at {since!r} s"
    tally.count("noticed")
    return _stands(made, sensor, noticed, tally)


def _late(made: Drive, kind: str) -> float:
    """Seconds within which a fault must be noticed: a period; stamps that turn back need one more."""
    return (2 if kind == "back-in-time" else 1) * made.period


def _since(made: Drive, sensor: FaultySensor) -> float | None:
    """When what it is told begins to be wrong so that it can be told; None: nobody can tell.

    An obstacle that was never reported jumps nowhere and is not missing; its first place is no number, or in
    the robot, from when it comes.
    """
    if sensor.kind not in (*_ABOUT_A_BODY, "in-robot"):
        return sensor.at
    began = [track.t[0] for track in made.tracks]
    if sensor.obstacle >= len(began):
        return None
    if sensor.kind in ("jumps", "missing"):
        return sensor.at if began[sensor.obstacle] < sensor.at - made.period else None
    return max(sensor.at, float(began[sensor.obstacle]))


def _moves(made: Drive, since: float, until: float, kind: str) -> bool:
    """Whether the robot moved meanwhile: for one in its own disc, all through a period."""
    until = min(until, made.duration)
    times = np.linspace(since, max(until, since), 400)
    moving = made.at(times)[1] > 0.0
    if kind != "in-robot":
        return bool(moving.any())
    # Stretches between two looks at which it stands; a look more on either side may have been at rest.
    stands = np.flatnonzero(~np.concatenate(([False], moving, [False])))
    step = float(times[1] - times[0])
    return bool((int(np.diff(stands).max()) - 2) * step > _late(made, kind) + 2.0 * step)


def _unnoticed(made: Drive, sensor: FaultySensor, tally: Tally) -> str:
    """Nothing was noticed: the drive was over, or there was nothing to notice."""
    ended = made.duration < min(sensor.at + _late(made, sensor.kind), sensor.at + sensor.lasts) + _DUST
    if ended or sensor.lasts < 2.0 * made.period:
        tally.count("over before")
        return ""
    if sensor.kind in (*_ABOUT_A_BODY, "in-robot") and not _could_be_seen(made, sensor):
        tally.count("nothing to notice")
        return ""
    return f"a fault from {sensor.at!r} s on is never noticed; the drive lasts {made.duration!r} s"


def _could_be_seen(made: Drive, sensor: FaultySensor) -> bool:
    """Whether the obstacle of the fault was there when it began, or the robot moved while it was in it."""
    began = [track.t[0] for track in made.tracks]
    if sensor.kind == "in-robot":
        until = min(sensor.at + sensor.lasts, made.duration)
        times = np.linspace(min(sensor.at + made.period, until), until, 50)
        return bool((made.at(times)[1] > 0.0).any())
    return sensor.obstacle < len(began) and began[sensor.obstacle] < sensor.at - made.period


def _stands(made: Drive, sensor: FaultySensor, noticed: Moment, tally: Tally) -> str:
    """From v / d_max after it was noticed on the robot stands, until the data can be trusted again."""
    robot = made.scene.robot
    v = float(made.at(np.array([noticed.t]))[1][0])
    tally.count("while it moved" if v > 0.0 else "while it stood")
    later = [m.t for m in made.moments if m.t > noticed.t and m.word in ("fault", "replan")]
    until = min([made.duration, *later])
    since = noticed.t + v / robot.d_max + _DUST
    if since < until:
        times = np.linspace(since, until, 200)
        speed = made.at(times)[1]
        if (speed[times < until - _DUST] > 0.0).any():
            return f"still drives {float(speed.max())!r} m/s, {v!r} m/s at {noticed.t!r} s"
        tally.measure("seconds from notice to rest", v / robot.d_max)
    forever = math.isinf(sensor.lasts) and _for_good(made, sensor)
    if forever and made.outcome not in (Outcome.STOPPED, Outcome.HIT):
        return f"ends as {made.outcome.value}; the fault lasts for good"
    data_timeout = DriveSettings().data_timeout
    if forever and sensor.kind != "goal-gone":
        late = made.duration - (noticed.t + max(v / robot.d_max, data_timeout) + 2 * made.period)
        if late > _DUST:
            return f"gives up {late!r} s later than it must"
    return ""


def _for_good(made: Drive, sensor: FaultySensor) -> bool:
    """Whether a fault that does not end is one for good.

    After a jump the place is trusted once it could have been reached, and a standing robot may be run into.
    Obstacles that come later fill the place of a missing one in the list.
    """
    if sensor.kind in ("jumps", "in-robot"):
        return False
    since = _since(made, sensor)
    if sensor.kind == "missing":
        return since is not None and all(track.t[0] < since - made.period for track in made.tracks)
    return since is not None


# ---- anything at all ----

Spoil: TypeAlias = Callable[[ObstacleMessage, np.random.Generator], ObstacleMessage]


def _with(m: ObstacleMessage, name: str, value: float, rng: np.random.Generator) -> ObstacleMessage:
    table = getattr(m, name)
    if table is None or not len(table):
        return m
    table = table.copy()
    table[int(rng.integers(len(table)))] = value
    return replace(m, **{name: table})


def _odd(rng: np.random.Generator) -> float:
    return float(rng.choice([np.nan, np.inf, -np.inf, -1.0, -1e300, 1e300, 1e9, 0.0, 1e-300]))


def _shuffled(m: ObstacleMessage, rng: np.random.Generator) -> ObstacleMessage:
    order = rng.permutation(len(m.xy))
    velocity = None if m.velocity is None else m.velocity[order]
    return replace(m, xy=m.xy[order], radius=m.radius[order], top_speed=m.top_speed[order], velocity=velocity)


def _cells(m: ObstacleMessage, rng: np.random.Generator) -> ObstacleMessage:
    drawn = rng.integers(-3, 20, (int(rng.integers(1, 40)), 2)).tolist()
    return replace(m, blocked=tuple((x, y) for x, y in drawn))


def _nobody(m: ObstacleMessage, rng: np.random.Generator) -> ObstacleMessage:
    none = np.zeros(0)
    return ObstacleMessage(
        m.stamp, np.zeros((0, 2)), none, none, None if m.velocity is None else np.zeros((0, 2))
    )


def _twice(m: ObstacleMessage, rng: np.random.Generator) -> ObstacleMessage:
    velocity = None if m.velocity is None else np.concatenate((m.velocity, m.velocity))
    return replace(
        m,
        xy=np.concatenate((m.xy, m.xy)),
        radius=np.concatenate((m.radius, m.radius)),
        top_speed=np.concatenate((m.top_speed, m.top_speed)),
        velocity=velocity,
    )


SPOILS: Mapping[str, Spoil] = MappingProxyType(
    {
        "stamp": lambda m, rng: replace(m, stamp=_odd(rng)),
        "stamp off": lambda m, rng: replace(m, stamp=m.stamp + float(rng.normal(0, 1))),
        "place": lambda m, rng: _with(m, "xy", _odd(rng), rng),
        "radius": lambda m, rng: _with(m, "radius", _odd(rng), rng),
        "top speed": lambda m, rng: _with(m, "top_speed", _odd(rng), rng),
        "velocity": lambda m, rng: _with(m, "velocity", _odd(rng), rng),
        "no velocities": lambda m, rng: replace(m, velocity=None),
        "shuffled": _shuffled,
        "nobody": _nobody,
        "twice": _twice,
        "cells": _cells,
        "round the robot": lambda m, rng: replace(m, blocked=tuple((1 + x, 1 + y) for x, y in EIGHT)),
    }
)
"""Ways to spoil a message; each of the message and draws."""


@dataclass
class _Spoilt:
    """A perfect sensor, some of whose messages are spoilt from a time on."""

    how: Spoil
    at: float
    share: float
    rng: np.random.Generator
    spoilt: int = field(default=0)

    def tell(self, now: float, truth: ObstacleMessage, robot: tuple[float, float]) -> list[ObstacleMessage]:
        """The truth, or what was made of it; sometimes both, in any order."""
        if now < self.at or self.rng.random() >= self.share:
            return [truth]
        self.spoilt += 1
        wrong = self.how(truth, self.rng)
        some = [[wrong], [wrong, truth], [truth, wrong], [wrong, wrong]]
        return some[int(self.rng.integers(len(some)))]


def _garbage(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("faults", "garbage", number)
    names = tuple(SPOILS)
    name = names[number % len(names)]
    scene = _scene(rng)
    sensor = _Spoilt(SPOILS[name], float(rng.uniform(0, 6)), float(rng.choice([0.1, 0.5, 1.0])), rng)
    made = _driven(rng, scene, number, sensor)
    if made is None:
        tally.count("refused: obstacles do not fit")
        return
    tally.count(made.outcome.value)
    tally.count(name)
    tally.count("messages spoilt", sensor.spoilt)
    broken = check_drive(made)
    if broken is not None:
        tally.fail(number, f"{name}: {broken}", law=made.law)
    if not made.sentence:
        tally.fail(number, f"{name}: {made.outcome.value} without a word", law=made.law)


CHECK = Check(
    "faults",
    ("G12",),
    "whatever is wrong with what it is told, the robot stands within v / d or says why it stopped",
    KINDS,
    _run,
)
