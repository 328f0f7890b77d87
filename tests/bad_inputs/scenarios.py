"""Rows 68 to 92: scenario files and the numbers of a run. Most are JSON, some the same mistake in YAML.

An end that is blocked and a goal in another room are answers, not errors: exit code 4, and the sentence says
which cell, or how many cells there are on either side.
"""

from __future__ import annotations

from bad_inputs.case import Case, Content

GUIDE = '"map": "guide", "start": [0, 9], "goal": [7, 0]'
TWO_ROOMS = '"map": {"rows": ["######", "#....#", "######", "#..###", "######"], "resolution": 0.5}'
FOUND = "A path was found."


def _json(
    row: int,
    name: str,
    body: Content | str,
    code: str = "",
    *says: str,
    exit: int | None = None,
    prints: tuple[str, ...] = (),
    files: dict[str, bytes] | None = None,
) -> Case:
    """A file ``s.json`` for ``lampyris run``; a text is what stands behind the version."""
    content = f'{{"version": 1, {body}}}'.encode() if isinstance(body, str) else body
    exit = exit if exit is not None else 3 if code else 0
    where = ("s.json",) if code else ()
    written: dict[str, Content] = {**(files or {}), "s.json": content}
    return Case(row, name, ("run", "s.json"), written, code, exit, (*where, *says), prints, silent=not code)


def _yaml(row: int, name: str, text: str, code: str, *says: str, exit: int = 3) -> Case:
    return Case(row, name, ("run", "s.yaml"), {"s.yaml": text.encode()}, code, exit, ("s.yaml", *says))


def _with(row: int, name: str, more: str, code: str, *says: str, exit: int = 3) -> Case:
    return _json(row, name, f"{GUIDE}, {more}", code, *says, exit=exit)


def _moving(row: int, name: str, obstacles: str, code: str, *says: str, exit: int = 3) -> Case:
    return _with(row, name, f'"simulate": {{}}, "obstacles": [{obstacles}]', code, *says, exit=exit)


def _track(*cells: tuple[int, int]) -> str:
    return f'{{"kind": "recorded", "track": {[list(c) for c in cells]}}}'


def _lines(*lines: str) -> bytes:
    return "\n".join(lines).encode()


SYNTAX = [
    _json(
        68,
        "trailing comma",
        _lines('{"version": 1,', f" {GUIDE},", "}"),
        "JSON_SYNTAX",
        "s.json:2:49",
        "a comma before }",
        "take the comma away",
    ),
    _json(
        68,
        "comment",
        _lines("{", '  "version": 1, // the first', f"  {GUIDE}", "}"),
        "JSON_SYNTAX",
        "s.json:2:17",
        "'/'",
        "JSON has no comments",
    ),
    _json(68, "cut", _lines("{", f'  "version": 1, {GUIDE}'), "JSON_SYNTAX", "s.json:2:", "ends too early"),
    _json(68, "cut in a text", b'{"version": 1, "map": "gui', "JSON_SYNTAX", "s.json:1:23", "closing"),
    _json(68, "empty", b"", "JSON_SHAPE", "s.json:1:1", "the file is empty", "one object"),
    _json(68, "a list", b"[]", "JSON_SHAPE", "s.json:1:1", "a list", "one object"),
    _yaml(68, "yaml cut", f"{{version: 1, {GUIDE}", "YAML_SYNTAX", "s.yaml:1:"),
    *(
        _with(69, value, f'"robot": {{"v_max": {value}}}', "JSON_NUMBER", "s.json:1:", "/robot/v_max", value)
        for value in ("NaN", "Infinity", "1e999")
    ),
    _yaml(
        69,
        "yaml nan",
        f"{{version: 1, {GUIDE}, robot: {{v_max: .nan}}}}",
        "ROBOT_LIMIT",
        "/robot/v_max",
        "NaN",
    ),
    _json(
        70,
        "twice",
        _lines('{"version": 1,', f"{GUIDE},", '"robot": {"v_max": 1,', ' "v_max": 2}}'),
        "JSON_DUPLICATE",
        "s.json:4:2",
        "/robot/v_max",
        "on lines 3 and 4",
        "each key once",
    ),
    _json(
        71,
        "100,000 brackets",
        b'{"version": 1, "map": ' + b"[" * 100_000,
        "JSON_DEPTH",
        "s.json:1:5",
        "32 levels",
        exit=5,
    ),
    _with(71, "5000 digits", f'"seed": {"9" * 5000}', "JSON_NUMBER", "/seed", "5,000 digits", "at most 30"),
    _json(71, "17 MiB", lambda: b" " * (17 * 2**20), "JSON_SIZE", "17,825,792 bytes", "16,777,216", exit=5),
    _json(71, "many values", lambda: b'{"a": [' + b"0," * 600_000 + b"0]}", "JSON_SIZE", "500,000", exit=5),
    _json(72, "byte order mark", b"\xef\xbb\xbf" + f'{{"version": 1, {GUIDE}}}'.encode(), prints=(FOUND,)),
    _with(73, "half a pair", r'"name": "\ud800"', "JSON_TEXT", "/name", "U+D800", "surrogate"),
    _with(73, "control character", r'"name": "a\u001b[31m"', "JSON_TEXT", "/name", "U+001B", "control"),
    _json(
        73,
        "1 MB name",
        lambda: f'{{"version": 1, {GUIDE}, "name": "{"x" * 2**20}"}}'.encode(),
        "JSON_TEXT",
        "/name",
        "1,048,576 characters",
        "1 to 64 printable",
    ),
    _with(73, "no name", '"name": ""', "JSON_TEXT", "/name", "1 to 64 printable"),
]

