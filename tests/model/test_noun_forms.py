"""What every noun can say of itself: a short repr, HTML, a dictionary that JSON holds, a table."""

from __future__ import annotations

import dataclasses
import json
import math
import re
import subprocess
import sys
from html.parser import HTMLParser
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from test_copies import KINDS, arrays_in, classes, nouns

import lampyris
from lampyris._core.noun import MAX_REPR, Noun
from lampyris.errors import SettingError, UnknownSettingError, UsageError
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.report.data.columns import drive_columns, plan_columns, profile_columns, trace_columns

PICTURED = ("Grid", "Scene", "Plan", "Path", "Field", "Profile", "Trace", "Drive", "Curve", "PoseCurve")


@pytest.fixture(params=[*KINDS, SampledPath], ids=lambda kind: kind.__name__)
def noun(request: pytest.FixtureRequest) -> Any:
    """One of each class."""
    if request.param is SampledPath:
        return lampyris.smooth(nouns()[lampyris.Scene], nouns()[lampyris.Plan])
    return nouns()[request.param]


def test_every_class_of_the_model_is_a_noun() -> None:
    assert [kind.__name__ for kind in classes() if not issubclass(kind, Noun)] == []


def test_a_repr_is_one_short_line_that_names_the_class(noun: Noun) -> None:
    text = repr(noun)
    assert len(text) <= MAX_REPR == 120
    assert "\n" not in text
    assert type(noun).__name__ in text


def test_a_plan_has_its_length_in_metres() -> None:
    grid = lampyris.Grid(np.zeros((8, 8), bool), resolution=0.5)
    cells = lampyris.plan(lampyris.Scene(grid, (0, 0), (7, 7)), "astar")
    assert cells.length_m == pytest.approx(7 * math.sqrt(2) * 0.5)
    assert cells.reversals is None
    lines = lampyris.plan(lampyris.Scene(grid, (0, 0), (7, 3)), "theta-star")
    assert lines.length_m == pytest.approx(math.hypot(7, 3) * 0.5)
    poses = lampyris.plan(
        lampyris.Scene(grid, start_pose=(1.25, 1.25, 0.0), goal_pose=(2.75, 1.25, 0.0)), "lattice"
    )
    assert poses.length_m == pytest.approx(1.5)
    assert poses.reversals == 0
    assert repr(poses).endswith("poses, 1.5 m, bound 1>")
    assert lampyris.Plan(lampyris.Status.NO_PATH, "astar").length_m is None


def test_a_repr_says_what_matters() -> None:
    scene = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38))
    plan = lampyris.plan(scene)
    assert repr(plan) == "<Plan found by ad-gso: 61 cells, cost 63.3137, gap 9.54%>"
    assert repr(scene.grid) == "<Grid env-1: 50 x 50 cells of 1 m, 23.6% blocked>"
    assert repr(lampyris.speed_profile(scene, plan)) == "<Profile physical: 61 nodes, 63.3137 m in 73.6569 s>"
    assert repr(lampyris.Plan(lampyris.Status.NO_PATH, "astar")) == "<Plan no-path by astar>"
    assert repr(lampyris.Robot(radius=0.3)) == "Robot(radius=0.3)"
    assert repr(lampyris.RandomWalk(20)) == "RandomWalk(count=20)"
    long = lampyris.Patrol(tuple((k, 0) for k in range(10_000)))
    assert repr(long) == "Patrol(waypoints=((0, 0), (1, 0), (2, 0), ...))"


