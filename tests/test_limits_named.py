"""The limits of studies, scenarios, edits, planners and swarms on both sides; and the census of all limits.

Whoever adds a constant that is called a limit has to say here where it is asked at n - 1, n and n + 1, or
that it is none of what comes in.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import MAX_PART, FileError, LampyrisError
from lampyris.maps import json_text, ros_yaml, scenario_form, scenario_how, way_file
from lampyris.maps.json_text import read_json
from lampyris.maps.load import load_map
from lampyris.maps.scenario_file import MAX_SIDE
from lampyris.maps.way_file import read_way
from lampyris.model.edit import MAX_EDITS, Edit, check_edits
from lampyris.model.grid import MAX_TERRAIN, Grid
from lampyris.planners import _timed_session, ad_gso
from lampyris.scenarios import load_scenario
from lampyris.selfcheck import _fuzz_study
from lampyris.selfcheck.twins.map_files import put
from lampyris.study import file as study_file
from lampyris.study import form, ground, store_file, who
from lampyris.study.file import load_study
from lampyris.study.row import Row
from lampyris.study.store import Store
from lampyris.study.where import MAX_WORKERS, Where
from lampyris.swarm import glowworm, particle

SOURCE = Path(lampyris.__file__).parent
TESTS = Path(__file__).parent
Ask = Callable[[Path, int], object]
"""Given a folder and n: ask for n."""


def study(**parts: Any) -> Callable[[Path], object]:
    """A study on the guide map with these keys."""
    keys = {"version": 1, "maps": ["guide"], "planners": ["astar"], **parts}
    return lambda folder: load_study(put(folder, json.dumps(keys).encode(), "s.json"))


def scenario(**parts: Any) -> Callable[[Path], object]:
    keys = {"version": 1, "map": "guide", "start": [0, 9], "goal": [7, 0], **parts}
    text = json.dumps(keys).encode()
    return lambda folder: load_scenario(put(folder, text, "s.json"), max_cells=4096)


def drawn(n: int) -> dict[str, Any]:
    return {"bundled": "guide", "queries": {"random": n}}


def listed(folder: Path, n: int) -> object:
    """No file has room for so many: JSON ends at half a million values."""
    table = {"bundled": "guide", "queries": [{"start": [0, 9], "goal": [7, 0]}] * n, "limit": 1}
    return study_file.study_from({"version": 1, "maps": [table], "planners": ["astar"]}, load_map("guide"))


def grid_of(n: int) -> dict[str, Any]:
    return {"name": "ad-gso", "grid": {"rho": [k / n for k in range(1, n + 1)]}}


def packed_map(folder: Path, n: int) -> object:
    made = ground.pack(Grid([[False]]))
    return ground.unpack({**made, "name": "x" * n})


def count(n: int, many: int) -> list[dict[str, Any]]:
    """Crowds of n different counts, in entries of so many."""
    counts = list(range(n))
    return [{"kind": "crossing", "grid": {"count": counts[k : k + many]}} for k in range(0, n, many)]


LIMITS: dict[str, tuple[int, Ask, str]] = {
    "edits": (MAX_EDITS, lambda f, n: check_edits(Grid([[False]]), [Edit(k) for k in range(n)]), "LIMIT"),
    "edits of a scenario": (
        MAX_EDITS,
        lambda f, n: scenario(simulate={}, edits=[{"tick": k} for k in range(n)])(f),
        "LIMIT",
    ),
    "ticks of a scenario": (scenario_how.MAX_TICKS, lambda f, n: scenario(simulate={"ticks": n})(f), "TICKS"),
    "patience of a scenario": (
        scenario_how.MAX_TICKS,
        lambda f, n: scenario(simulate={"patience": n})(f),
        "PATIENCE",
    ),
    "words of a setting": (
        scenario_form.MAX_TEXT,
        lambda f, n: scenario(planner={"name": "ad-gso", "settings": {"choice": "x" * n}})(f),
        "JSON_TEXT",
    ),
    "side of a recipe": (
        MAX_SIDE,
        lambda f, n: scenario(map={"recipe": "random", "size": [n, 1]})(f),
        "MAP_SIZE",
    ),
    "maps of a study": (form.MAX_ENTRIES, lambda f, n: study(maps=["guide"] * n)(f), "MAPS"),
    "planners of a study": (form.MAX_ENTRIES, lambda f, n: study(planners=["astar"] * n)(f), "PLANNERS"),
    "laws of a study": (form.MAX_ENTRIES, lambda f, n: study(laws=["constant"] * n)(f), "LAWS"),
    "crowds of a study": (form.MAX_ENTRIES, lambda f, n: study(traffic=["none"] * n)(f), "TRAFFIC"),
    "planners that a grid unfolds to": (who.MAX_WHO, lambda f, n: study(planners=[grid_of(n)])(f), "LIMIT"),
    "crowds that grids unfold to": (who.MAX_WHO, lambda f, n: study(traffic=count(n, 1000))(f), "LIMIT"),
    "drawn queries": (
        form.MAX_QUERIES,
        lambda f, n: study(maps=[drawn(n)])(f),
        "LIMIT",
    ),
    "listed queries": (form.MAX_QUERIES, listed, "QUERIES"),
    "seeds of a study": (form.MAX_SEEDS, lambda f, n: study(seeds=n)(f), "LIMIT"),
    "words about a study": (form.MAX_ABOUT, lambda f, n: study(about="x" * n)(f), "JSON_TEXT"),
    "runs of a study": (
        study_file.MAX_JOBS // 1000,
        lambda f, n: study(seeds=n, planners=[grid_of(1000)], maps=[drawn(1)])(f),
        "LIMIT",
    ),
    "ticks of a study": (scenario_how.MAX_TICKS, lambda f, n: study(ticks=n)(f), "TICKS"),
    "name of a packed map": (ground.MAX_NAME, packed_map, "PACKED_MAP"),
    "workers": (MAX_WORKERS, lambda f, n: Where(workers=n), "WORKERS"),
    "nt": (ad_gso.MAX_NT, lambda f, n: ad_gso.AdGso(nt=n), "NT"),
    "mvr": (ad_gso.MAX_MVR, lambda f, n: ad_gso.AdGso(mvr=n), "MVR"),
    "window": (ad_gso.MAX_MVR, lambda f, n: ad_gso.AdGso(window=n), "WINDOW"),
    "horizon": (_timed_session.MAX_HORIZON, lambda f, n: _timed_session.Timed(horizon=n), "HORIZON"),
    "glowworms": (glowworm.MOST, lambda f, n: glowworm.GSO(n=n), "SWARM"),
    "particles": (particle.MOST, lambda f, n: particle.PSO(n=n), "SWARM"),
    "terrain": (MAX_TERRAIN, lambda f, n: Grid([[False]], terrain=[[n]]), "GRID_TERRAIN"),
    "way in YAML": (
        way_file.YAML_BYTES,
        lambda f, n: read_way(put(f, b"poses: []\n".ljust(n, b"#"), "w.yaml")),
        "YAML_SIZE",
    ),
    "values of a way in YAML": (
        way_file.YAML_VALUES,
        lambda f, n: read_way(put(f, b"poses: [" + b"0," * (n - 2) + b"]\n", "w.yaml")),
        "YAML_SIZE",
    ),
    "values of JSON": (
        json_text.MAX_VALUES,
        lambda f, n: read_json(b'{"a": [' + b"0," * (n - 2) + b"0]}", "m"),
        "JSON_SIZE",
    ),
}


def code_of(ask: Ask, folder: Path, n: int) -> str:
    """The code of the error, or nothing: within one limit another may be in the way."""
    try:
        ask(folder, n)
    except LampyrisError as problem:
        return problem.code
    return ""


@pytest.mark.parametrize("what", LIMITS)
def test_one_less_as_much_and_one_more(tmp_path: Path, what: str) -> None:
    limit, ask, code = LIMITS[what]
    for n in (limit - 1, limit):
        assert code_of(ask, tmp_path, n) != code
    with pytest.raises(LampyrisError) as caught:
        ask(tmp_path, limit + 1)
    assert caught.value.code == code, str(caught.value)


def test_origin_of_a_ros_map(tmp_path: Path) -> None:
    put(tmp_path, b"P5 1 1 255\n\xff", "m.pgm")
    most = ros_yaml.MAX_ORIGIN
    for value, good in ((most, True), (-most, True), (np.nextafter(most, np.inf), False), (-1.5e9, False)):
        text = f"image: m.pgm\nresolution: 1\norigin: [{value!r:.30}, 0, 0]\nnegate: 0\n".replace(
            "np.float64(", ""
        ).replace(")", "")
        path = put(tmp_path, f"{text}occupied_thresh: 0.65\nfree_thresh: 0.196\n".encode(), "m.yaml")
        if good:
            assert load_map(path).grid.origin[0] == value
        else:
            with pytest.raises(LampyrisError, match=r"^error\[MAP_ORIGIN\]"):
                load_map(path)


def test_parts_of_a_message() -> None:
    for n in (MAX_PART - 1, MAX_PART, MAX_PART + 1):
        words = str(FileError("CODE", "x" * n))
        assert ("x" * n in words) == (n <= MAX_PART)
        assert len(words) <= MAX_PART + 40


def test_a_value_of_a_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A text of as many bytes as SQLite may hand over is read; of one more the store is damaged."""
    path = tmp_path / "s.study.db"
    path.write_bytes(_fuzz_study.stores().seeds[1])
    row = Row("k" * 64, "failed", {}, {}, "x" * 30_000)
    with Store.open(path) as store:
        store.add([row])
    for limit in (30_001, 30_000):
        monkeypatch.setattr(store_file, "MAX_VALUE", limit)
        with Store.open(path, writable=False) as store:
            assert [one.error for one in store.scan()] == [row.error]
    monkeypatch.setattr(store_file, "MAX_VALUE", 29_999)
    with Store.open(path, writable=False) as store, pytest.raises(LampyrisError, match="STORE_DAMAGED"):
        list(store.scan())