ENDS = [
    *(
        _json(
            74,
            start,
            f'"map": "guide", "start": {start}, "goal": [7, 0]',
            "TYPE",
            "/start/0",
            f"{value} is not a whole number",
            "two whole numbers",
        )
        for start, value in (("[1.5, 2]", "1.5"), ('["1", 2]', "'1'"), ("[true, 2]", "true"))
    ),
    _json(
        75,
        "start",
        '"map": "guide", "start": [-1, 0], "goal": [7, 0]',
        "START_OUTSIDE",
        "/start",
        "(-1, 0)",
        "x 0 to 9",
    ),
    _json(
        76,
        "goal",
        '"map": "guide", "start": [0, 9], "goal": [7, 10]',
        "GOAL_OUTSIDE",
        "/goal",
        "(7, 10)",
        "y 0 to 9",
    ),
    _json(
        77,
        "start",
        f'{TWO_ROOMS}, "start": [0, 0], "goal": [1, 1]',
        exit=4,
        prints=("start (0, 0) is blocked",),
    ),
    _json(
        77,
        "goal",
        f'{TWO_ROOMS}, "start": [1, 1], "goal": [0, 2]',
        exit=4,
        prints=("goal (0, 2) is blocked",),
    ),
    _json(
        78,
        "too wide",
        f'{TWO_ROOMS}, "start": [2, 1], "goal": [1, 1], "robot": {{"radius": 0.35}}',
        exit=4,
        prints=("start (2, 1) is free, but 0.25 m from a wall", "radius is", "0.35 m"),
    ),
    _json(
        79, "start is goal", f'{TWO_ROOMS}, "start": [1, 1], "goal": [1, 1]', prints=(FOUND, "1 cells", "0 m")
    ),
    _json(
        80,
        "another room",
        f'{TWO_ROOMS}, "start": [1, 1], "goal": [1, 3]',
        exit=4,
        prints=("No path", "region has 4 cells", "2"),
    ),
]

KEYS = [
    _with(81, "robt", '"robt": {}', "KEY", "s.json:1:65", "/robt", "'robt'", "did you mean /robot?"),
    _with(81, "deeper", '"robot": {"vmax": 1}', "KEY", "/robot/vmax", "did you mean /robot/v_max?"),
    _json(81, "no map", '"start": [0, 9]', "KEY", "s.json:1:1", "`map` is missing", "bundled"),
    _json(81, "no version", f"{{{GUIDE}}}".encode(), "KEY", "s.json:1:1", "`version` is missing"),
    _json(
        82, "99", f'{{"version": 99, {GUIDE}}}'.encode(), "VERSION", "/version", "99", "newer", "version 1"
    ),
]

