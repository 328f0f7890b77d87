"""docs/output.md lists every key of ``--json`` and every column of ``--csv``: commands are run and compared with it."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from bad_inputs.case import inside, run

pytestmark = pytest.mark.source
PAGE = Path(__file__).resolve().parents[1] / "docs" / "output.md"
SHARED = "Tables of several commands"
STUDY = """version: 1
name: t
maps: [guide, {bundled: maze-31, queries: {random: 1}}]
planners: [astar, ad-gso]
seeds: 2
traffic: [{kind: random-walk, count: 2}]
"""
EDITED = """version: 1
map: guide
obstacles: [{kind: random-walk, count: 2}]
simulate: {}
edits: [{tick: 3, blocked: [[5, 5]]}]
"""
POLYGON = """version: 1
map: guide
obstacles: [{kind: random-walk, count: 1, rectangle: [0.8, 0.4]}]
drive: {}
"""
NEAR = "x_m,y_m,radius,top_speed\n0.9,0.5,0.2,1.0\n"
POSES = ("env-3", "--resolution", "0.25", "--drive", "differential")
CAR = ("env-3", "--resolution", "0.25", "--drive", "ackermann", "--turn-radius", "0.8")
RUNS: dict[str, tuple[tuple[str, ...], ...]] = {
    "plan": (
        ("plan", "env-1", "--explain"), ("plan", "guide", "--moves", "sixteen-connected"),
        ("plan", "guide", "--set", "min_clearance=1"), ("plan", *POSES, "--planner", "pad"),
        ("plan", *CAR, "--planner", "pad"), ("plan", "guide", "--via", "1,9", "--via-order", "best"),
        ("plan", *CAR, "--planner", "lattice-sipp"), ("plan", "guide", "--planner", "voronoi"),
        ("plan", "guide", "--planner", "rrt-connect", "--explain"),
        ("plan", "guide", "--planner", "fastest-time"),
        ("plan", *CAR, "--planner", "lattice", "--set", "primitives=costly.mprim"),
    ),
    "speed": (("speed", "guide"), ("speed", "guide", "--obstacle-states", "near.csv", "--law", "optimum")),
    "simulate": (("simulate", "guide", "--moves", "sixteen-connected"), ("run", "edited.yaml"),
                 ("simulate", "guide", "--sensor-range", "3", "--via", "3,7")),
    "drive": (("drive", "guide"), ("drive", *POSES, "--planner", "lattice", "--obstacles", "1"),
              ("drive", *POSES, "--planner", "lattice", "--controller", "rpp"), ("run", "polygon.yaml"),
              ("drive", *POSES, "--planner", "lattice-sipp"),
              ("drive", "guide", "--planner", "astar", "--sensor-range", "3", "--via", "3,7")),
    "compare": (
        ("compare", "guide", "--planners", "astar,sipp"),
        ("compare", "guide", "--planners", "astar,sipp", "--obstacles", "2", "--seeds", "1"),
    ),
    "study": (("study", "t.yaml", "--store", "a.db"),),
    "fleet": (("fleet", "guide", "--robots", "4"),),
    "fleet --execute": (("fleet", "guide", "--robots", "4", "--execute", "--fault", "1@2"),),
    "fleet --lifelong": (("fleet", "guide", "--robots", "4", "--lifelong", "9", "--fault", "1@2"),),
    "maps segment": (("maps", "segment", "photo.pgm", "-o", "photo.png", "--force"),),
    "swarm": (("swarm", "guide", "--robots", "6", "--iterations", "3"),),
}  # fmt: skip
TABLES: dict[str, tuple[tuple[str, ...], ...]] = {
    "plan": (
        ("plan", "guide"), ("plan", "guide", "--preset", "dissertation"), ("plan", "guide", "--planner", "sipp"),
        ("plan", *POSES, "--planner", "lattice"), ("plan", *POSES, "--planner", "lattice-sipp"),
    ),
    "speed": (("speed", "guide"),),
    "simulate": (("simulate", "guide"),),
    "drive": (("drive", "guide"), ("drive", *POSES, "--planner", "lattice-sipp")),
    "compare": (("study", "t.yaml", "--store", "b.db", "--timing"),),
}  # fmt: skip


@cache
def rows() -> dict[str, frozenset[str]]:
    """Section to the names in the first column of its tables."""
    found = {}
    for section in re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        firsts = re.findall(r"^\| (`.*?) \|", section, re.MULTILINE)
        names = [name for first in firsts for name in re.findall(r"`([^`]+)`", first)]
        assert len(names) == len(set(names)), "a name twice"
        found[section.partition("\n")[0]] = frozenset(names)
    return found


def keys(value: Any, known: frozenset[str], at: str = "") -> set[str]:
    """Names of all values: ``a.b``, ``a[].b``; ``a.*`` where the page says that names vary."""
    if isinstance(value, dict):
        vary = any(name.startswith(f"{at}.*") for name in known)
        inner = [
            keys(part, known, f"{at}.*" if vary else f"{at}.{key}".lstrip(".")) for key, part in value.items()
        ]
        return {at} - {""} | set().union(*inner)
    if isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        return {at}.union(*(keys(one, known, f"{at}[]") for one in value))
    return {at}


def implied(names: frozenset[str] | set[str]) -> set[str]:
    """The tables and lists that hold these keys."""
    return {name[:k] for name in names for k in range(len(name)) if name[k] in ".["} - {""}


@pytest.mark.commit(3)
@pytest.mark.parametrize("verb", RUNS)
def test_keys_of_json(verb: str, tmp_path: Path) -> None:
    own, shared = rows()[f"`{verb} --json`"], rows()[SHARED]
    seen: set[str] = set()
    with inside(tmp_path):
        Path("t.yaml").write_text(STUDY)
        Path("edited.yaml").write_text(EDITED)
        Path("polygon.yaml").write_text(POLYGON)
        Path("near.csv").write_text(NEAR)
        Path("photo.pgm").write_bytes(b"P5 4 2 255\n" + bytes((9, 9, 250, 240) * 2))
        if verb == "plan":
            assert run("primitives", *CAR[1:], "--out", "ours.mprim").exit == 0
            ours = Path("ours.mprim").read_text()
            Path("costly.mprim").write_text(ours.replace("costmult: 1", "costmult: 2"))
        for words in RUNS[verb]:
            done = run(*words, "--json")
            assert done.exit in (0, 4), done.err
            seen |= keys(json.loads(done.out), own | shared)
    seen = {name for name in seen if not name.startswith("summary.by_map[")}
    leaves, tables = own | shared, implied(own | shared)
    seen = {name.removesuffix("[]") for name in seen}
    assert sorted(seen - leaves - {table.removesuffix("[]") for table in tables}) == [], "not on the page"
    assert sorted(own - seen) == [], "on the page, not printed"


def test_shared_tables_are_printed(tmp_path: Path) -> None:
    shared, seen = rows()[SHARED], set()
    with inside(tmp_path):
        for words in (RUNS["plan"][0], RUNS["plan"][3], RUNS["speed"][0], RUNS["drive"][0]):
            seen |= keys(json.loads(run(*words, "--json").out), shared)
    assert sorted(shared - seen) == []


@pytest.mark.parametrize("verb", TABLES)
def test_columns_of_csv(verb: str, tmp_path: Path) -> None:
    (own,) = (names for title, names in rows().items() if title.startswith(f"`{verb} --csv`"))
    seen: set[str] = set()
    with inside(tmp_path):
        Path("t.yaml").write_text(STUDY)
        for k, words in enumerate(TABLES[verb]):
            done = run(*words, "--csv", f"{k}.csv")
            assert done.exit in (0, 4), done.err
            seen |= set(Path(f"{k}.csv").read_text().partition("\n")[0].split(","))
        if verb == "compare":
            assert run("compare", "guide", "--planners", "astar", "--csv", "c.csv").exit == 0
            assert set(Path("c.csv").read_text().partition("\n")[0].split(",")) <= own
    assert seen == own


def test_a_key_too_many_or_too_few_is_found() -> None:
    page = frozenset({"a.b", "c[].d", "e.*.f"})
    told = keys({"a": {"b": 1, "x": 2}, "c": [{"d": 1}, {"y": 2}], "e": {"one": {"f": 1}}}, page)
    assert told - page - {n.removesuffix("[]") for n in implied(page)} >= {"a.x", "c[].y"}
    assert "e.*.f" in told
