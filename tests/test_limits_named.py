"""The limits of studies, scenarios, edits, planners and swarms on both sides; and the census of all limits.

Anyone who adds a constant that is called a limit has to say here where it is asked at n - 1, n and n + 1, or
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
from lampyris._core.settings import settings_of
from lampyris.errors import MAX_PART, FileError, LampyrisError
from lampyris.io import fleet_files
from lampyris.io import paths as way_file
from lampyris.io.fleet_files import read_agents
from lampyris.io.maps.formats import ros_yaml
from lampyris.io.maps.load import load_map
from lampyris.io.paths import read_path_points
from lampyris.io.scenario import schema_types
from lampyris.io.scenario.schema import MAX_SIDE
from lampyris.io.text import strict_json
from lampyris.io.text.strict_json import read_json
from lampyris.model.edit import MAX_EDITS, Edit, check_edits
from lampyris.model.grid import MAX_TERRAIN, Grid
from lampyris.model.settings.simulation import MAX_TICKS
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.spacetime import session as _timed_session
from lampyris.planning.swarm.optimisers import glowworm, particle
from lampyris.scenarios import load_scenario
from lampyris.study.design import config as who
from lampyris.study.design import schema as form
from lampyris.study.design import study_file, study_map, study_size
from lampyris.study.design.row import Row
from lampyris.study.design.study_file import load_study
from lampyris.study.execution.execution import MAX_WORKERS, Execution
from lampyris.study.store import file as store_file
from lampyris.study.store.store import Store
from lampyris_selfcheck.checks.files import fuzz_study
from lampyris_selfcheck.reference.files.map_files import put
from sizes import some

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
    made = study_map.pack(Grid([[False]]))
    return study_map.unpack({**made, "name": "x" * n})


def count(n: int, many: int) -> list[dict[str, Any]]:
    """Crowds of n different counts, in entries of so many."""
    counts = list(range(n))
    return [{"kind": "crossing", "grid": {"count": counts[k : k + many]}} for k in range(0, n, many)]


def most(name: str) -> int:
    """The greatest value of a setting of AD-GSO, as it is declared."""
    return int(settings_of(AdGso)[name].high)


LIMITS: dict[str, tuple[int, Ask, str]] = {
    "edits": (MAX_EDITS, lambda f, n: check_edits(Grid([[False]]), [Edit(k) for k in range(n)]), "LIMIT"),
    "edits of a scenario": (
        MAX_EDITS,
        lambda f, n: scenario(simulate={}, edits=[{"tick": k} for k in range(n)])(f),
        "LIMIT",
    ),
    "ticks of a scenario": (MAX_TICKS, lambda f, n: scenario(simulate={"ticks": n})(f), "TICKS"),
    "patience of a scenario": (
        MAX_TICKS,
        lambda f, n: scenario(simulate={"patience": n})(f),
        "PATIENCE",
    ),
    "words of a setting": (
        schema_types.MAX_TEXT,
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
    "traffic cases of a study": (form.MAX_ENTRIES, lambda f, n: study(traffic=["none"] * n)(f), "TRAFFIC"),
    "planners that a grid unfolds to": (
        who.MAX_CONFIGS,
        lambda f, n: study(planners=[grid_of(n)])(f),
        "LIMIT",
    ),
    "traffic cases that grids unfold to": (
        who.MAX_CONFIGS,
        lambda f, n: study(traffic=count(n, 1000))(f),
        "LIMIT",
    ),
    "drawn queries": (
        form.MAX_QUERIES,
        lambda f, n: study(maps=[drawn(n)])(f),
        "LIMIT",
    ),
    "listed queries": (form.MAX_QUERIES, listed, "QUERIES"),
    "seeds of a study": (form.MAX_SEEDS, lambda f, n: study(seeds=n)(f), "LIMIT"),
    "words about a study": (form.MAX_ABOUT, lambda f, n: study(about="x" * n)(f), "JSON_TEXT"),
    "runs of a study": (
        study_size.MAX_JOBS // 1000,
        lambda f, n: study(seeds=n, planners=[grid_of(1000)], maps=[drawn(1)])(f),
        "LIMIT",
    ),
    "ticks of a study": (MAX_TICKS, lambda f, n: study(ticks=n)(f), "TICKS"),
    "name of a packed map": (study_map.MAX_NAME, packed_map, "PACKED_MAP"),
    "workers": (MAX_WORKERS, lambda f, n: Execution(workers=n), "WORKERS"),
    "nt": (most("nt"), lambda f, n: AdGso(nt=n), "NT"),
    "mvr": (most("mvr"), lambda f, n: AdGso(mvr=n), "MVR"),
    "window": (most("window"), lambda f, n: AdGso(window=n), "WINDOW"),
    "horizon": (_timed_session.MAX_HORIZON, lambda f, n: _timed_session.Timed(horizon=n), "HORIZON"),
    "glowworms": (glowworm.MOST, lambda f, n: glowworm.GSO(n=n), "SWARM"),
    "particles": (particle.MOST, lambda f, n: particle.PSO(n=n), "SWARM"),
    "terrain": (MAX_TERRAIN, lambda f, n: Grid([[False]], terrain=[[n]]), "GRID_TERRAIN"),
    "way in YAML": (
        way_file.YAML_BYTES,
        lambda f, n: read_path_points(put(f, b"poses: []\n".ljust(n, b"#"), "w.yaml")),
        "YAML_SIZE",
    ),
    "values of a way in YAML": (
        way_file.YAML_VALUES,
        lambda f, n: read_path_points(put(f, b"poses: [" + b"0," * (n - 2) + b"]\n", "w.yaml")),
        "YAML_SIZE",
    ),
    "agents in YAML": (
        fleet_files.YAML_BYTES,
        lambda f, n: read_agents(put(f, b"agents: []\n".ljust(n, b"#"), "a.yaml"), Grid([[False]])),
        "YAML_SIZE",
    ),
    "values of agents in YAML": (
        fleet_files.YAML_VALUES,
        lambda f, n: read_agents(put(f, b"agents: [" + b"0," * (n - 2) + b"]\n", "a.yaml"), Grid([[False]])),
        "YAML_SIZE",
    ),
    "values of JSON": (
        strict_json.MAX_VALUES,
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


LONG = {
    "agents in YAML", "listed queries", "values of JSON", "values of a way in YAML", "values of agents in YAML",
    "planners that a grid unfolds to",
}  # fmt: skip
"""For the night: files of a million values, and thousands of planners."""


@pytest.mark.commit(9)
@pytest.mark.parametrize("what", some(sorted(LIMITS, key=LONG.__contains__), len(LIMITS) - len(LONG)))
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
    path.write_bytes(fuzz_study.stores().seeds[1])
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
    "cli.verbs.compare.command.MAX_RUNS": "cli/test_cli_compare.py",
    "_core.scalars.MOST_WHOLE": "test_bad_arguments.py",
    "errors.MAX_DIGITS": "test_bad_arguments.py",
    "errors.MAX_PART": HERE,
    "errors.MAX_SHOWN": "test_bad_arguments.py",
    "planning.field.frame.MOST": NOT_INPUT
    + "as many cells as a number of 32 bits tells apart; maps are smaller",
    "io.scenario.build.MAX_COVERED": "sim/test_sim_polygons.py",
    "io.text.csv_table.MAX_BYTES": LIMITS_PY,
    "io.text.csv_table.MAX_LINE": LIMITS_PY,
    "io.text.csv_table.MAX_LINES": LIMITS_PY,
    "io.tracks.dob.MAX_WORDS": LIMITS_PY,
    "io.maps.formats.png.MAX_CHUNKS": LIMITS_PY,
    "io.maps.formats.png.MAX_TEXT": LIMITS_PY,
    "io.text.strict_json.MAX_BYTES": LIMITS_PY,
    "io.text.strict_json.MAX_DEPTH": LIMITS_PY,
    "io.text.strict_json.MAX_DIGITS": LIMITS_PY,
    "io.text.strict_json.MAX_VALUES": HERE,
    "_core.limits.MAX_CELLS": LIMITS_PY,
    "io.maps.formats.movingai.MAX_SCEN_BYTES": LIMITS_PY,
    "io.maps.formats.movingai.MAX_SCEN_LINES": LIMITS_PY,
    "io.maps.formats.ros_yaml.MAX_ORIGIN": HERE,
    "_core.scalars.MAX_SEED": LIMITS_PY,
    "io.scenario.validation_errors.MOST": NOT_INPUT + "mistakes told whole",
    "io.scenario.schema.MAX_SIDE": HERE,
    "io.scenario.schema_types.MAX_TEXT": HERE,
    "model.settings.simulation.MAX_TICKS": HERE,
    "io.tracks.csv_tracks.MAX_TICKS": LIMITS_PY,
    "io.paths.MAX_POINTS": LIMITS_PY,
    "io.text.strict_yaml.MAX_BYTES": LIMITS_PY,
    "io.text.strict_yaml.MAX_DEPTH": LIMITS_PY,
    "io.text.strict_yaml.MAX_DIGITS": LIMITS_PY,
    "io.text.strict_yaml.MAX_VALUES": LIMITS_PY,
    "model.settings.episodes.MAX_PATCH": "rl/test_environments.py",
    "sim.episodes.tasks.MAX_GOALS": "rl/test_environments.py",
    "sim.episodes.tasks.MAX_EPISODES": "rl/test_environments.py",
    "rl.robots.MAX_ROBOTS": "rl/test_environments.py",
    "tuning.tune.MAX_TRIALS": "tuning/test_tune.py",
    "notebook.frames.MOST_FRAMES": NOT_INPUT + "frames of a widget",
    "uncertainty.expansion.MOST_INPUTS": "uncertainty/test_expansion.py",
    "uncertainty.expansion.MOST_WORKERS": "uncertainty/test_expansion.py",
    "travel_time.fastest_time._BYTES": NOT_INPUT + "memory of a state, counted by demand_states",
    "io.photos.jpeg.MAX_SCANS": "photos/test_photo_files.py",
    "io.photos.jpeg.MAX_SEGMENTS": "photos/test_photo_files.py",
    "model.chain.chain.MOST_LINKS": "chain/test_chain.py",
    "model.chain.chain.MOST_METRES": "chain/test_chain.py",
    "model.chain.chain.MOST_TURN": "chain/test_chain.py",
    "model.robot.MOST_VERTICES": "lattice/test_robot_files.py",
    "planning.lattice.lattice.MOST_LENGTH": "lattice/test_primitive_files.py",
    "planning.lattice.lattice.MOST_REACH": "lattice/test_robot_files.py",
    "motion.geometry.shortest_curve._MOST_POSES": "motion/test_shortest_curves.py",
    "model.edit.MAX_EDITED": "model/test_edit.py",
    "model.edit.MAX_EDITS": HERE,
    "model.grid.MAX_TERRAIN": HERE,
    "model.lattice.motion_primitives.MAX_HEADINGS": "lattice/test_primitive_files.py",
    "model.lattice.motion_primitives.MAX_MOTIONS": "lattice/test_primitive_files.py",
    "model.lattice.motion_primitives.MAX_POSES": "lattice/test_primitive_files.py",
    "model.lattice.motion_primitives.MAX_STEP": "lattice/test_primitive_files.py",
    "model.lattice.motion_primitives.MAX_TURN": "lattice/test_primitive_files.py",
    "io.primitives.mprim._MOST_WORDS": "lattice/test_primitive_files.py",
    "model.scene.MAX_RADIUS": LIMITS_PY,
    "model.scene.MAX_VIA": "planning/test_via_points.py",
    "model.traffic.MAX_OBSTACLES": LIMITS_PY,
    "planning.spacetime.session.MAX_HORIZON": HERE,
    "report.film.simulation_film.MAX_FRAMES": "report/test_report_film.py",
    "model.settings.drive.MAX_PASSED": "sim/test_sim_drive.py",
    "model.settings.sensor.MOST_UNSEEN": "sim/test_sim_unknown_map.py",
    "sim.continuous.sight.MOST_SPACING": "sim/test_sim_drive_sensor.py",
    "sim.sensor._MOST": "sim/test_sim_feed.py",
    "study.execution.batches.MAX_JOBS": NOT_INPUT + "jobs of a batch",
    "study.analysis.compare.MAX_DRAWN": "study/test_study_compare.py",
    "study.analysis.compare.MAX_EXACT": "study/test_study_compare.py",
    "study.execution.evidence.MAX_BYTES": "study/test_study_evidence.py",
    "study.execution.evidence.MAX_NOTE": "study/test_study_otherwise.py",
    "study.execution.evidence.MAX_NOTES": "study/test_study_otherwise.py",
    "study.design.study_size.MAX_JOBS": HERE,
    "study.design.schema.MAX_ROBOTS": "study/test_study_fleets.py",
    "io.fleet_scenario.schema.MAX_ROBOTS": "fleet/test_fleet_scenario.py",
    "io.fleet_scenario.scenario.MAX_ITERATIONS": "fleet/test_fleet_scenario.py",
    "io.fleet_scenario.scenario.MAX_TIME": "fleet/test_fleet_scenario.py",
    "report.data.fleets.measures.MOST_IMPROVEMENTS": NOT_INPUT + "costs of a row",
    "study.page.fleet_figures.MAX_LINES": NOT_INPUT + "curves of a figure",
    "study.design.schema.MAX_ABOUT": HERE,
    "study.design.schema.MAX_ENTRIES": HERE,
    "study.design.schema.MAX_QUERIES": HERE,
    "study.design.schema.MAX_SEEDS": HERE,
    "study.design.study_map.MAX_NAME": HERE,
    "study.execution.verify.MAX_WORDS": "study/test_study_judge.py",
    "study.execution.worker.MAX_WORDS": "study/test_study_one.py",
    "study.page.figures.MAX_LINES": NOT_INPUT + "curves of a figure",
    "study.page.figures.MAX_ROWS": NOT_INPUT + "rows of a figure",
    "study.page.figures.MAX_RUNS": NOT_INPUT + "bars of a figure",
    "study.page.films.MAX_BYTES": NOT_INPUT + "films of a page",
    "study.page.films.MAX_CELLS": NOT_INPUT + "films of a page",
    "study.page.films.MOST": NOT_INPUT + "films of a page",
    "study.execution.run.MAX_ANSWER": "study/test_study_run.py",
    "study.execution.run.MAX_DEATHS": "study/test_study_run.py",
    "study.execution.run.MAX_DOUBTS": NOT_INPUT + "answers of workers, study/test_study_lies.py",
    "study.execution.site.MAX_TICKS": NOT_INPUT + "tracks drawn ahead of a drive",
    "study.store.file.MAX_VALUE": HERE,
    "study.store.row_record.MOST": "study/test_study_store_damage.py",
    "study.execution.execution.MAX_WORKERS": HERE,
    "study.design.config.MAX_CONFIGS": HERE,
    "study.design.worlds.MAX_ALL_CELLS": "study/test_study_file.py",
    "study.design.worlds.MAX_WORLDS": "study/test_study_file.py",
    "io.source_files.MAX_BYTES": "swarm_robots/test_source_files.py",
    "io.source_files.MAX_VALUES": "swarm_robots/test_source_files.py",
    "model.swarm.sources.MAX_ROUTE": "swarm_robots/test_sources.py",
    "model.settings.swarm.MAX_SMALL_STEPS": "swarm_robots/test_swarm_robots.py",
    "swarms.MAX_ROBOTS": "swarm_robots/test_swarm_robots.py",
    "swarms.MAX_SOURCES": "swarm_robots/test_swarm_robots.py",
    "referee.fleets.swarm._AT_ONCE": NOT_INPUT + "places looked at in one go",
    "referee.fleets.swarm_hearing._AT_ONCE": NOT_INPUT + "pairs looked at in one go",
    "planning.swarm.optimisers.glowworm.MOST": HERE,
    "planning.swarm.optimisers.particle.MOST": HERE,
    "planning.lattice.guided.open_space._LARGEST": NOT_INPUT + "size of a table",
    "motion.timing.spacetime_lattice.MAX_WORDS": NOT_INPUT + "memory of a search, tests/test_memory.py",
    "planning.incremental.search.LIMIT": NOT_INPUT + "a number of 64 bits",
    "planning.incremental.search._MOST_BIAS": NOT_INPUT + "a number of 64 bits",
    "planning.spacetime.search.MOST_STATES": NOT_INPUT + "memory of a search, tests/test_memory.py",
    "planning.spacetime.intercept.MOST_BYTES": NOT_INPUT + "memory of a search",
    "planning.spacetime.session.MOST_UNROLLED": NOT_INPUT + "ticks of tracks written out",
    "planning.adgso.next_steps.MOST_KNOWN": NOT_INPUT
    + "jumps that are remembered; cells that share a place take turns",
    "planning.graph.expanded.MOST_NS": NOT_INPUT + "time of a search that is recorded",
    "races.race.MOST_CALLS": NOT_INPUT + "planning calls that are timed",
    "model.race.race.MOST_RACERS": "app/test_app_race.py",
    "planning.graph.expanded.MOST_POSES": NOT_INPUT + "poses up to which a search is recorded",
    "planning.registry.LONGEST_TITLE": NOT_INPUT + "a longer beginning of a summary is no title",
    "planning.graph.expanded.MOST_CELLS": NOT_INPUT + "maps up to which a page draws what was expanded",
    "app.server.request_parsing.MAX_JSON": "app/test_app_limits.py",
    "app.server.request_parsing.MOST_VALUES": "app/test_app_limits.py",
    "app.engine.comparison.MOST_SEEDS": "app/test_app_limits.py",
    "app.engine.comparison.MOST_CONFIGS": "app/test_app_limits.py",
    "app.engine.decode.MAX_BYTES": "app/test_app_limits.py",
    "app.engine.decode.MAX_FILES": "app/test_app_limits.py",
    "app.engine.engine.MAX_QUESTION": "app/test_app_limits.py",
    "app.server.library.MOST_BYTES": "app/test_app_limits.py",
    "app.server.library.MOST_FILES": "app/test_app_limits.py",
    "app.engine.driving.MOST_PLACES": NOT_INPUT
    + "places of a drive that are sent, which are farther apart beyond that",
    "app.engine.driving.MOST_POSES": "app/test_app_drives.py",
    "app.engine.fleets.fleet.MOST_PLACES": "app/test_app_fleets.py",
    "app.engine.fleets.fleet.MOST_ROBOTS": "app/test_app_fleets.py",
    "app.engine.fleets.fleet.MOST_SECONDS": "app/test_app_fleets.py",
    "app.engine.fleets.swarm.MOST_PLACES": "app/test_app_fleets.py",
    "app.engine.names.MOST": "app/test_app_limits.py",
    "app.engine.parse.MOST_SIDE": "app/test_app_limits.py",
    "app.engine.study_process.MOST_QUERIES": "app/test_app_limits.py",
    "app.engine.study_process.MOST_RUNS": "app/test_app_limits.py",
    "app.engine.study_process.MOST_SEEDS": "app/test_app_limits.py",
    "app.server.guard.MAX_BODY": "app/test_app_http.py",
    "app.server.guard.LARGE_AT_ONCE": "app/test_threats_bombs.py",
    "app.engine.decode.AT_ONCE": "app/test_app_decode.py",
    "app.server.engines.QUEUE": "app/test_app_engine.py",
    "app.server.studies.MOST_WAITING": "app/test_app_studies.py",
    "app.engine.decode.MAX_ANSWER": NOT_INPUT + "what our own reader of maps says of them",
    "app.server.engines.MAX_FRAME": NOT_INPUT + "what our own engine says, app/test_app_engine.py",
    "app.server.listening.MAX_HEAD": "app/test_app_http.py",
    "app.server.guard.MAX_DRAIN": NOT_INPUT + "what is still read of a refused body, app/test_app_http.py",
    "app.server.studies.MAX_LINE": NOT_INPUT + "what our own study says of how far it is",
    "app.server.studies.MOST": NOT_INPUT + "studies that are over and still known",
    "app.engine.simulation.MOST_TICKS": NOT_INPUT
    + "ticks of one frame; a drive has as many frames as it takes",
    "planning.field.frame._SCRATCH_BYTES": NOT_INPUT + "memory of a sweep, tests/test_memory.py",
    "planning.lattice.state_memory.KEPT_BYTES": NOT_INPUT
    + "memory kept between sessions, tests/lattice/test_state_memory.py",
    "io.text.csv_table.GREATEST": LIMITS_PY,
    "io.maps.formats.table.HEAD_BYTES": LIMITS_PY,
    "io.maps.formats.movingai.HEADER_BYTES": LIMITS_PY,
    "io.maps.formats.npy.HEADER_BYTES": LIMITS_PY,
    "io.maps.formats.pgm.HEADER_BYTES": LIMITS_PY,
    "model.fleet.fleet.MOST_RADIUS": "fleet/test_fleet_files.py",
    "model.fleet.lifelong.MAX_RELEASE": "fleet_drives/test_lifelong.py",
    "model.fleet.lifelong.MAX_WINDOW": "fleet_drives/test_lifelong.py",
    "referee.fleets.fleet_trace._AT_ONCE": NOT_INPUT + "places that are worked out in one go",
    "io.fleet_files.YAML_BYTES": HERE,
    "io.fleet_files.YAML_VALUES": HERE,
    "io.league_files.MAX_BYTES": "fleet/test_league_files.py",
    "io.league_files.MAX_LINES": "fleet/test_league_files.py",
    "io.paths.YAML_BYTES": HERE,
    "io.paths.YAML_VALUES": HERE,
    "model.robot.GREATEST": LIMITS_PY,
    "io.maps.formats.document.BYTES_PER_CELL": LIMITS_PY,
    "planning.swarm.encoding.LONGEST": NOT_INPUT + "cells of a leg that a swarm draws",
    "study.execution.obstacle_tracks.AT_ONCE": NOT_INPUT + "ticks advanced in one go",
    "referee.geometry.separation._AT_ONCE": NOT_INPUT + "pairs looked at in one go",
    "referee.geometry.moving_polygons._AT_ONCE": NOT_INPUT + "vertices and edges looked at in one go",
    "motion.geometry.curve.LONGEST_STEP": NOT_INPUT + "a length of the curve, not of what is given",
    "app.engine.simulation.MOST_PATH": NOT_INPUT + "cells of a patrol's path that the page draws",
    "app.server.request_parsing.MOST_WHOLE": "app/test_app_forms.py",
}


NO_LIMITS = {
    "_core.defaults.MAX_AGE",
    "_core.defaults.VALUES",
    "_core.noun.MAX_REPR",
    "planning.map_models.visibility_search.LONGEST",
    "kernels.lattice.search.LIMIT", "kernels.lattice.search.WAITING", "kernels.lattice.low_field.WAITING",
    "kernels.lattice.goal_costs.WAITING", "kernels.lattice.timed_search.LIMIT", "kernels.lattice.timed_search.WAITING",
    "kernels.fleet_motion.execution.LIMIT", "kernels.fleet_motion.execution.V_MAX", "kernels.fleet_motion.execution.A_MAX",
    "kernels.fleet_motion.execution.D_MAX", "kernels.fleet_motion.orca.LIMIT",
    "kernels.fleet.lacam.LIMIT", "kernels.fleet.pibt.LIMIT", "kernels.fleet.space_time.AT_MOST",
    "kernels.hybrid.search.LIMIT", "kernels.hybrid.search.WAITING",
    "kernels.map_models.polyanya.LIMIT", "kernels.map_models.quadtree.LIMIT", "kernels.map_models.visibility.LIMIT",
    "kernels.graph.any_angle.LIMIT", "kernels.graph.bidirectional.LIMIT", "kernels.incremental.queue.LIMIT",
   "kernels.graph.jps.LIMIT",    "kernels.graph.search.LIMIT", "kernels.spacetime.timed_search.LIMIT",
    "kernels.adgso.tick_speed.OF_LIMIT", "kernels.adgso.tick_speed.OF_WAITING",
    "kernels.adgso.tick_speed.V_MAX", "planning.adgso.walk.NO_LIMIT",
    # Places in a kernel's state and law; what one that stands may do longest; above it plans are made the longer way.
    "kernels.simulation.ticks.WAITING", "kernels.simulation.tick_speed.V_MAX", "kernels.simulation.tick_speed.A_MAX",
    "kernels.simulation.tick_speed.D_MAX", "planning.spacetime.live_search.MOST_STAYS",
    "planning.spacetime.live_search.MOST_CELLS", "planning.spacetime.interval_table.MOST_TICK",
    # Likewise; above the last three drives run in Python.
    *(f"kernels.simulation.drive_obstacles.{name}" for name in ("A_MAX", "D_MAX", "V_MAX", "TIME_LIMIT", "QUEUE")),
    "kernels.simulation.drive.OF_LIMIT",
    *(f"sim.continuous.compiled_periods.{name}" for name in ("MOST_POINTS", "MOST_WIDE", "MOST_WORK")),
    "io.scenario.schema._LIMIT", "study.design.schema._LIMIT", "app.server.request_parsing.BYTES", "io.maps.load.VALUES",
    "planning.field.frame.WEIGHS_MOST",
}  # fmt: skip
"""So called and no limits: endings, columns of a table, words, types."""
WORDS = "MAX|MOST|LIMIT|BYTES|VALUES|GREATEST|LONGEST|LARGEST|DEEPEST|WAITING|QUEUE|AT_ONCE"
CALLED = re.compile(rf"_?([A-Z0-9]+_)*({WORDS})(_[A-Z0-9_]+)?")
"""A name one of whose words says that there is an end to something."""


def named_in(text: str) -> set[str]:
    """Constants of a module that are called a limit."""
    found: set[str] = set()
    if not re.search(WORDS, text):
        return found
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
