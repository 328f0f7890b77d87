"""Scen: which map is meant, what is refused with its line, when an answer agrees with a published length."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lampyris import movingai as benchmarks
from lampyris.errors import FileError, LampyrisError, SceneError
from lampyris.io.maps.formats.movingai import ScenQuery
from lampyris.io.maps.recipes.make import make
from lampyris.model.plan import Status
from lampyris_selfcheck.reference.paths.search import distances

MAP = """type octile
height 4
width 6
map
......
.@@T..
.@.WW.
...W@S
"""


def line(start: tuple[int, int], goal: tuple[int, int], length: str, name: str = "a.map", size: str = "6\t4",
         bucket: int = 0) -> str:  # fmt: skip
    return f"{bucket}\t{name}\t{size}\t{start[0]}\t{start[1]}\t{goal[0]}\t{goal[1]}\t{length}\n"


def files(folder: Path, *lines: str, map_: str = "a.map", called: str = "a.map.scen") -> Path:
    (folder / map_).write_text(MAP)
    out = folder / called
    out.write_text("version 1\n" + "".join(lines))
    return out


def query(length: str, decimals: int) -> ScenQuery:
    return ScenQuery(2, 0, "a", 6, 4, (0, 0), (0, 0), float(length), decimals)


@pytest.mark.nightly
def test_it_agrees_with_a_twin_that_shares_no_code(tmp_path: Path) -> None:
    for seed in range(3):
        blocked = make("caves", 30, 20, seed)
        free = (~blocked).tolist()
        (tmp_path / "m.map").write_text(
            "type octile\nheight 20\nwidth 30\nmap\n"
            + "".join("".join(".@"[c] for c in row) + "\n" for row in blocked.tolist())
        )
        rng = np.random.default_rng(seed)
        ys, xs = np.nonzero(~blocked)
        lines = []
        for k in range(25):
            pick = rng.integers(0, len(xs), 2)
            (sx, gx), (sy, gy) = xs[pick].tolist(), ys[pick].tolist()
            n, m, _ = distances(free, "octile", (gx, gy))[sx, sy]
            lines.append(
                line((sx, sy), (gx, gy), f"{n + m * math.sqrt(2):.{k % 7 + 2}f}", "x/m.map", "30\t20", k // 5)
            )
        (tmp_path / "m.map.scen").write_text("version 1.0\n" + "".join(lines))
        benchmark = benchmarks.load(tmp_path / "m.map.scen")
        for planner in ("astar", "dijkstra"):
            made = benchmarks.ask(benchmark, planner)
            assert made.rule == "equal"
            assert made.disagreements == ()
            assert made.summary["solved"] == 25
        assert list(made.buckets) == [0, 1, 2, 3, 4]
        assert sum(b["expansions"] for b in made.buckets.values()) == made.summary["expansions"] > 0
        greedy = benchmarks.ask(benchmark, "ad-gso")
        assert greedy.rule == "not shorter"
        assert greedy.disagreements == ()
        assert greedy.summary["worst_ratio"] >= greedy.summary["mean_ratio"] > 0.999
        exact = benchmarks.ask(benchmark, "ad-gso", choice="exact")
        assert [a.cost for a in exact.answers] == [a.cost for a in made.answers]


def test_disagreements_are_found_on_either_side(tmp_path: Path) -> None:
    path = files(
        tmp_path,
        line((0, 0), (5, 0), "5.00000"),
        line((0, 0), (5, 0), "4.99000"),
        line((0, 0), (5, 0), "5.01000"),
        line((0, 0), (2, 2), "7"),  # really 4 + 2 sqrt 2 or so: no whole number
        line((0, 0), (0, 0), "0"),
    )
    benchmark = benchmarks.load(path)
    assert [a.query.line for a in benchmarks.ask(benchmark).disagreements] == [3, 4, 5]
    # A planner that need not be optimal disagrees only when it is shorter than the optimum.
    assert [a.query.line for a in benchmarks.ask(benchmark, "ad-gso").disagreements] == [4, 5]
    # By other moves nothing can be compared, but each must be found.
    four = benchmarks.ask(benchmark, moves="four-connected")
    assert (four.rule, four.disagreements) == ("found", ())
    assert [a.ratio for a in four.answers[-2:]] == [6 / 7, None]
    short = benchmarks.ask(benchmark, limit=2)
    assert short.summary["queries"] == 2
    assert short.answers == benchmarks.ask(benchmark).answers[:2]


def test_water_is_a_country_of_its_own(tmp_path: Path) -> None:
    benchmark = benchmarks.load(
        files(
            tmp_path,
            line((3, 3), (4, 2), "2"),
            line((3, 3), (0, 0), "3"),
            line((5, 3), (3, 3), "3"),
            line((5, 3), (0, 3), "9.00000"),
        )
    )
    made = benchmarks.ask(benchmark)
    assert [a.status for a in made.answers] == [Status.FOUND, *[Status.GOAL_OCCUPIED] * 2, Status.FOUND]
    assert made.summary["unreachable"] == 2
    assert [a.query.line for a in made.disagreements] == [3, 4, 5]
    assert made.answers[-1].cost == 9 + math.sqrt(2)


@pytest.mark.parametrize(
    ("printed", "ours", "agrees"),
    [
        ("4.41421", 3 + math.sqrt(2), True),
        ("4.41421", 4.4143, False),
        ("244.95", 244.9482681718907, True),
        ("244.95", 244.956, False),
        ("244.9", 244.94, True),
        ("2.00000000", 2.0000199, True),
        ("2.00000000", 2.0000201, False),
        ("100000.5", 100000.55, True),
        ("100000.5", 100001.6, False),
        ("6", 6.00005, True),
        ("6", 5.82842712, False),
    ],
)
def test_lengths_are_compared_to_the_digits_they_are_printed_with(
    printed: str, ours: float, agrees: bool
) -> None:
    one = query(printed, len(printed.partition(".")[2]))
    # Beside a line with digits; see tolerances.
    slack = benchmarks.tolerances([one, query("1.4142", 4)])[0]
    assert (abs(ours - one.length) <= slack) is agrees


def test_whole_numbers_are_rounded_only_where_all_are() -> None:
    assert benchmarks.tolerances([query("6", 0), query("8", 0)]) == [0.5, 0.5]
    assert benchmarks.tolerances([query("6", 0), query("8.5", 1)]) == [pytest.approx(6e-5), 0.05]


def test_the_map_is_the_one_beside_the_file(tmp_path: Path) -> None:
    one = line((0, 0), (5, 0), "5", "maps/dao/a.map")
    assert benchmarks.load(files(tmp_path, one)).document.grid.name == "a.map"
    windows = files(tmp_path, line((0, 0), (5, 0), "5", r"maps\dao\a.map"), called="other.scen")
    assert benchmarks.load(windows).document.grid.name == "a.map"
    # Called after a map of another format, and of any name, where that is said.
    (tmp_path / "b.txt").write_text("......\n......\n......\n......\n")
    elsewhere = files(tmp_path, line((0, 0), (5, 0), "5", "gone.map"), called="b.txt.scen")
    assert benchmarks.load(elsewhere).document.grid.name == "b.txt"
    given = benchmarks.load(elsewhere, tmp_path / "a.map")
    assert given.notes[0] == "the queries name gone.map; a.map was given"
    assert [q.line for q in given.queries] == [2]
    assert benchmarks.ask(given).disagreements == ()


@pytest.mark.parametrize(
    ("lines", "code", "says"),
    [
        ((), "SCEN_EMPTY", "a.map.scen"),
        ((line((0, 0), (5, 0), "5"), line((0, 0), (5, 0), "5", "b.map")), "SCEN_MAP", "line 3: map 'b.map'"),
        ((line((0, 0), (5, 0), "5", "b.map"),), "SCEN_MAP", "line 2"),
        ((line((0, 0), (5, 0), "5", "../a.map"),), "PATH_OUTSIDE", "line 2: map '../a.map'"),
        ((line((0, 0), (5, 0), "5", r"..\a.map"),), "PATH_OUTSIDE", "map=FILE"),
        ((line((0, 0), (5, 0), "5", size="7\t4"),), "SCEN_SIZE", "line 2"),
        ((line((0, 0), (6, 0), "5"),), "SCEN_RANGE", "line 2: goal x 6"),
        ((line((0, 0), (5, 0), "nan"),), "SCEN_LINE", "line 2"),
        (("\n", line((3, 1), (5, 0), "5")), "START_OCCUPIED", "line 3: start (3,1) is 'T'"),
        ((line((0, 0), (4, 3), "5"),), "GOAL_OCCUPIED", "line 2: goal (4,3) is '@'"),
    ],
)
def test_what_is_refused_is_named_with_its_line(
    tmp_path: Path, lines: tuple[str, ...], code: str, says: str
) -> None:
    with pytest.raises((FileError, SceneError)) as caught:
        benchmarks.load(files(tmp_path, *lines))
    assert caught.value.code == code
    assert says in str(caught.value)
    assert caught.value.exit_code == 3


def test_a_map_that_is_not_there_is_asked_for(tmp_path: Path) -> None:
    path = files(tmp_path, line((0, 0), (5, 0), "5", "b.map"), called="c.scen")
    with pytest.raises(FileError, match=r"FILE_MISSING.*line 2: map 'b.map'.*map=FILE"):
        benchmarks.load(path)
    for name in ("x" * 5000, "b\0.map", "maps/", "."):
        path.write_text(line((0, 0), (5, 0), "5", name))
        with pytest.raises(FileError, match="FILE_MISSING"):
            benchmarks.load(path)
    with pytest.raises(LampyrisError, match="MAP_TOO_LARGE"):
        benchmarks.load(files(tmp_path, line((0, 0), (5, 0), "5")), max_cells=23)


@pytest.mark.parametrize(
    ("given", "code"),
    [({"limit": 0}, "LIMIT"), ({"limit": True}, "LIMIT"), ({"seed": -1}, "SEED"),
     ({"planner": "a*"}, "PLANNER"), ({"moves": "five"}, "MOVES"), ({"rho": 1}, "SETTING")],
)  # fmt: skip
def test_a_wrong_word_is_refused(tmp_path: Path, given: dict[str, object], code: str) -> None:
    benchmark = benchmarks.load(files(tmp_path, line((0, 0), (5, 0), "5")))
    with pytest.raises(LampyrisError) as caught:
        benchmarks.ask(benchmark, **given)  # type: ignore[arg-type]
    assert caught.value.code == code


def test_a_sample_of_the_published_files(movingai: Path) -> None:
    for path in sorted(movingai.glob("*.scen")):
        made = benchmarks.ask(benchmarks.load(path), limit=20)
        assert made.disagreements == (), path.name
        assert made.summary["solved"] == 20
