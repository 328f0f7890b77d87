"""More of row 99: ways, moving obstacles and zones in files, and the words of ``speed`` and ``drive``."""

from __future__ import annotations

from bad_inputs.case import Case, Content

_ROOM = b"....\n.##.\n....\n"
_MAP = ("speed", "room.txt")
_WAY = b"x_m,y_m\n0.5,0.5\n3.5,0.5\n"
_OTHER = (
    b'{"planner": "x", "cells": [[0, 0]], '
    b'"map": {"width": 9, "height": 9, "resolution": 1, "origin": [0, 0, 0]}}'
)
_MASK = b"image: z.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 1.0\nfree_thresh: 0.0\n"
_ENDS = ("--start", "0,0", "--goal", "3,0")


def _way(name: str, file: str, content: Content, code: str, *says: str, exit: int = 3) -> Case:
    """A way that must be refused."""
    call = (*_MAP, "--path", file)
    return Case(99, f"way {name}", call, {"room.txt": _ROOM, file: content}, code, exit, (file, *says))


def _beside(
    name: str, option: str, file: str, content: Content, code: str, *says: str, exit: int = 3
) -> Case:
    """A file beside a good way."""
    files: dict[str, Content] = {"room.txt": _ROOM, file: content}
    return Case(99, f"{option[2:]} {name}", (*_MAP, *_ENDS, option, file), files, code, exit, (file, *says))


