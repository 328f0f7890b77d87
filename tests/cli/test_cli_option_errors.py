"""A bad value on the command line is exit code 2 anyone who finds it, and the message names the option."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
import typer.main

from bad_inputs.case import inside, run, warm
from lampyris.cli.app import app
from lampyris.cli.option_errors import as_typed
from lampyris.errors import LampyrisError, LimitError, SettingError, UnknownSettingError
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from sizes import some

MAIN = "from lampyris.cli import main; main()"
TREE: Any = typer.main.get_command(app)
CALLS: dict[str, tuple[str, ...]] = {
    "plan": ("guide",),
    "simulate": ("guide",),
    "speed": ("guide",),
    "drive": ("guide",),
    "compare": ("guide", "--obstacles", "2", "--live"),
    "fleet": ("guide", "--robots", "2"),
    "movingai": ("q.scen",),
    "run": ("s.yaml",),
    "selfcheck": ("grids",),
    "reproduce": ("--quick", "--out", "new"),
    "app": ("--no-browser",),
    "swarm": ("guide", "--robots", "3", "--iterations", "2"),
    "primitives": ("--out", "p.json", "--resolution", "0.1"),
    "warm": (),
    "ros": ("--seconds", "1"),
    "bag": ("b.mcap",),
    "uncertain": ("guide", "--vary", "v_max=0.8:1.2"),
    "chain": ("open",),
    "tune": ("t.yaml",),
}
"""A valid call of each verb that has options with numbers."""
NEEDS = {
    ("bag", "--obstacle-radius"): ("--track", "people.csv"),
    ("speed", "--tick"): ("--track", "t.csv"),
    ("simulate", "--field-of-view"): ("--sensor-range", "3"),
    ("swarm", "--source-count"): ("--sources", "drawn"),
    ("speed", "--spacing"): ("--smooth", "straight"),
    ("speed", "--obstacle-radius"): ("--track", "t.csv"),
    ("fleet", "--window"): ("--lifelong", "5"),
    ("fleet", "--delay-duration"): ("--execute", "--delays", "0.1"),
    ("fleet", "--obstacle-radius"): ("--execute", "--obstacles", "1"),
    ("fleet", "--obstacle-speed"): ("--execute", "--obstacles", "1"),
    **{
        ("fleet", f"--{name}"): ("--execute",)
        for name in (
            "delays",
            "obstacles",
            "drive-limit",
            "radius",
            "v-max",
            "a-max",
            "d-max",
            "yaw-rate-max",
        )
    },
}
"""What an option has to stand beside."""


HUGE, LONGER = "9" * 400, "9" * 5000


def verbs() -> list[tuple[str, Any]]:
    """Every verb and its command, those of other packages included."""
    context: Any = type(TREE).make_context(TREE, "lampyris", ["planners"], resilient_parsing=True)
    return [(name, TREE.get_command(context, name)) for name in TREE.list_commands(context)]


def numeric() -> list[tuple[str, str, str]]:
    """Every option that takes a number: verb, option, and a value that is out of range everywhere."""
    bad = {"float": "nan", "int": "-1", "integer": "-1"}
    return [
        (verb, parameter.opts[0], bad[kind])
        for verb, command in verbs()
        for parameter in command.params
        if (kind := parameter.type.name.partition(" ")[0]) in bad
    ]


def prepare(folder: Path) -> None:
    (folder / "t.csv").write_text("x,y\n0,0\n")
    (folder / "s.yaml").write_text("version: 1\nmap: {bundled: guide}\n")
    (folder / "t.yaml").write_text("version: 1\nkind: plan\nmaps: [guide]\nplanners: [ad-gso]\n")
    (folder / "q.map").write_text("type octile\nheight 2\nwidth 2\nmap\n..\n..\n")
    (folder / "q.scen").write_text("version 1\n0\tq.map\t2\t2\t0\t0\t1\t0\t1.0\n")


@pytest.mark.commit(40)
@pytest.mark.parametrize(("verb", "option", "value"), numeric())
def test_a_number_out_of_range_is_exit_2_and_names_the_option(
    tmp_path: Path, verb: str, option: str, value: str
) -> None:
    warm()
    prepare(tmp_path)
    with inside(tmp_path):
        done = run(verb, *CALLS[verb], *NEEDS.get((verb, option), ()), option, value)
        text = run(verb, *CALLS[verb], *NEEDS.get((verb, option), ()), option, "x")
    assert done.exit == 2, (done.exit, done.err)
    assert f"]: {option}: {value}" in done.err, done.err
    assert (text.exit, done.out, text.out) == (2, "", "")
    assert f"error[TYPE]: {option}: 'x'; allowed: " in text.err
    for outcome in (done, text):
        assert len(outcome.err.splitlines()) == 1, outcome.err


def test_every_verb_with_numbers_is_tried() -> None:
    assert {verb for verb, *_ in numeric()} == set(CALLS)
    assert len(numeric()) > 90


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("plan", "guide", "--set", "nt=0"), "error[NT]: --set nt: 0; allowed: "),
        (("plan", "guide", "--set", "nq=1"), "error[SETTING]: --set: ad-gso has no setting 'nq'"),
        (("plan", "guide", "--set-law", "blind.reach=-1"), "error[LAW_SETTING]: --set-law blind.reach: "),
        (("maps", "make", "maze", "-o", "m.txt", "--set", "loops=3"), "error[RECIPE]: --set loops: 3.0"),
        (("maps", "make", "maze", "-o", "m.txt", "--seed", "-1"), "error[SEED]: --seed: -1"),
        (("compare", "guide", "--planners", "gso:swarm=0"), "error[SWARM]: --planners: gso:swarm=0: "),
        (("plan", "guide", "--start-m", "99,99"), "error[START_OUTSIDE]: --start-m: "),
        (
            ("plan", "guide", "--start-m", "nan,1"),
            "error[TYPE]: --start-m: 'nan,1'; allowed: two or three finite",
        ),
        (("plan", "guide", "--robot", ""), "error[FILE]: --robot: ''; allowed: "),
        (
            ("compare", "guide", "--planners", "astar,ad-gso:nt=x"),
            "error[TYPE]: --planners: ad-gso:nt=x: 'x'",
        ),
        (
            ("simulate", "guide", "--planner", "mmas-dstar", "--set", "patience=0", "--patience", "4"),
            "error[PATIENCE]: --set patience: 0; allowed: ",
        ),
        (("plan", "guide", "--start", "99,99"), "error[START_OUTSIDE]: --start: (99, 99) is outside"),
        (("plan", "guide", "--values", "costmap"), "error[VALUES]: --values: a bundled map says itself"),
        (("plan", "guide", "--planner", "astra"), "error[PLANNER]: --planner: no planner is called 'astra'"),
        (("compare", "guide", "--planners", "astar,astar"), "error[OPTIONS]: --planners: astar twice"),
        (("simulate", "guide", "--obstacles", "90"), "error[OBSTACLE_ROOM]: --obstacles: obstacle specif"),
        (("maps", "make", "mase", "-o", "m.txt"), "error[RECIPE]: RECIPE: no recipe is called 'mase'"),
        (("maps", "make", "maze", "-o", "m.txt", "--size", "1x9"), "error[MAP_SIZE]: --size: width 1; "),
        (("plan", "guide", "--set-law", f"creep={HUGE}"), "error[TYPE]: --set-law creep: a number of 400"),
        (("plan", "guide", "--set-law", f"blind.reach=-{LONGER}"), "error[TYPE]: --set-law blind.reach: "),
        (("plan", "guide", "--set", f"rho={HUGE}"), "error[RHO]: --set rho: inf"),
        (("compare", "guide", "--laws", f"physical:creep={HUGE}"), "error[TYPE]: --laws: "),
        (("speed", "guide", "--laws", HUGE), "error[LAW]: --laws: "),
        (("plan", "guide", "--seed", HUGE), "error[SEED]: --seed: "),
        (("plan", "guide", "--seed", LONGER), "error[TYPE]: --seed: "),
        (("plan", "guide", "--v-max", HUGE), "error[ROBOT_LIMIT]: --v-max: inf"),
        (
            ("maps", "make", "maze", "-o", "m.txt", "--set", f"corridor={HUGE}"),
            "error[RECIPE]: --set corridor: ",
        ),
        (("run", "s.yaml", "--max-cells", "0"), "error[TYPE]: --max-cells: 0"),
        (("plan", "guide", "--nope"), "error[OPTION]: --nope: there is no such option"),
        (("plan", "guide", "--planer", "x"), "did you mean --planner?"),
        (("plan", "guide", "--csv"), "error[OPTION]: --csv: requires an argument"),
        (("plan", "guide", "x"), "error[USAGE]: Got unexpected extra argument"),
        (("study", "nope.yaml", "--workers", "0"), "error[TYPE]: --workers: 0"),
    ],
)
def test_one_style_for_all_that_is_wrong_with_the_words(
    tmp_path: Path, words: tuple[str, ...], says: str
) -> None:
    warm()
    prepare(tmp_path)
    with inside(tmp_path):
        done = run(*words)
    assert (done.exit, done.out) == (2, ""), done.err
    assert says in done.err
    assert len(done.err.splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (
            ("simulate", "guide", "--ticks", "0"),
            "1 to 1,000,000,000; leave the option out for the default (depends on the size of the map)",
        ),
        (("simulate", "guide", "--patience", "-1"), " ticks; leave the option out for the default (50)"),
        (("plan", "guide", "--jerk-max", "0"), " m/s3; leave the option out for the default (no limit)"),
        (("simulate", "guide", "--rate", "2"), "<= 1; leave the option out for the default (all walkers at"),
        (("simulate", "guide", "--plan-limit", "0"), "> 0; leave the option out for the default (no limit)"),
        (
            ("compare", "guide", "--obstacles", "1", "--ticks", "2000000000"),
            "]: --ticks: 2000000000; allowed: a whole",
        ),
    ],
)
def test_no_message_offers_a_value_that_the_option_refuses(words: tuple[str, ...], says: str) -> None:
    warm()
    done = run(*words)
    assert (done.exit, done.out) == (2, ""), done.err
    assert says in done.err, done.err
    assert "or none" not in done.err.lower()
    literal = run(*words[:-1], "none")
    assert (literal.exit, "error[TYPE]" in literal.err) == (2, True), literal.err


def test_a_setting_that_may_be_none_is_offered_none() -> None:
    warm()
    done = run("plan", "guide", "--set", "iter_max=0")
    assert (done.exit, ", or none (" in done.err) == (2, True), done.err


def test_a_bad_variable_of_the_environment_is_wrong_use(monkeypatch: pytest.MonkeyPatch) -> None:
    warm()
    monkeypatch.setenv("LAMPYRIS_MAX_TICKS", "x")
    done = run("simulate", "guide")
    assert (done.exit, done.out) == (2, ""), done.err
    assert (
        "error[LIMIT_VARIABLE]: LAMPYRIS_MAX_TICKS: 'x'; allowed: a whole number of ticks, 1 to" in done.err
    )


def test_a_bad_value_in_a_file_stays_exit_3(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text("version: 1\nmap: {bundled: guide}\nseed: -1\nrobot: {v_max: -1}\n")
    with inside(tmp_path):
        done = run("run", "s.yaml", "--max-cells", "1000")
    assert done.exit == 3
    assert "s.yaml:3:7: /seed: -1" in done.err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("simulate", "guide", "--obstacles", "100000"), "error[LIMIT]: --obstacles: 100000 obstacles"),
        (("plan", "guide", "--radius", "1e5"), "error[RADIUS]: --radius: robot: radius 100000 m"),
        (
            ("simulate", "guide", "--obstacles", "1", "--obstacle-radius", "1e5"),
            "error[RADIUS]: --obstacle-radius: obstacle 0: radius 100000 m",
        ),
        (
            ("maps", "make", "maze", "-o", "m.txt", "--size", "9999x9999"),
            "error[MAP_TOO_LARGE]: --size: 9999 x 9999 cells",
        ),
    ],
)
def test_a_limit_keeps_exit_5_and_names_the_option(tmp_path: Path, words: tuple[str, ...], says: str) -> None:
    with inside(tmp_path):
        done = run(*words)
    assert done.exit == 5
    assert done.err.startswith(says), done.err


def test_what_every_run_of_a_comparison_refuses_names_the_option() -> None:
    done = run("compare", "guide", "--obstacles", "90")
    assert done.exit == 2
    assert "error[OBSTACLE_ROOM]: --obstacles: obstacle specification 0: 76 of 90" in done.err


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    ("shell", "code"),
    some(
        [
            ("plan nope 2>/dev/full", 3),
            ("plan env-1 --json 2>&- 0<&-", 0),
            ("plan env-1 >/dev/full", 3),
            ("plan --help >&-", 3),
            ("plan env-1 2>&-", 0),
            ("plan nope 2>&-", 3),
            ("plan env-1 --seed x 2>/dev/full", 2),
            ("plan env-1 >&-", 3),
            ("plan env-1 >&- 2>&-", 3),
            ("--help >/dev/full", 3),
        ],
        4,
    ),
)
@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full")
def test_streams_that_are_closed_or_full(tmp_path: Path, shell: str, code: int) -> None:
    call = f'"{sys.executable}" -c "from lampyris.cli import program; program()" {shell}'
    done = subprocess.run(["sh", "-c", call], capture_output=True, cwd=tmp_path, check=False, timeout=120)
    assert done.returncode == code, done.stderr
    assert b"Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_what_is_written_to_standard_error_lands_in_no_file(tmp_path: Path) -> None:
    """With descriptor 2 closed, the next file that is opened would get its number."""
    call = f'"{sys.executable}" -c "{MAIN}" plan guide --csv p.csv --picture p.png --zones no.csv 2>&-'
    done = subprocess.run(["sh", "-c", call], capture_output=True, cwd=tmp_path, check=False, timeout=120)
    assert done.returncode == 3
    assert not list(tmp_path.iterdir())


def test_a_name_that_the_terminal_cannot_show_is_shown_otherwise(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", MAIN, "plan", "guide", "--csv", b"\xff\xc3\xa9.csv"],
        capture_output=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert list(os.listdir(os.fsencode(tmp_path))) == [b"\xff\xc3\xa9.csv"]


# ---- what the mapping rests on --------------------


class Given:
    """What click knows of a call with ``--seed`` and ``--obstacles``."""

    command = TREE.commands["simulate"]
    params: ClassVar[dict[str, Any]] = {}

    @staticmethod
    def get_parameter_source(name: str) -> Any:
        return SimpleNamespace(name="COMMANDLINE" if name in ("seed", "obstacles") else "DEFAULT")


@pytest.mark.parametrize("what", ["seed 3 of 5", "seed: odd", "5 obstacles", "it has no setting 'seed'"])
@pytest.mark.parametrize("code", ["SEED", "OBSTACLES", "TRAFFIC_COUNT"])
def test_neither_words_nor_codes_of_an_error_say_which_option_it_is_about(code: str, what: str) -> None:
    error = SettingError(code, what)
    assert as_typed(error, Given) is error
    assert as_typed(SettingError(code, what, setting="seed"), Given).where == "--seed"
    assert as_typed(LimitError(code, what, setting="traffic.count"), Given).where == "--obstacles"


@pytest.mark.parametrize("name", registry.names())
def test_each_setting_of_a_planner_is_named_by_the_error_about_it(name: str) -> None:
    for key in registry.settings_of(registry.planner_class(name)):
        with pytest.raises(LampyrisError) as caught:
            registry.make(name, {key: object()})
        assert caught.value.setting.rpartition(".")[2] == key
    with pytest.raises(UnknownSettingError) as unknown:
        registry.make(name, {"no_such": 1})
    assert unknown.value.setting == "no_such"


@pytest.mark.parametrize("name", laws.LAWS)
def test_each_setting_of_a_law_is_named_by_the_error_about_it(name: str) -> None:
    for key in laws.settings_of(name):
        with pytest.raises(SettingError) as caught:
            laws.with_settings(name, {key: object()})
        assert caught.value.setting.endswith(f".{key}")


def test_the_setting_of_an_error_outlives_the_way_between_processes() -> None:
    error = SettingError.of("RATE", "traffic.rate", "2", allowed="up to 1")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "error[RATE]: rate 2; allowed: up to 1"
    assert (again.setting, again.value) == ("traffic.rate", "2")
