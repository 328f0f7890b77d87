"""Speed profiles keep every limit at and between their nodes, and are as fast as the limits let them.

Judged by the referee, by exact fractions (:mod:`lampyris_selfcheck.reference.motion.profile`), by the closed form of the greatest
start speed, and by distances to every wall and body taken one by one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from lampyris.errors import SettingError
from lampyris.model.profile import Profile
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.laws import registry as laws
from lampyris.motion.profile import Feasible
from lampyris.referee import check_profile
from lampyris.typing import Floats
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally, each
from lampyris_selfcheck.checks.speed import profile_blind as blind
from lampyris_selfcheck.checks.speed import profile_cases as cases
from lampyris_selfcheck.checks.speed import profile_paths as ways
from lampyris_selfcheck.checks.speed.profile_cases import ProfileCase
from lampyris_selfcheck.checks.speed.profile_paths import ProfilePath
from lampyris_selfcheck.reference.motion import profile

KINDS = {
    "free": Kind(
        "1 to 60 nodes, edges of 1e-9 to 1e6 m, from rest, below, at and an ulp beyond the greatest start "
        "speed; farther beyond it is refused",
        600,
        920_000,
        5_000_000,
        1_000,
    ),
    "exact": Kind(
        "the greatest profile there is, by exact fractions; no single speed of it could be raised",
        200,
        20_000,
        100_000,
        100,
    ),
    "monotone": Kind(
        "raising a limit or a cap slows it nowhere; a cap more speeds it up nowhere",
        300,
        40_000,
        200_000,
        250,
    ),
    "laws": Kind(
        "every law on paths and curves among walls, zones and bodies: its promises, the bend, room to stop",
        700,
        20_000,
        100_000,
        50,
    ),
}

STOPS_IN_TIME = ("physical", "uncertainty", "blind", "three-speed", "cloud")
"""Laws that promise to be able to stop before what is near."""

MONOTONE = ("physical", "constant", "optimum")
"""Laws whose caps only rise with the robot's limits."""

_CREEP = 0.1
_ROUNDING = 1e-9

Fault: TypeAlias = str
"""What is wrong, in words; empty: nothing."""


def _run(ask: Ask, part: Part) -> Outcome:
    judge = _JUDGES[part.kind]
    return each(part, lambda number, tally: judge(ask.rng("profile", part.kind, number), tally, number))


# ---- nodes and numbers ----


def _free(rng: np.random.Generator, tally: Tally, number: int) -> None:
    case = cases.halted(rng, cases.extreme(rng))
    for name, met in (
        ("one node", len(case.s) == 1),
        ("two nodes", len(case.s) == 2),
        ("stops", case.stop.any()),
        ("stops in a row", (case.stop[1:] & case.stop[:-1]).any()),
        ("caps of zero", not case.least.all()),
    ):
        if met:
            tally.count(name)
    if cases.shut(case):
        tally.count("refused: blocked")
        if (code := _refusal(case, 0.0)) != "PROFILE_BLOCKED":
            tally.fail(number, f"no way to drive, and the answer is {code}", **case.told())
        return
    fault = _at_limit(case, tally, rng)
    if fault:
        tally.fail(number, fault, **case.told())


def _at_limit(case: ProfileCase, tally: Tally, rng: np.random.Generator) -> Fault:
    """The start speed at its limit, an ulp beside it, clearly beyond it, or anywhere below."""
    kind = ("rest", "below", "limit", "ulp below", "ulp beyond", "beyond")[int(rng.integers(6))]
    greatest = cases.greatest_start(case)
    if greatest == 0.0 or kind == "rest":
        tally.count("from rest")
        return _sound(case, case.made(), 0.0)
    tally.count(kind)
    if kind == "beyond":
        v0 = greatest * (1.0 + 10.0 ** float(rng.uniform(-11, 3)))
        tally.count("refused: too fast")
        return _beyond(case, v0, greatest)
    v0 = {
        "below": greatest * float(rng.random()),
        "limit": greatest,
        "ulp below": math.nextafter(greatest, 0.0),
        "ulp beyond": math.nextafter(greatest, math.inf),
    }[kind]
    return _sound(case, case.made(v0=v0), v0)