# ---- the census --------------------

HERE = "test_limits_named.py"
LIMITS_PY = "test_limits.py"
NOT_INPUT = "not of what comes in: "
"""Followed by what it is instead."""
ASKED: dict[str, str] = {
    "api.MAX_SEED": LIMITS_PY,
    "cli.compare_work.MAX_RUNS": "cli/test_cli_compare.py",
    "checks.MOST_WHOLE": "test_bad_arguments.py",
    "errors.MAX_DIGITS": "test_bad_arguments.py",
    "errors.MAX_PART": HERE,
    "errors.MAX_SHOWN": "test_bad_arguments.py",
    "field.frame.MOST": NOT_INPUT + "as many cells as a number of 32 bits tells apart; maps are smaller",
    "maps.csv_table.MAX_BYTES": LIMITS_PY,
    "maps.csv_table.MAX_LINE": LIMITS_PY,
    "maps.csv_table.MAX_LINES": LIMITS_PY,
    "maps.dob.MAX_WORDS": LIMITS_PY,
    "maps.image.MAX_CHUNKS": LIMITS_PY,
    "maps.image.MAX_TEXT": LIMITS_PY,
    "maps.json_text.MAX_BYTES": LIMITS_PY,
    "maps.json_text.MAX_DEPTH": LIMITS_PY,
    "maps.json_text.MAX_DIGITS": LIMITS_PY,
    "maps.json_text.MAX_VALUES": HERE,
    "limits.MAX_CELLS": LIMITS_PY,
    "maps.movingai.MAX_SCEN_BYTES": LIMITS_PY,
    "maps.movingai.MAX_SCEN_LINES": LIMITS_PY,
    "maps.ros_yaml.MAX_ORIGIN": HERE,
    "maps.scenario.MAX_SEED": LIMITS_PY,
    "maps.scenario_faults.MOST": NOT_INPUT + "mistakes told whole",
    "maps.scenario_file.MAX_SIDE": HERE,
    "maps.scenario_form.MAX_TEXT": HERE,
    "maps.scenario_how.MAX_TICKS": HERE,
    "maps.tracks.MAX_TICKS": LIMITS_PY,
    "maps.way_file.MAX_POINTS": LIMITS_PY,
    "maps.yaml_text.MAX_BYTES": LIMITS_PY,
    "maps.yaml_text.MAX_DEPTH": LIMITS_PY,
    "maps.yaml_text.MAX_DIGITS": LIMITS_PY,
    "maps.yaml_text.MAX_VALUES": LIMITS_PY,
    "model.edit.MAX_EDITED": "model/test_edit.py",
    "model.edit.MAX_EDITS": HERE,
    "model.grid.MAX_TERRAIN": HERE,
    "model.scene.MAX_RADIUS": LIMITS_PY,
    "model.traffic.MAX_BODIES": LIMITS_PY,
    "planners._timed_session.MAX_HORIZON": HERE,
    "planners.ad_gso.MAX_MVR": HERE,
    "planners.ad_gso.MAX_NT": HERE,
    "report.animate.MAX_FRAMES": "report/test_report_film.py",
    "sim.drive_settings.MAX_PASSED": "sim/test_sim_drive.py",
    "sim.feed._MOST": "sim/test_sim_feed.py",
    "study.batches.MAX_JOBS": NOT_INPUT + "jobs of a batch",
    "study.compare.MAX_DRAWN": "study/test_study_compare.py",
    "study.compare.MAX_EXACT": "study/test_study_compare.py",
    "study.evidence.MAX_BYTES": "study/test_study_evidence.py",
    "study.evidence.MAX_NOTE": "study/test_study_otherwise.py",
    "study.evidence.MAX_NOTES": "study/test_study_otherwise.py",
    "study.file.MAX_JOBS": HERE,
    "study.form.MAX_ABOUT": HERE,
    "study.form.MAX_ENTRIES": HERE,
    "study.form.MAX_QUERIES": HERE,
    "study.form.MAX_SEEDS": HERE,
    "study.ground.MAX_NAME": HERE,
    "study.judge.MAX_WORDS": "study/test_study_judge.py",
    "study.one.MAX_WORDS": "study/test_study_one.py",
    "study.page_figures.MAX_LINES": NOT_INPUT + "curves of a figure",
    "study.page_figures.MAX_ROWS": NOT_INPUT + "rows of a figure",
    "study.page_figures.MAX_RUNS": NOT_INPUT + "bars of a figure",
    "study.page_films.MAX_BYTES": NOT_INPUT + "films of a page",
    "study.page_films.MAX_CELLS": NOT_INPUT + "films of a page",
    "study.page_films.MOST": NOT_INPUT + "films of a page",
    "study.run.MAX_ANSWER": "study/test_study_run.py",
    "study.run.MAX_DEATHS": "study/test_study_run.py",
    "study.run.MAX_DOUBTS": NOT_INPUT + "answers of workers, study/test_study_lies.py",
    "study.site.MAX_TICKS": NOT_INPUT + "tracks drawn ahead of a drive",
    "study.store_file.MAX_VALUE": HERE,
    "study.store_row.MOST": "study/test_study_store_damage.py",
    "study.where.MAX_WORKERS": HERE,
    "study.who.MAX_WHO": HERE,
    "study.worlds.MAX_ALL_CELLS": "study/test_study_file.py",
    "study.worlds.MAX_WORLDS": "study/test_study_file.py",
    "swarm.glowworm.MOST": HERE,
    "swarm.particle.MOST": HERE,
    "motion.lattice.MAX_WORDS": NOT_INPUT + "memory of a search, tests/test_memory.py",
    "planners._incremental_search.LIMIT": NOT_INPUT + "a number of 64 bits",
    "planners._incremental_search._MOST_BIAS": NOT_INPUT + "a number of 64 bits",
    "planners._timed_search.MOST_STATES": NOT_INPUT + "memory of a search, tests/test_memory.py",
    "planners._timed_session.MOST_UNROLLED": NOT_INPUT + "ticks of tracks written out",
    "planners.expanded.MOST_CELLS": NOT_INPUT + "maps up to which a page draws what was expanded",
    "app.asking.MAX_JSON": "app/test_app_limits.py",
    "app.asking.MOST_VALUES": "app/test_app_limits.py",
    "app.compared.MOST_SEEDS": "app/test_app_limits.py",
    "app.compared.MOST_WHO": "app/test_app_limits.py",
    "app.decode.MAX_BYTES": "app/test_app_limits.py",
    "app.decode.MAX_FILES": "app/test_app_limits.py",
    "app.engine.MAX_QUESTION": "app/test_app_limits.py",
    "app.guard.MAX_HEAD": "app/test_app_limits.py",
    "app.guard.MAX_HEADERS": "app/test_app_limits.py",
    "app.guard.MAX_URL": "app/test_app_limits.py",
    "app.library.MOST_BYTES": "app/test_app_limits.py",
    "app.library.MOST_FILES": "app/test_app_limits.py",
    "app.names.MOST": "app/test_app_limits.py",
    "app.said.MOST_SIDE": "app/test_app_limits.py",
    "app.studying.MOST_QUERIES": "app/test_app_limits.py",
    "app.studying.MOST_RUNS": "app/test_app_limits.py",
    "app.studying.MOST_SEEDS": "app/test_app_limits.py",
    "app.guard.MAX_BODY": "app/test_app_http.py",
    "app.guard.LARGE_AT_ONCE": "app/test_threats_bombs.py",
    "app.decode.AT_ONCE": "app/test_app_decode.py",
    "app.engines.QUEUE": "app/test_app_engine.py",
    "app.studies.MOST_WAITING": "app/test_app_studies.py",
    "app.decode.MAX_ANSWER": NOT_INPUT + "what our own reader of maps says of them",
    "app.engines.MAX_FRAME": NOT_INPUT + "what our own engine says, app/test_app_engine.py",
    "app.guard.MAX_DRAIN": NOT_INPUT + "what is still read of a refused body, app/test_app_http.py",
    "app.studies.MAX_LINE": NOT_INPUT + "what our own study says of how far it is",
    "app.studies.MOST": NOT_INPUT + "studies that are over and still known",
    "app.watched.MOST_TICKS": NOT_INPUT + "ticks of one frame; a drive has as many frames as it takes",
    "field.frame._SCRATCH_BYTES": NOT_INPUT + "memory of a sweep, tests/test_memory.py",
    "maps.csv_table.GREATEST": LIMITS_PY,
    "maps.load.HEAD_BYTES": LIMITS_PY,
    "maps.movingai.HEADER_BYTES": LIMITS_PY,
    "maps.numpy_file.HEADER_BYTES": LIMITS_PY,
    "maps.pgm.HEADER_BYTES": LIMITS_PY,
    "maps.way_file.YAML_BYTES": HERE,
    "maps.way_file.YAML_VALUES": HERE,
    "model.robot.GREATEST": LIMITS_PY,
    "maps.document.BYTES_PER_CELL": LIMITS_PY,
    "planners.swarm_encoding.LONGEST": NOT_INPUT + "cells of a leg that a swarm draws",
    "study.tracks.AT_ONCE": NOT_INPUT + "ticks advanced in one go",
    "referee.apart._AT_ONCE": NOT_INPUT + "pairs looked at in one go",
    "motion.curve.LONGEST_STEP": NOT_INPUT + "a length of the curve, not of what is given",
    "app.watched.MOST_PATH": NOT_INPUT + "cells of a patrol's path that the page draws",
    "app.asking.MOST_WHOLE": "app/test_app_forms.py",
}


