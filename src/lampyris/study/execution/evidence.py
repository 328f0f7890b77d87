"""Evidence: what a run came to, as plain data, and the noun of it again on a scene of one's own.

Evidence comes from a worker, and is not trusted. It holds claims (where the robot was, what it cost, how
often it waited), and no scene: that is the reader's own. Sizes are read first and checked before anything is
unpacked. Whether the claims are true is for the referee to say (:mod:`lampyris.study.execution.verify`); here they only
have to be of the right form.

Arrays of numbers go into one block, compressed and in base64: a simulation of 20 obstacles and 80 ticks is
2 KB of JSON.
"""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.model.path import Path
from lampyris.model.plan import Plan, Status
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import Sensor
from lampyris.model.trace import Event, Outcome, Trace
from lampyris.model.traffic import Obstacle
from lampyris.planning.field.layers import moves_for, moves_on
from lampyris.typing import Cell

MAX_BYTES = 512 * 2**20
"""Of all arrays of one run together, unpacked."""

MAX_NOTES = 20
MAX_NOTE = 500

_LEVEL = 1
"""Of compression. Level 6 makes a simulation's evidence 8 % smaller and takes four times as long."""

_Arrays = dict[str, NDArray[Any]]
_Noun = TypeVar("_Noun")

_PLAN = {"cells": ("<i4", 2), "schedule": ("<i8", 1), "waypoints": ("<i4", 2), "places": ("<f8", 2)}
_PROFILE = dict.fromkeys("svat", ("<f8", 1)) | {
    "cause_index": ("<i4", 1), "cause": ("<i2", 1), "xy": ("<f8", 2),
}  # fmt: skip
_TRACE = {
    "robot": ("<i4", 2), "tracks": ("<i4", 2), "appears": ("<i4", 1), "speed": ("<f8", 1),
    "cause": ("<i2", 1), "events": ("<i4", 2), "seen": ("<i4", 2),
}  # fmt: skip
"""What arrays a noun has, their elements and how many axes."""


# ---- arrays --------------------


def pack_arrays(arrays: Mapping[str, NDArray[Any]], form: Mapping[str, tuple[str, int]]) -> dict[str, Any]:
    """Arrays as plain data: their shapes, and one block of all their bytes."""
    made = {name: np.ascontiguousarray(array, dtype=form[name][0]) for name, array in arrays.items()}
    block = b"".join(array.tobytes() for array in made.values())
    return {
        "shapes": [[name, list(array.shape)] for name, array in made.items()],
        "block": base64.b64encode(zlib.compress(block, _LEVEL)).decode("ascii"),
    }


def unpack_arrays(plain: Mapping[str, Any], form: Mapping[str, tuple[str, int]]) -> _Arrays:
    """The arrays again.

    Raises
    ------
    FileError : ``EVIDENCE``: not of this form. LimitError : ``EVIDENCE_SIZE``: more than 512 MB.
    """
    shapes = [(name, tuple(whole(n, "shapes") for n in shape)) for name, shape in plain["shapes"]]
    sizes = []
    for name, shape in shapes:
        if name not in form or len(shape) != form[name][1]:
            raise wrong(f"an array {name!r} of {len(shape)} axes", ", ".join(form))
        sizes.append(math.prod(shape) * np.dtype(form[name][0]).itemsize)
    total = sum(sizes)
    if total > MAX_BYTES:
        raise LimitError("EVIDENCE_SIZE", f"{total:,} bytes", where="evidence", allowed=f"{MAX_BYTES:,}")
    try:
        packed = base64.b64decode(plain["block"], validate=True)
        reader = zlib.decompressobj()
        block = reader.decompress(packed, total + 1)
    except (binascii.Error, zlib.error, ValueError, TypeError) as why:
        raise wrong(f"a block that cannot be read: {why}", "base64 of zlib") from None
    if len(block) != total or not reader.eof or reader.unused_data:
        raise wrong(f"a block of {len(block):,} bytes or more", f"{total:,}, as its shapes say")
    out: _Arrays = {}
    at = 0
    for (name, shape), size in zip(shapes, sizes, strict=True):
        out[name] = np.frombuffer(block, form[name][0], math.prod(shape), at).reshape(shape)
        at += size
    return out