def _beyond(case: ProfileCase, v0: float, greatest: float) -> Fault:
    """Too fast: refused, with the greatest start speed; told to brake anyway, it brakes as hard as it may."""
    try:
        case.made(v0=v0)
        return f"starts at {v0!r} m/s; no more than {greatest!r} can be braked"
    except SettingError as refused:
        if refused.code != "PROFILE_INFEASIBLE":
            return f"{refused.code} in place of PROFILE_INFEASIBLE"
        told = float(refused.allowed.removeprefix("at most ").removesuffix(" m/s"))
    if abs(told - greatest) > 1e-12 * greatest:
        return f"says at most {told!r} m/s; it is {greatest!r}"
    hard = case.made(v0=v0, on_infeasible="brake")
    x, ds = hard.v * hard.v, np.diff(case.s)
    if hard.v[0] != v0 or not np.isfinite(x).all() or not (hard.v >= 0.0).all():
        return "braking hard: a speed that cannot be"
    fell = x[:-1] - x[1:]
    if (fell > 2.0 * case.d * ds + 4e-12 * np.maximum(x[:-1], x[1:])).any():
        return "braking hard: harder than d_max"
    if not (hard.t[1:] > hard.t[:-1]).all():
        return "braking hard: the clock stands"
    return ""


def _sound(case: ProfileCase, made: Feasible, v0: float) -> Fault:
    """The referee's word, and what it need not ask: still at the goal, moving wherever it need not stand."""
    broken = case.broken(made, v0)
    if broken is not None:
        return str(broken)
    if made.v[0] != v0 and len(case.s) > 1:
        return f"starts at {made.v[0]!r} m/s, not {v0!r}"
    if made.v[-1] != 0.0:
        return f"{made.v[-1]!r} m/s at the goal"
    if ((made.v[1:-1] > 0.0) == case.stop[1:-1]).any():
        return "stands where it need not, or drives where it must turn"
    if not np.isfinite(made.t).all() or not (made.t[1:] > made.t[:-1]).all():
        return "the clock stands, or is no number"
    return ""


def _refusal(case: ProfileCase, v0: float) -> str:
    """The code of the refusal; the empty string if there was none."""
    try:
        case.made(v0=v0)
    except SettingError as refused:
        return refused.code
    return ""


def _exact(rng: np.random.Generator, tally: Tally, number: int) -> None:
    case = cases.middling(rng)
    stops = set(np.flatnonzero(case.stop).tolist())
    v0 = float(case.least[0] * rng.uniform(0, 1.2)) if rng.random() < 0.7 else 0.0
    caps: list[float | None] = [None if math.isinf(c) else c for c in case.least.tolist()]
    want = profile.greatest(case.s.tolist(), caps, case.a, case.d, v0, stops)
    if want[0] < Fraction(v0) ** 2 * (1 - Fraction(1, 10**9)):
        tally.count("refused: too fast")
        if (code := _refusal(case, v0)) != "PROFILE_INFEASIBLE":
            tally.fail(number, f"{v0!r} m/s cannot be braked, and the answer is {code!r}", **case.told())
        return
    made = case.made(v0=v0)
    fault = _sound(case, made, v0)
    squares = np.array([math.sqrt(x) for x in want])
    if not fault and (np.abs(made.v - squares) > 1e-13 * squares).any():
        fault = f"speeds {made.v.tolist()}; the exact ones are {squares.tolist()}"
    if fault:
        tally.fail(number, fault, v0=v0, **case.told())
        return
    # Raising any one speed, by itself, breaks a limit: the referee says so.
    for k in (k for k in range(1, len(case.s) - 1) if not case.stop[k]):
        v = made.v.copy()
        v[k] *= 1 + 1e-9
        a = np.append(np.diff(v * v) / (2 * np.diff(case.s)), 0.0)
        broken = case.broken(made._replace(v=v, a=a), v0)
        tally.count("raised")
        if broken is None or broken.rule not in ("speed", "acceleration", "braking", "curvature"):
            tally.fail(number, f"node {k} could be faster: {broken}", v0=v0, **case.told())