NO_LIMITS = {
    "kernels.any_angle.LIMIT", "kernels.bidirectional.LIMIT", "kernels.incremental.LIMIT",
   "kernels.jps.LIMIT",    "kernels.search.LIMIT", "kernels.timed.LIMIT",
    "kernels.pace.OF_LIMIT", "kernels.pace.OF_WAITING", "kernels.pace.V_MAX", "planners.ad_gso_walk.NO_LIMIT",
    "maps.scenario_file._LIMIT", "study.form._LIMIT", "app.guard.BYTES", "maps.load.VALUES",
    "field.frame.WEIGHS_MOST",
}  # fmt: skip
"""So called and no limits: endings, columns of a table, words, types."""
WORDS = "MAX|MOST|LIMIT|BYTES|VALUES|GREATEST|LONGEST|LARGEST|DEEPEST|WAITING|QUEUE|AT_ONCE"
CALLED = re.compile(rf"_?([A-Z0-9]+_)*({WORDS})(_[A-Z0-9_]+)?")
"""A name one of whose words says that there is an end to something."""


def named_in(text: str) -> set[str]:
    """Constants of a module that are called a limit."""
    found = set()
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            every = [one for top in targets for one in ast.walk(top) if isinstance(one, ast.Name)]
            names = [one.id for one in every if isinstance(one.ctx, ast.Store)]
            found |= {name for name in names if CALLED.fullmatch(name)}
    return found


