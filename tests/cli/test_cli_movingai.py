"""``lampyris movingai`` as its users meet it: the verdict, the list, the exit codes, JSON and CSV."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

from in_process import call

MAP = "type octile\nheight 3\nwidth 4\nmap\n....\n.@..\n....\n"


def scen(folder: Path, *queries: tuple[str, str]) -> Path:
    """A map and a file of queries: start and goal as ``x y x y``, and the length."""
    (folder / "a.map").write_text(MAP)
    out = folder / "a.map.scen"
    lines = [f"{k}\tmaps/a.map\t4\t3\t{ends}\t{length}" for k, (ends, length) in enumerate(queries)]
    out.write_text("\n".join(["version 1", *(line.replace(" ", "\t") for line in lines)]) + "\n")
    return out


RIGHT = (("0 0 3 0", "3"), ("0 0 3 1", "3.41421356"), ("0 0 0 0", "0"))
WRONG = ("0 2 3 1", "3.40000")


def run(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return call("movingai", *words, cwd=cwd, columns=100)


def test_all_agree(tmp_path: Path) -> None:
    done = run(scen(tmp_path, *RIGHT), "--strict")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("0 of 3 disagree\n")
    for part in ("a.map, 4 x 3 cells", "astar, octile moves", "3 of 3, 0 unreachable", "expansions"):
        assert part in done.stdout


def test_every_disagreement_is_listed_and_strict_says_so(tmp_path: Path) -> None:
    path = scen(tmp_path, *RIGHT, WRONG)
    done = run(path)
    assert done.returncode == 0
    assert done.stdout.startswith("1 of 4 disagree\n")
    row = next(line for line in done.stdout.splitlines() if "(0, 2)" in line)
    for part in ("5\t", "\t(3, 1)\t", "\t3.40000\t", "\t3.41421\t", "\tfound"):
        assert part in row
    strict = run(path, "--strict")
    assert strict.returncode == 3
    assert strict.stdout.splitlines()[0] == "1 of 4 disagree"
    assert run(path, "--strict", "--limit", "3").returncode == 0


def test_json_has_the_counts_by_bucket(tmp_path: Path) -> None:
    path = scen(tmp_path, *RIGHT, WRONG)
    done = run(path, "--json", "--strict", "--planner", "dijkstra", "--csv", tmp_path / "out.csv")
    assert (done.returncode, done.stderr) == (3, "")
    record = json.loads(done.stdout)
    assert {k: record[k] for k in ("queries", "solved", "disagree", "unreachable")} == {
        "queries": 4, "solved": 4, "disagree": 1, "unreachable": 0
    }  # fmt: skip
    assert (record["planner"], record["moves"], record["scen"]) == ("dijkstra", "octile", "a.map.scen")
    assert record["disagreements"] == [
        {"line": 5, "start": [0, 2], "goal": [3, 1], "published": 3.4, "ours": 2 + 2**0.5, "status": "found"}
    ]
    assert [b["bucket"] for b in record["buckets"]] == [0, 1, 2, 3]
    assert [b["disagree"] for b in record["buckets"]] == [0, 0, 0, 1]
    assert sum(b["expansions"] for b in record["buckets"]) == record["expansions"]
    assert set(record["timing"]) == {"plan_s", "referee_s", "loading_s", "total_s"}
    first = (tmp_path / "out.csv").read_bytes()
    rows = list(csv.DictReader(first.decode().splitlines()))
    assert [r["agrees"] for r in rows] == ["yes", "yes", "yes", "no"]
    assert [float(r["ours"]) for r in rows] == [3.0, 2 + 2**0.5, 0.0, 2 + 2**0.5]
    again = run(path, "--json", "--planner", "dijkstra", "--csv", tmp_path / "out.csv")
    assert again.returncode == 2
    assert "--force" in again.stderr
    words = (path, "--json", "--planner", "dijkstra", "--no-timing", "--csv", tmp_path / "out.csv", "--force")
    once_more = run(*words)
    assert json.loads(once_more.stdout) == {**record, "timing": {}}
    assert run(*words).stdout == once_more.stdout
    assert (tmp_path / "out.csv").read_bytes() == first


def test_planners_that_need_not_be_optimal_are_told_by_their_ratio(tmp_path: Path) -> None:
    done = run(scen(tmp_path, *RIGHT, WRONG), "--planner", "ad-gso", "--set", "choice=exact", "--strict")
    assert done.returncode == 0
    assert "no shorter than the published optimum" in done.stdout
    assert "worst 1.004" in done.stdout


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("b.scen",), 3, "FILE_MISSING"),
        (("a.map.scen", "--planner", "astra"), 2, "did you mean astar?"),
        (("a.map.scen", "--moves", "ocktile"), 2, "did you mean octile?"),
        (("a.map.scen", "--limit", "0"), 2, "--limit: 0"),
        (("a.map.scen", "--set", "rho=1"), 2, "astar has no setting"),
        (("a.map.scen", "--max-cells", "11"), 5, "MAP_TOO_LARGE"),
        (("a.map.scen", "--map", "guide"), 3, "SCEN_SIZE"),
        (("wall.scen",), 3, "wall.scen: line 2: start (1,1) is '@'"),
    ],
)
def test_mistakes_are_named_in_one_line(words: tuple[str, ...], code: int, says: str, tmp_path: Path) -> None:
    scen(tmp_path, ("1 1 3 0", "3")).rename(tmp_path / "wall.scen")
    scen(tmp_path, *RIGHT)
    done = run(*words, cwd=tmp_path)
    assert done.returncode == code, (done.returncode, done.stderr)
    assert says in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['lampyris', 'movingai', '--help']\n"
        "from lampyris.cli import main\n"
        "try:\n    main()\nexcept SystemExit as e:\n    assert not e.code, e.code\n"
        "heavy = set('numpy numba scipy matplotlib PIL'.split()) & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