def _monotone(rng: np.random.Generator, tally: Tally, number: int) -> None:
    case = cases.halted(rng, cases.extreme(rng))
    if cases.shut(case):
        case = cases.middling(rng)
    before = case.made()
    which = ("a_max", "d_max", "caps", "v_max")[int(rng.integers(4))]
    tally.count(which)
    factor = float(rng.uniform(1, 3))
    caps = case.caps
    if which == "caps":
        caps = [(name, v * rng.uniform(1, 2, len(v))) for name, v in caps]
    elif which == "v_max":
        caps = [(caps[0][0], caps[0][1] * factor), *caps[1:]]
    looser = case._replace(
        a=case.a * (factor if which == "a_max" else 1),
        d=case.d * (factor if which == "d_max" else 1),
        caps=caps,
    ).made()
    if (looser.v < before.v).any() or looser.t[-1] > before.t[-1] * (1 + 1e-15):
        tally.fail(number, f"slower with a greater {which}", factor=factor, **case.told())
    more = ("obstacle", case.least * 10.0 ** rng.uniform(-2, 1, len(case.s)))
    tighter = case._replace(caps=[*case.caps, more])
    slower = tighter.made()
    if (slower.v > before.v).any() or slower.t[-1] < before.t[-1] * (1 - 1e-15):
        tally.fail(number, "faster under one more cap", **tighter.told())


# ---- laws ----


def _laws(rng: np.random.Generator, tally: Tally, number: int) -> None:
    curved = rng.random() < 0.3
    ground = ways.on_curves(rng) if curved else ways.on_cells(rng)
    names = laws.names()
    law = names[int(rng.integers(len(names)))]
    fast = rng.random() < 0.3
    v0 = float(rng.uniform(0, 1.2)) * ground.scene.robot.v_max if fast else 0.0
    if law == "dissertation" and not curved:
        v0 *= 80.0 / ground.scene.robot.v_max
    tally.count(f"{law}, {'curve' if curved else 'path'}")
    data = {"law": law, "v0": v0, "curve": curved}
    hidden = blind.drawn(rng) if law == "blind" else None
    try:
        made = _profile(ground, hidden or law, v0)
    except SettingError as refused:
        tally.count("refused: too fast")
        if refused.code != "PROFILE_INFEASIBLE" or v0 == 0.0:
            tally.fail(number, f"{law}: {refused}", **data)
        return
    fault = _keeps(ground, made, law, v0)
    if not fault and hidden is not None:
        fault = blind.fault_of(ground, made, hidden, tally)
    if not fault and law in MONOTONE and v0 == 0.0 and ground.scene.robot.jerk_max is None:
        tally.count("a limit raised")
        fault = _raised(rng, ground, made, law)
    if fault:
        tally.fail(number, f"{law}: {fault}", **data)


def _raised(rng: np.random.Generator, ground: ProfilePath, made: Profile, law: str) -> Fault:
    """A robot that can do more is slower nowhere."""
    robot = ground.scene.robot
    name = ("v_max", "a_max", "d_max", "a_lat_max")[int(rng.integers(4))]
    factor = float(rng.uniform(1, 1.05) if rng.random() < 0.5 else rng.uniform(1, 4))
    more = replace(robot, **{name: getattr(robot, name) * factor})
    after = _profile(ground._replace(scene=replace(ground.scene, robot=more)), law, 0.0)
    # The optimum's nodes between those of the course are elsewhere for another robot.
    _, mine, theirs = np.intersect1d(made.s, after.s, return_indices=True)
    slower = bool((after.v[theirs] < made.v[mine] * (1 - 1e-12)).any())
    slower = slower or after.duration > made.duration * (1 + 1e-12)
    return f"slower with {factor!r} times the {name}" if slower else ""


def _profile(ground: ProfilePath, law: laws.SpeedLaw, v0: float) -> Profile:
    return laws.profile(ground.way, ground.scene, law=law, obstacles=ground.bodies, v0=v0)