class Tags(HTMLParser):
    """Which tags are open, and whether each was closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.open.append(tag)
        self.seen.append(tag)
        assert all(not name.startswith("on") for name, _ in attrs)

    def handle_startendtag(self, tag: str, attrs: Any) -> None:
        self.seen.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_html_is_whole_and_small(noun: Any) -> None:
    text = noun._repr_html_()
    tags = Tags()
    tags.feed(text)
    assert tags.open == []
    assert "table" in tags.seen
    assert len(text) < 40_000
    assert ("svg" in tags.seen) == (type(noun).__name__ in PICTURED)
    for drawing in re.findall(r"<svg.*?</svg>", text):
        ElementTree.fromstring(drawing)


def test_html_escapes_names() -> None:
    grid = lampyris.Grid(np.zeros((3, 3), bool), name="<script>alert(1)</script>")
    text = grid._repr_html_()
    assert text is not None
    assert "<script" not in text
    assert "&lt;script&gt;" in text


def test_the_picture_of_a_path_is_its_cells() -> None:
    path = nouns()[lampyris.Path]
    (points,) = re.findall(r'points="([^"]*)"', path._repr_html_())
    assert [[int(v) for v in one.split(",")] for one in points.split()] == path.cells.tolist()


def test_nouns_load_no_report_until_they_are_shown() -> None:
    code = (
        "import sys, lampyris; s = lampyris.Scene(lampyris.Grid([[0, 0]]), (0, 0), (1, 0)); repr(s); s.to_dict();"
        "assert not [m for m in sys.modules if m.startswith(('lampyris.report', 'matplotlib', 'pandas'))];"
        "s._repr_html_(); assert 'lampyris.report.pictures.noun_view' in sys.modules; assert 'matplotlib' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_dictionary_makes_an_equal_noun(noun: Any) -> None:
    given = noun.to_dict()
    assert list(given)[:2] == ["type", "version"]
    text = json.dumps(given, allow_nan=False)
    made = type(noun).from_dict(json.loads(text))
    assert made == noun
    assert json.dumps(made.to_dict(), allow_nan=False) == text
    assert [a.dtype for a in arrays_in(made)] == [a.dtype for a in arrays_in(noun)]
    assert not [a for a in arrays_in(made) if a.flags.writeable]


def test_a_dictionary_holds_what_is_not_compared_too() -> None:
    trace = nouns()[lampyris.Trace]
    assert lampyris.Trace.from_dict(trace.to_dict()).timing == trace.timing


def test_numbers_that_json_does_not_have_are_words() -> None:
    field = nouns()[lampyris.Field]
    assert np.isinf(field.luciferin).any()
    words = {v for row in field.to_dict()["luciferin"] for v in row if isinstance(v, str)}
    assert words == {"inf"}
    plan = dataclasses.replace(nouns()[lampyris.Plan], best_by_iteration=(math.inf, 3.0))
    assert lampyris.Plan.from_dict(plan.to_dict()).best_by_iteration == (math.inf, 3.0)


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"type": "Path"}, "type"),
        ({"version": 2}, "version"),
        ({"version": True}, "version"),
        ({"status": "lost"}, "status"),
        ({"path": 3}, "path"),
        ({"iterations": 1.5}, "iterations"),
        ({"iterations": True}, "iterations"),
        ({"planner": None}, "planner"),
        ({"jumps": "none"}, "jumps"),
        ({"gates_met": [[1, 2, 3]]}, "gates_met"),
        ({"attributes": [1]}, "attributes"),
    ],
)
def test_a_wrong_dictionary_is_refused_by_name(change: dict[str, Any], where: str) -> None:
    given = nouns()[lampyris.Plan].to_dict() | change
    with pytest.raises(SettingError, match=rf"DICT\]: {where}"):
        lampyris.Plan.from_dict(given)


def test_a_dictionary_with_too_much_or_too_little_is_refused() -> None:
    given = lampyris.Robot(radius=0.5).to_dict()
    with pytest.raises(UnknownSettingError, match="did you mean radius"):
        lampyris.Robot.from_dict(given | {"radios": 1.0})
    assert lampyris.Robot.from_dict({"type": "Robot", "radius": 0.5}) == lampyris.Robot(radius=0.5)
    with pytest.raises(SettingError, match=r"count: missing"):
        lampyris.RandomWalk.from_dict({"type": "RandomWalk"})
    with pytest.raises(SettingError, match="ROBOT_LIMIT"):
        lampyris.Robot.from_dict(given | {"v_max": -1.0})
    scene = nouns()[lampyris.Scene].to_dict()
    for cells in ([[0, 1], [0]], [[0.5, 1]], [[2**40, 1]], ["012"], [None]):
        with pytest.raises(SettingError):
            lampyris.Scene.from_dict(scene | {"grid": scene["grid"] | {"blocked": cells}})
    with pytest.raises(SettingError, match=r"DICT\]: traffic\[0\]\.type"):
        lampyris.Scene.from_dict(scene | {"traffic": [{"type": "Robot"}]})
    for wrong in (None, 3, "Robot", [], {}):
        with pytest.raises(SettingError, match="DICT"):
            lampyris.Robot.from_dict(wrong)  # type: ignore[arg-type]


def test_columns_are_metres_and_seconds() -> None:
    grid = lampyris.Grid(np.zeros((4, 6), bool), resolution=0.5, origin=(10.0, 20.0, 0.0))
    scene = lampyris.Scene(grid, (0, 3), (5, 3))
    plan, run = lampyris.plan(scene, "astar"), lampyris.simulate(scene, "astar")
    driven = lampyris.drive(scene, "astar")
    assert plan.path is not None
    columns = plan_columns(plan, plan.path, scene.grid.frame)
    assert columns["x_m"] == [10.25, 10.75, 11.25, 11.75, 12.25, 12.75]
    assert columns["y_m"] == [20.25] * 6
    assert columns["s"] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]
    assert trace_columns(run)["x_m"] == columns["x_m"]
    assert drive_columns(driven)["t_s"] == driven.t.tolist()
    assert drive_columns(driven)["x_m"][-1] == pytest.approx(12.75)
    sampled = lampyris.speed_profile(scene, lampyris.smooth(scene, plan))
    made = profile_columns(sampled, sampled.frame)
    assert made["x_m"][0] == 10.25
    assert (
        next(iter(profile_columns(lampyris.speed_profile(scene, plan, "dissertation"), None)))
        == "t_transfers"
    )


class Recorder(ModuleType):
    """Stands in place of pandas: keeps what a table is made of."""

    @staticmethod
    def DataFrame(columns: dict[str, Any]) -> dict[str, Any]:
        assert len({len(column) for column in columns.values()}) == 1
        return columns


def test_tables_are_made_by_pandas_of_these_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", Recorder("pandas"))
    scene = nouns()[lampyris.Scene]
    plan = lampyris.plan(scene, "astar")
    table: Any = plan.to_pandas()
    assert list(table) == ["x_m", "y_m", "yaw", "s", "x", "y"]
    for noun in (nouns()[lampyris.Profile], nouns()[lampyris.Trace], nouns()[lampyris.Drive]):
        assert len(noun.to_pandas()) >= 6
    bare = dataclasses.replace(plan, frame=None)
    assert bare.to_pandas(scene.grid) == table
    with pytest.raises(UsageError, match=r"plan\.to_pandas\(scene\.grid\)"):
        bare.to_pandas()
    with pytest.raises(UsageError, match="has no path"):
        lampyris.Plan(lampyris.Status.NO_PATH, "astar").to_pandas()


def test_without_pandas_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(UsageError, match=r"pip install 'lampyris\[pandas\]'"):
        nouns()[lampyris.Trace].to_pandas()


def test_tables_of_pandas_itself() -> None:
    pandas = pytest.importorskip("pandas")
    table = nouns()[lampyris.Trace].to_pandas()
    assert isinstance(table, pandas.DataFrame)
    assert len(table) == nouns()[lampyris.Trace].ticks + 1
    assert table["x_m"].dtype == np.float64