WAYS = [
    _way("empty", "w.csv", b"", "PATH_FILE", "no row of numbers", "x_m,y_m or x,y"),
    _way("no column", "w.csv", b"lat,lon\n1,2\n", "PATH_FILE", "w.csv:1", "no column x"),
    _way("nan", "w.csv", b"x,y\n1,nan\n", "PATH_FILE", "w.csv:2", "y is 'nan'", "a number"),
    _way("decimal commas", "w.csv", b"x;y\n0,5;1\n", "PATH_FILE", "w.csv:2", "'0,5'", "with a point"),
    _way("huge", "w.csv", b"x,y\n1e300,0\n", "PATH_FILE", "w.csv:2", "1e+09"),
    _way("not text", "w.csv", b"x,y\n\xff\xfe,1\n", "PATH_FILE", "w.csv:2", "not UTF-8"),
    _way("a picture", "w.png", b"\x89PNG\r\n\x1a\n\0\0", "PATH_FILE", "w.png:1", "not UTF-8"),
    _way("too long", "w.csv", lambda: b"x,y\n" + b"1,1\n" * 100_001, "LIMIT", "100,001 points", exit=5),
    _way("one long line", "w.csv", lambda: b"1," * 50_000, "LIMIT", "w.csv:1", exit=5),
    _way("too large", "w.csv", lambda: b" " * (2**24 + 1), "FILE_TOO_LARGE", exit=5),
    _way("json list", "w.json", b"[[1, 2]]", "JSON_SHAPE", "w.json:1:1", "a list"),
    _way("json nan", "w.json", b'{"poses": [{"position": {"x": NaN}}]}', "JSON_NUMBER", "w.json:1:31"),
    _way("json of something", "w.json", b'{"points": []}', "PATH_FILE", "'points'", "nav_msgs/Path"),
    _way(
        "pose without place",
        "w.json",
        b'{"poses": [{"pose": {"x": 1}}]}',
        "PATH_FILE",
        "w.json:1:21",
        "no position",
    ),
    _way("plan without path", "w.json", b'{"planner": "x", "cells": null}', "PATH_FILE", "found no path"),
    _way("plan of another map", "w.json", _OTHER, "PATH_MAP", "9 x 9", "4 x 3", "it was planned on"),
    _way("yaml alias", "w.yaml", b"poses: &a [*a]\n", "YAML_ALIAS", "w.yaml:1:"),
    _way("yaml tag", "w.yaml", b"poses: !!python/object/apply:os.system ['x']\n", "YAML_TAG", "w.yaml:1:"),
    _way("outside", "w.csv", b"x,y\n0.5,0.5\n9,0.5\n", "PATH_OUTSIDE", "point 1", "--units cells"),
    Case(99, "way missing", (*_MAP, "--path", "w.csv"), {"room.txt": _ROOM}, "FILE_MISSING", 3, ("w.csv",)),
    Case(
        99,
        "way through a wall",
        (*_MAP, "--path", "w.csv"),
        {"room.txt": _ROOM, "w.csv": b"x,y\n0.5,1.5\n3.5,1.5\n"},
        "PATH_BLOCKED",
        3,
        ("(1, 1)",),
    ),
    Case(
        99,
        "way and an end",
        (*_MAP, "--path", "w.csv", "--goal", "1,1"),
        {"room.txt": _ROOM, "w.csv": _WAY},
        "OPTIONS",
        2,
        ("--path and --goal", "one of them"),
    ),
    Case(
        99,
        "way units",
        (*_MAP, "--path", "w.csv", "--units", "inches"),
        {"room.txt": _ROOM, "w.csv": _WAY},
        "UNITS",
        2,
        ("--units", "'inches'", "metres, cells"),
    ),
]
BESIDE = [
    _beside(
        "no header",
        "--obstacle-states",
        "m.csv",
        b"1,2,3,4\n",
        "OBSTACLE_STATES_FILE",
        "no header",
        "top_speed",
    ),
    _beside(
        "no column",
        "--obstacle-states",
        "m.csv",
        b"x_m,y_m,radius\n1,2,3\n",
        "OBSTACLE_STATES_FILE",
        "no column top_speed",
    ),
    _beside(
        "a negative radius",
        "--obstacle-states",
        "m.csv",
        b"x_m,y_m,radius,top_speed\n1,1,-1,0\n",
        "OBSTACLE_STATES_FILE",
        "m.csv:2",
        "radius is '-1'",
        "a number from 0",
    ),
    _beside(
        "too fast",
        "--obstacle-states",
        "m.csv",
        b"x_m,y_m,radius,top_speed,vx,vy\n1,1,0,1,2,0\n",
        "OBSTACLE_STATES_FILE",
        "m.csv:2",
        "2 m/s",
        "at most the top speed, 1",
    ),
    _beside(
        "zero",
        "--zones",
        "z.csv",
        b"1,1,1,1\n1,0,1,1\n1,1,1,1\n",
        "ZONES_VALUE",
        "line 2, field 2",
        "'0'",
        "inf for no limit",
    ),
    _beside("another size", "--zones", "z.csv", b"1,1\n1,1\n", "ZONES_MAP", "line 1", "4 x 3 cells"),
    _beside("a mask in trinary", "--zones", "z.yaml", _MASK, "ZONES_MODE", "z.yaml:1:1", "scale, or raw"),
    _beside("another ending", "--zones", "z.txt", b"1\n", "SUFFIX", "'.txt'", ".npy", exit=2),
    _beside("no array", "--zones", "z.npy", b"1,1\n", "NPY_HEADER", "numpy.save"),
]
WORDS = [
    Case(
        99,
        f"misspelt {words[-1]}",
        words,
        {"room.txt": _ROOM},
        code,
        2,
        (repr(words[-1]), f"did you mean {right}?"),
    )
    for code, words, right in (
        ("LAW", (*_MAP, *_ENDS, "--laws", "optimun"), "optimum"),
        ("LAW", ("laws", "physicl"), "physical"),
        ("SMOOTH", (*_MAP, *_ENDS, "--smooth", "arks"), "arcs"),
        ("COLOUR_BY", (*_MAP, *_ENDS, "--colour-by", "causes"), "cause"),
        ("DRIVE_SETTING", ("drive", "guide", "--obstacle-info", "track"), "tracks"),
    )
]
MORE = [
    Case(
        99,
        "setting of a law",
        (*_MAP, *_ENDS, "--set-law", "creap=1"),
        {"room.txt": _ROOM},
        "LAW_SETTING",
        2,
        ("'creap'", "did you mean creep?"),
    ),
    Case(
        99,
        "setting of a law out of range",
        (*_MAP, *_ENDS, "--set-law", "creep=2"),
        {"room.txt": _ROOM},
        "LAW_SETTING",
        2,
        ("--set-law creep: 2", "1e-06 to 1"),
    ),
    Case(
        99,
        "speed at the start",
        (*_MAP, *_ENDS, "--v0", "9"),
        {"room.txt": _ROOM},
        "PROFILE_INFEASIBLE",
        2,
        ("--v0: 9 m/s",),
    ),
    Case(
        99,
        "spacing",
        (*_MAP, *_ENDS, "--smooth", "straight", "--spacing", "-1"),
        {"room.txt": _ROOM},
        "SPACING",
        2,
        ("--spacing: -1.0", "metres"),
    ),
    Case(99, "jerk", ("drive", "guide", "--jerk-max", "0"), {}, "ROBOT_LIMIT", 2, ("--jerk-max: 0.0",)),
    Case(99, "lateral", ("plan", "guide", "--a-lat-max", "-1"), {}, "ROBOT_LIMIT", 2, ("--a-lat-max: -1.0",)),
    Case(
        99,
        "turning circle",
        ("simulate", "guide", "--turn-radius", "inf"),
        {},
        "ROBOT_LIMIT",
        2,
        ("--turn-radius: inf",),
    ),
    Case(
        99,
        "period",
        ("drive", "guide", "--period", "0"),
        {},
        "DRIVE_SETTING",
        2,
        ("--period: 0.0", "1e-06 to 1e+06"),
    ),
]

CASES: tuple[Case, ...] = (*WAYS, *BESIDE, *WORDS, *MORE)