BODIES = [
    _moving(83, "on the robot", _track((0, 9)), "OBSTACLE_START", "(0, 9)", "t = 0"),
    _moving(
        83, "two in one cell", f"{_track((3, 7))}, {_track((3, 7))}", "OBSTACLE_OVERLAP", "0 and 1", "t = 0"
    ),
    _moving(
        84, "leaves the map", _track((9, 9), (10, 9)), "OBSTACLE_TRACK", "/obstacles/0", "(10, 9)", "10 x 10"
    ),
    _json(
        84,
        "enters a wall",
        f'{TWO_ROOMS}, "start": [1, 1], "goal": [2, 1], "simulate": {{}}, '
        f'"obstacles": [{_track((4, 1), (4, 2))}]',
        "OBSTACLE_TRACK",
        "(4, 2)",
    ),
    _moving(
        85, "jumps", _track((9, 9), (4, 9)), "OBSTACLE_SPEED", "/obstacles/0", "(4, 9) at t = 1", "one cell"
    ),
    _json(
        86,
        "times fall",
        f'{GUIDE}, "simulate": {{}}, "obstacles": [{{"kind": "recorded", "file": "t.csv"}}]',
        "OBSTACLE_TIME",
        "/obstacles/0",
        "t.csv:4",
        "tick 1",
        "ticks rise",
        files={"t.csv": b"tick,x,y\n0,9,9\n2,9,8\n1,9,7\n"},
    ),
    _moving(86, "no cell", _track(), "OBSTACLE_TIME", "/obstacles/0/track", "0 values", "one or more cells"),
    _moving(
        87,
        "100,001",
        '{"kind": "crossing", "count": 100001}',
        "LIMIT",
        "/obstacles/0/count",
        "100,001",
        "10,000",
        exit=5,
    ),
    _json(
        87,
        "100,001 tables",
        lambda: (f'{{"version": 1, {GUIDE}, "obstacles": [' + ",".join(["{}"] * 100_001) + "]}").encode(),
        "LIMIT",
        "/obstacles",
        "100,001",
        "10,000",
        exit=5,
    ),
    _moving(
        87,
        "in all",
        ",".join(['{"kind": "crossing", "count": 6000}'] * 2),
        "LIMIT",
        "/obstacles",
        "12,000",
        "10,000",
        exit=5,
    ),
]

NUMBERS = [
    *(
        _with(
            88,
            f"{key} {value}",
            f'"robot": {{"{key}": {value}}}',
            "ROBOT_LIMIT",
            f"/robot/{key}",
            value,
            "a number from 1e-06",
        )
        for key, value in (("v_max", "0"), ("v_max", "-1"), ("a_max", "0"), ("d_max", "0"))
    ),
    _with(
        88, "radius", '"robot": {"radius": -0.1}', "ROBOT_LIMIT", "/robot/radius", "-0.1", "a number from 0"
    ),
    Case(
        88,
        "on the line",
        ("plan", "guide", "--a-max", "nan"),
        code="ROBOT_LIMIT",
        exit=2,
        says=("--a-max: nan",),
    ),
    *(
        Case(
            90,
            f"{key} {value}",
            ("plan", "guide", "--planner", "gso", "--set", f"{key}={value}"),
            code=key.upper(),
            exit=2,
            says=(f"--set {key}: {value}", "to"),
        )
        for key, value in (("swarm", "0"), ("iterations", "-1"), ("iterations", "1000000000"), ("rho", "1.5"))
    ),
    _with(
        90,
        "in a file",
        '"planner": {"name": "gso", "settings": {"swarm": 0}}',
        "SWARM",
        "/planner/settings/swarm",
        "swarm 0",
    ),
    *(
        _with(91, value.strip('"'), f'"seed": {value}', "SEED", "/seed", value.strip('"'), "0 to 2^63 - 1")
        for value in ("-1", "1.5", str(2**70), '"x"')
    ),
    *(
        Case(
            91,
            f"on the line, {value}",
            ("plan", "guide", "--seed", value),
            code="SEED",
            exit=2,
            says=(f"--seed: {value}", "2^63 - 1"),
        )
        for value in ("-1", str(2**70))
    ),
]

CASES: list[Case] = [*SYNTAX, *ENDS, *KEYS, *BODIES, *NUMBERS]