def wrong(what: str, allowed: str) -> FileError:
    return FileError("EVIDENCE", what, where="evidence", allowed=allowed)


def whole(value: Any, what: str, least: int = 0) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value < 2**62:
        raise wrong(f"{what} {value!r}", f"a whole number >= {least}")
    return value


def number(value: Any, what: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise wrong(f"{what} {value!r}", "a finite number")
    return float(value)


def reading(kind: str, plain: Any, read: Callable[[Mapping[str, Any]], _Noun]) -> _Noun:
    """What the reader makes of it; whatever is amiss becomes one typed error."""
    if not isinstance(plain, Mapping) or plain.get("kind") != kind:
        raise wrong("something else", f"evidence of a {kind}")
    try:
        return read(plain)
    except LampyrisError:
        raise
    except (KeyError, IndexError, TypeError, ValueError, OverflowError, AttributeError) as why:
        raise wrong(f"{type(why).__name__}: {why}", f"evidence of a {kind}") from None


def words(cause: Sequence[str]) -> tuple[list[str], NDArray[np.int16]]:
    """Words as a table without repeats, and the number of each."""
    table = {word: k for k, word in enumerate(dict.fromkeys(cause))}
    return list(table), np.array([table[word] for word in cause], dtype=np.int16)


def words_at(plain: Mapping[str, Any], numbers: NDArray[Any], name: str = "words") -> tuple[str, ...]:
    words = plain[name]
    if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
        raise wrong(f"{name} of another kind", "a list of words")
    if len(numbers) and not 0 <= int(numbers.min()) <= int(numbers.max()) < len(words):
        raise wrong(f"a number of a word out of {len(words)}", "0 to the number of words less one")
    return tuple(words[k] for k in numbers.tolist())


def notes_of(plain: Mapping[str, Any]) -> tuple[str, ...]:
    """What a planner says it did otherwise than asked: text for people, which nothing is decided by.

    It is cut to :data:`MAX_NOTES` sentences of :data:`MAX_NOTE` characters, each printable.
    """
    notes = plain["notes"]
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        raise wrong("notes of another kind", "a list of sentences")
    kept = ("".join(c if c.isprintable() else "?" for c in note[:MAX_NOTE]) for note in notes[:MAX_NOTES])
    return tuple(note for note in kept if note)


def _path(plain: Mapping[str, Any], cells: NDArray[Any], scene: Scene) -> Path:
    """A path with the steps and cost that are claimed, in the costs of the scene's moves."""
    steps = tuple(whole(n, "steps") for n in plain["steps"])
    moves = moves_on(scene.grid, scene.moves)
    if len(steps) < (3 if moves.knight else 2):
        moves = moves_for(scene)
    return Path(cells, moves, steps, whole(plain["exact"], "exact"))


def _claimed(path: Path) -> dict[str, Any]:
    return {"steps": [int(n) for n in path.steps], "exact": int(path.exact)}


def _gaps(first: NDArray[Any]) -> NDArray[Any]:
    """Differences down the rows, the first row as it is: small numbers, which compress."""
    return np.diff(first, axis=0, prepend=first[:1] * 0)


def rows(parts: Sequence[NDArray[Any]], columns: int) -> NDArray[Any]:
    """Tables of so many columns, one below the other."""
    return np.concatenate([np.zeros((0, columns)), *parts])


def counts(parts: Sequence[NDArray[Any]]) -> NDArray[np.int32]:
    """How many rows each has."""
    return np.array([len(p) for p in parts], dtype=np.int32)


def split(whole: NDArray[Any], counts: NDArray[Any]) -> list[NDArray[Any]]:
    """The tables again."""
    event_words = counts.tolist()
    if min(event_words, default=0) < 0 or sum(event_words) != len(whole):
        raise wrong(f"{len(whole)} rows for {sum(event_words)}", "as many as are stated")
    return list(np.split(whole, np.cumsum(event_words)[:-1])) if event_words else []


# ---- plans and profiles --------------------


def plan_evidence(plan: Plan, profile: Profile | None) -> dict[str, Any]:
    """A plan and the speeds on it."""
    arrays: _Arrays = {}
    if plan.path is not None and plan.pose_path is None:
        arrays["cells"] = _gaps(plan.path.cells)
    if plan.schedule is not None:
        arrays["schedule"] = plan.schedule
    if plan.waypoints is not None:
        arrays["waypoints" if plan.waypoints.dtype.kind == "i" else "places"] = plan.waypoints
    return {
        "kind": "plan",
        "status": plan.status.value,
        "iterations": int(plan.iterations),
        "expansions": int(plan.expansions),
        "optimal": None if plan.optimal_exact is None else int(plan.optimal_exact),
        "gates_met": [[int(x), int(y)] for x, y in plan.gates_met],
        "path": None if plan.path is None or plan.pose_path is not None else _claimed(plan.path),
        "arrays": pack_arrays(arrays, _PLAN),
        "profile": None if profile is None else profile_evidence(profile),
        "notes": list(plan.notes),
    }


def plan_of(plain: Any, scene: Scene, planner: str) -> tuple[Plan, Profile | None]:
    """The plan and the profile that are claimed.

    Raises
    ------
    FileError : ``EVIDENCE``. LimitError : ``EVIDENCE_SIZE``.
    """

    def read(plain: Mapping[str, Any]) -> tuple[Plan, Profile | None]:
        arrays = unpack_arrays(plain["arrays"], _PLAN)
        path = plain["path"]
        profile = plain["profile"]
        plan = Plan(
            Status(plain["status"]),
            planner,
            None if path is None else _path(path, np.cumsum(arrays["cells"], axis=0), scene),
            iterations=whole(plain["iterations"], "iterations"),
            expansions=whole(plain["expansions"], "expansions"),
            optimal_exact=None if plain["optimal"] is None else whole(plain["optimal"], "optimal"),
            gates_met=tuple((int(x), int(y)) for x, y in plain["gates_met"]),
            schedule=arrays.get("schedule"),
            waypoints=arrays.get("waypoints", arrays.get("places")),
            notes=notes_of(plain),
        )
        return plan, None if profile is None else profile_of(profile)

    return reading("plan", plain, read)


def profile_evidence(profile: Profile) -> dict[str, Any]:
    """Speeds as plain data."""
    table, cause = words(profile.cause)
    arrays = {name: getattr(profile, name) for name in "svat"} | {
        "cause_index": profile.cause_index,
        "cause": cause,
    }
    if profile.xy is not None:
        arrays["xy"] = profile.xy
    return {
        "law": profile.law, "units": profile.units, "words": table,
        "arrays": pack_arrays(arrays, _PROFILE),
    }  # fmt: skip


def profile_of(plain: Mapping[str, Any]) -> Profile:
    """The speeds that are claimed."""
    got = unpack_arrays(plain["arrays"], _PROFILE)
    s, v, a, t = (got[name] for name in "svat")
    cause = words_at(plain, got["cause"])
    return Profile(
        str(plain["law"]), s, v, a, t, cause, str(plain["units"]), got["cause_index"].astype(np.int64), (),
        got.get("xy"),
    )  # fmt: skip


# ---- simulations --------------------


def trace_evidence(trace: Trace, *, replayed: bool) -> dict[str, Any]:
    """A simulation. Where its obstacles were ``replayed`` the reader has their tracks already."""
    table, cause = words(trace.cause)
    event_words, word = words([event.word for event in trace.events])
    rows = [(e.tick, k, *e.cell) for e, k in zip(trace.events, word.tolist(), strict=True)]
    arrays: _Arrays = {
        "robot": _gaps(trace.robot),
        "speed": trace.speed,
        "cause": cause,
        "events": np.array(rows, dtype=np.int32).reshape(-1, 4),
    }
    if trace.seen is not None:
        arrays["seen"] = trace.seen
    if not replayed:
        arrays["appears"] = np.array(trace.appears, dtype=np.int32)
        if trace.tracks:
            arrays["tracks"] = _gaps(np.concatenate(trace.tracks))
    return {
        "kind": "simulate",
        "outcome": trace.outcome.value,
        "words": table,
        "event_words": event_words,
        "path": None if trace.path is None else _claimed(trace.path),
        "counts": [
            int(n)
            for n in (trace.replans, trace.waits, trace.iterations, trace.expansions, trace.path_switches)
        ],
        "last_tick": trace.last_tick,
        "obstacle_count": len(trace.obstacle_specs),
        "notes": list(trace.notes),
        "arrays": pack_arrays(arrays, _TRACE),
    }


def trace_of(
    plain: Any,
    scene: Scene,
    *,
    planner: str,
    law: tuple[str, str],
    seed: int,
    obstacles: Callable[[int], Sequence[Obstacle]],
    replayed: Callable[[int], NDArray[np.int32]] | None,
    sensor: Sensor | None = None,
    goal_track: Sequence[Cell] | None = None,
) -> Trace:
    """The simulation that is claimed.

    Parameters
    ----------
    scene : where it was.
    planner, law, seed : of the job; the law's name and units.
    obstacles : what so many obstacles of this world are.
    replayed : the cells of all obstacles up to a tick, int32 (ticks + 1, obstacles, 2); None: they are in the evidence.
    sensor, goal_track : of the job.

    Raises
    ------
    FileError : ``EVIDENCE``. LimitError : ``EVIDENCE_SIZE``.
    """

    def read(plain: Mapping[str, Any]) -> Trace:
        got = unpack_arrays(plain["arrays"], _TRACE)
        robot = np.cumsum(got["robot"], axis=0).astype(np.int32)
        count = whole(plain["obstacle_count"], "obstacle_count")
        everybody = tuple(obstacles(count))
        if len(robot) == 0:
            raise wrong("a robot without a place", "one cell a tick, from tick 0 on")
        if replayed is not None:
            at = replayed(len(robot) - 1)
            appears, tracks = (0,) * count, tuple(at.transpose(1, 0, 2)[:count])
        else:
            appears = tuple(int(t) for t in got["appears"].tolist())
            tracks = _split_tracks(got, appears, len(robot))
        event_words = words_at(plain, got["events"][:, 1], "event_words")
        events = tuple(
            Event(tick, word, (x, y))
            for (tick, _, x, y), word in zip(got["events"].tolist(), event_words, strict=True)
        )
        path = plain["path"]
        replans, waits, iterations, expansions, path_switches = (whole(n, "counts") for n in plain["counts"])
        moved = np.append(True, (robot[1:] != robot[:-1]).any(axis=1))
        return Trace(
            scene=scene, planner=planner, seed=seed, outcome=Outcome(plain["outcome"]), robot=robot,
            tracks=tracks, appears=appears, obstacle_specs=everybody, speed=got["speed"],
            cause=words_at(plain, got["cause"]), law=law[0], units=law[1], events=events, replans=replans,
            waits=waits, iterations=iterations, expansions=expansions, path_switches=path_switches,
            path=None if path is None else _path(path, robot[moved], scene),
            last_tick=None if plain["last_tick"] is None else whole(plain["last_tick"], "last_tick"),
            notes=notes_of(plain), sensor=sensor, seen=got.get("seen"),
            goal_track=None if goal_track is None else np.array(goal_track, dtype=np.int32),
        )  # fmt: skip

    return reading("simulate", plain, read)


def _split_tracks(got: _Arrays, appears: Sequence[int], ticks: int) -> tuple[NDArray[Any], ...]:
    lengths = [ticks - t for t in appears]
    cells = np.cumsum(got.get("tracks", np.zeros((0, 2), dtype=np.int32)), axis=0)
    if min(lengths, default=1) < 1 or sum(lengths) != len(cells):
        raise wrong(f"{len(cells)} places of {len(lengths)} obstacles", "one a tick from its first on")
    return tuple(np.split(cells.astype(np.int32), np.cumsum(lengths)[:-1])) if lengths else ()