def named_limits() -> set[str]:
    """Of all modules; those of the checks are their own measures."""
    found = set()
    for path in SOURCE.rglob("*.py"):
        module = ".".join(path.relative_to(SOURCE).with_suffix("").parts)
        if not module.startswith("selfcheck."):
            found |= {f"{module}.{name}" for name in named_in(path.read_text(encoding="utf-8"))}
    return found


@pytest.mark.parametrize(
    "line",
    [
        "MAX_A = 1", "A_BYTES = 1", "MOST_A: Final = 1", "LEAST, GREATEST = 1, 2", "_LIMIT = 1", "MAX_2 = 1",
        "_MOST_A_B: int = 2", "LARGE_AT_ONCE = 2",
    ],
)  # fmt: skip
def test_the_census_sees_a_limit_by_any_of_its_words(line: str) -> None:
    assert len(named_in(line)) == 1


def test_the_census_sees_no_other_names() -> None:
    assert not named_in("MAXIMAL = 1\nmost = 1\nALMOST_A = 2\nLEAST = 1\ndef f():\n    MAX_A = 1")


def test_each_limit_is_asked_somewhere() -> None:
    found = named_limits() - NO_LIMITS
    assert found == set(ASKED), f"say where {found ^ set(ASKED)} is asked at n - 1, n and n + 1"
    for name, where in ASKED.items():
        assert where.startswith(NOT_INPUT) or (TESTS / where).is_file(), name