def _keeps(ground: ProfilePath, made: Profile, law: str, v0: float) -> Fault:
    way = None if isinstance(ground.way, SampledPath) else ground.way
    if made.law == "dissertation" and way is None:
        return _finite(made)  # on a curve it promises no more: docs/speed/README.md
    if law == "dissertation" and ground.bodies:
        return _finite(made)  # the referee knows rings of walls alone
    zones, creep = ground.scene.zones, _CREEP * ground.scene.robot.v_max
    slowest = creep if zones is None else min(creep, float(zones.min()))
    broken = check_profile(made, way, ground.scene, v0=v0, slowest=slowest)
    if broken is not None:
        return str(broken)
    robot = ground.scene.robot
    if isinstance(ground.way, SampledPath) and law not in ("dissertation", "rpp"):
        # The optimum has nodes between those of the course, too.
        v = made.v[np.searchsorted(made.s, ground.way.s)]
        bend = v * v * ground.way.curvature
        if (bend > robot.a_lat_max * (1 + _ROUNDING)).any():
            return f"{float(bend.max())!r} m/s2 to the side; a_lat_max is {robot.a_lat_max!r}"
        if v[ground.way.stop].any():
            return "drives where it must stand and turn"
    return _finite(made) or (_room(ground, made) if law in STOPS_IN_TIME else "")


def _finite(made: Profile) -> Fault:
    if not all(np.isfinite(x).all() for x in (made.v, made.a, made.t)):
        return "a value that is no number"
    if made.v[-1] != 0.0:
        return f"{float(made.v[-1])!r} at the goal"
    return "" if (made.t[1:] > made.t[:-1]).all() else "the clock stands"


def _room(ground: ProfilePath, made: Profile) -> Fault:
    """v^2 / (2 d) <= the way to the nearest wall or body, at and between nodes, or creeping; zones."""
    scene, robot = ground.scene, ground.scene.robot
    places, share = ground.between()
    edge = np.minimum(share.astype(np.int64), max(len(made.v) - 2, 0))
    part = share - edge
    x = made.v * made.v
    after = x[np.minimum(edge + 1, len(x) - 1)]
    square = x[edge] * (1 - part) + after * part
    away = _nearest(ground, places) * scene.grid.resolution
    creep = _CREEP * robot.v_max
    allowed = np.maximum(creep * creep, 2 * robot.d_max * np.maximum(away - robot.radius, 0.0))
    if (square > allowed * (1 + 2 * _ROUNDING)).any():
        k = int((square - allowed).argmax())
        fast = math.sqrt(float(square[k]))
        return f"{fast!r} m/s at {places[k].tolist()}, {float(away[k])!r} m from a surface"
    if scene.zones is not None:
        cells = np.clip(np.rint(places).astype(np.int64), 0, (scene.grid.width - 1, scene.grid.height - 1))
        limit = scene.zones[cells[:, 1], cells[:, 0]]
        if (square > limit * limit * (1 + 2 * _ROUNDING)).any():
            return "faster than its zone"
    return ""


def _nearest(ground: ProfilePath, places: Floats) -> Floats:
    """Cells from each place to the nearest wall's or body's square, each with each."""
    ys, xs = np.nonzero(ground.scene.grid.blocked)
    squares = np.concatenate((np.stack((xs, ys), axis=1), np.array(ground.bodies).reshape(-1, 2)))
    if not len(squares):
        return np.full(len(places), np.inf)
    best = np.full(len(places), np.inf)
    for k in range(0, len(squares), 200):
        some = squares[k : k + 200]
        gx = np.maximum(np.abs(places[:, :1] - some[:, 0]) - 0.5, 0.0)
        gy = np.maximum(np.abs(places[:, 1:] - some[:, 1]) - 0.5, 0.0)
        np.minimum(best, (gx * gx + gy * gy).min(axis=1), out=best)
    return np.asarray(np.sqrt(best))


_JUDGES: dict[str, Callable[[np.random.Generator, Tally, int], None]] = {
    "free": _free,
    "exact": _exact,
    "monotone": _monotone,
    "laws": _laws,
}

CHECK = Check(
    "profile",
    ("G11",),
    "speed profiles keep every limit at and between nodes, stand at the goal, and are never clipped",
    KINDS,
    _run,
)
