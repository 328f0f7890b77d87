"""Whatever is handed to a public class or function, what comes is an answer or an error of lampyris.

``Robot(v_max=10**400)``, ``Grid(origin=...)``, ``plan(rho=...)`` and ``Budget(expansions=2**64)`` raised
OverflowError where a SettingError was promised, ``solve_field("x")`` AttributeError.
"""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from bad_arguments import (
    BAD,
    HUGE,
    SCALARS,
    names_of,
    public_classes,
    public_functions,
    required,
    samples,
    scene,
    shown,
    what_comes,
)
from lampyris._core.scalars import MOST_WHOLE, is_whole
from lampyris.errors import (
    MAX_DIGITS,
    MAX_SHOWN,
    InputError,
    LampyrisError,
    SettingError,
    UsageError,
    did_you_mean,
)
from lampyris.model.settings.drive import DriveSettings
from lampyris.movingai import ask
from lampyris.planning import registry

CLASSES = dict(public_classes())
FUNCTIONS = dict(public_functions())
STUDY = "version: 1\nkind: plan\nmaps: [guide]\nplanners: [astar]\n"


@pytest.fixture(scope="module")
def right() -> dict[str, dict[str, Any]]:
    return samples()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scenario and a study, in which files may be written."""
    monkeypatch.chdir(tmp_path)
    lampyris.save_scenario(lampyris.Scenario(scene()), "right.yaml")
    lampyris.save_primitives(samples()["save_primitives"]["primitives"], "right.mprim")
    Path("study.yaml").write_text(STUDY)
    Path("agents.csv").write_text("start_x,start_y,goal_x,goal_y\n0,0,4,3\n4,3,0,0\n")
    Path("tasks.csv").write_text("release,x,y\n0,0,0\n")
    Path("sources.yaml").write_text("sources: [{kind: plume, at: [1, 2]}]\n")
    return tmp_path


def unexpected(call: Callable[..., Any], given: dict[str, Any], name: str, values: Any) -> list[str]:
    """What is raised that is none of ours, in lines."""
    found = []
    for value in values:
        error = what_comes(call, {**given, name: value})
        if error is not None:
            found.append(f"{name}={shown(value)}: {type(error).__name__}: {error}")
    return found


def test_the_lists_are_whole(right: dict[str, dict[str, Any]]) -> None:
    for name in (
        "Robot",
        "Grid",
        "Scene",
        "Budget",
        "AdGso",
        "DriveSettings",
        "PhysicalLaw",
        "GSO",
        "Adversary",
    ):
        assert name in CLASSES
    assert len(list(public_classes())) == len(CLASSES) > 60, "two classes of one name"
    assert {"plan", "simulate", "drive", "smooth", "speed_profile", "run_study"} <= FUNCTIONS.keys()
    for name, call in (CLASSES | FUNCTIONS).items():
        lacks = [p for p in required(call) if p not in right.get(name, {})]
        assert not lacks, f"say in samples() what {name} may be given for {lacks}"


@pytest.mark.commit(15)
@pytest.mark.parametrize("name", CLASSES)
def test_a_class_given_anything(name: str, right: dict[str, dict[str, Any]]) -> None:
    kind, given = CLASSES[name], right.get(name, {})
    kind(**given)
    found = [line for p in names_of(kind) for line in unexpected(kind, given, p, BAD)]
    assert not found, "\n".join(found)


@pytest.mark.commit(3)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_given_anything(name: str, right: dict[str, dict[str, Any]], folder: Path) -> None:
    call, given = FUNCTIONS[name], right.get(name, {})
    call(**given)
    found = []
    for p in names_of(call):
        # A function that is given is called, and may raise what it likes; processes are not for here.
        skipped = {"progress": callable, "workers": lambda v: isinstance(v, np.integer)}.get(
            p, lambda v: False
        )
        found += unexpected(call, given, p, [v for v in BAD if not skipped(v)])
    assert not found, "\n".join(found)


@pytest.mark.parametrize("verb", [lampyris.plan, lampyris.simulate, lampyris.drive])
def test_a_planners_settings_given_anything(verb: Callable[..., Any]) -> None:
    """The settings of every planner, by keyword of every verb."""
    where, found = scene(), []
    for planner in registry.names():
        for name in registry.settings_of(registry.planner_class(planner)):
            for value in (HUGE, 2**64, -(2**64), float("nan"), "x", object(), np.zeros(2), (1,)):
                given = {"scene": where, "planner": planner, "planner_settings": {name: value}}
                error = what_comes(verb, given)
                if error is not None:
                    found.append(f"{planner} {name}={shown(value)}: {error!r}")
    assert not found, "\n".join(found)


@pytest.mark.parametrize("value", SCALARS, ids=[str(k) for k in range(len(SCALARS))])
def test_values_are_shown_and_names_near_them_told_whatever_they_are(value: Any) -> None:
    assert len(shown(value)) <= 200
    assert did_you_mean(value, ["astar"]) in ("", "did you mean astar?")


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda: lampyris.Robot(v_max=HUGE), SettingError),
        (lambda: lampyris.Grid(np.zeros((2, 2), bool), origin=(HUGE, 0, 0)), SettingError),
        (lambda: lampyris.plan(scene(), rho=HUGE), SettingError),
        (lambda: lampyris.Budget(expansions=2**64), SettingError),
        (lambda: lampyris.solve_field("x"), SettingError),  # type: ignore[arg-type]
        (lambda: lampyris.Robot(v_max=10**5000), SettingError),
    ],
)
def test_the_errors_that_were_others(call: Callable[[], Any], error: type[InputError]) -> None:
    with pytest.raises(error) as caught:
        call()
    assert "allowed: " in str(caught.value)
    assert isinstance(caught.value, ValueError)


# ---- settings called as arguments are --------------------


def own_options(verb: Callable[..., Any]) -> set[str]:
    taken = set(names_of(verb)) - {"scene", "planner", "planner_settings"}
    return taken | {f for f in DriveSettings.__dataclass_fields__ if verb is lampyris.drive}


CLASHES = [
    (verb, planner, name)
    for verb, planner in itertools.product(
        (lampyris.plan, lampyris.simulate, lampyris.drive), registry.names()
    )
    for name in sorted(own_options(verb) & registry.settings_of(registry.planner_class(planner)).keys())
]


OF_THE_VERB = {"sensor": None}
"""Values for arguments that take another type than the planner's setting of that name."""


def test_patience_is_such_a_setting() -> None:
    """``drive(scene, "mmas-dstar", patience=40)`` set the drive's patience and said nothing."""
    assert (lampyris.drive, "mmas-dstar", "patience") in CLASHES
    assert (lampyris.simulate, "mmas-dstar", "patience") in CLASHES


@pytest.mark.parametrize(("verb", "planner", "name"), CLASHES)
def test_a_setting_called_as_an_argument_is_refused_and_can_be_said(
    verb: Callable[..., Any], planner: str, name: str
) -> None:
    value = registry.settings_of(registry.planner_class(planner))[name]
    with pytest.raises(UsageError, match=rf"SETTING_CLASH\]: {name}: .*planner_settings={{\"{name}\": ...}}"):
        verb(scene(), planner, **{name: value})
    assert verb(scene(), planner, planner_settings={name: value}).planner == planner
    of_the_verb = OF_THE_VERB.get(name, value)
    assert verb(scene(), planner, planner_settings={}, **{name: of_the_verb}).planner == planner


@pytest.mark.parametrize("verb", [lampyris.plan, lampyris.simulate, lampyris.drive, ask])
def test_any_argument_may_be_called_as_a_setting_of_a_planner(
    monkeypatch: pytest.MonkeyPatch, verb: Callable[..., Any]
) -> None:
    """A planner of another package may call its settings as it likes."""
    own = {p.name for p in inspect.signature(verb).parameters.values() if p.default is not p.empty}
    own |= {f for f in DriveSettings.__dataclass_fields__ if verb is lampyris.drive}
    own -= {"planner", "planner_settings"}
    assert len(own) >= 3
    monkeypatch.setattr(registry, "settings_of", lambda kind: dict.fromkeys(own))
    for name in own:
        with pytest.raises(UsageError, match=rf"SETTING_CLASH\]: {name}: "):
            verb(None, "astar", **{name: object()})


def test_the_planners_setting_and_the_drives_are_told_apart() -> None:
    with pytest.raises(SettingError):
        lampyris.drive(scene(), "mmas-dstar", planner_settings={"patience": "x"})
    with pytest.raises(SettingError, match="DRIVE_SETTING"):
        lampyris.drive(scene(), "mmas-dstar", patience="x", planner_settings={})
    with pytest.raises(UsageError, match="set twice"):
        lampyris.plan(scene(), "mmas-dstar", patience=2, planner_settings={"patience": 3})


def test_an_argument_left_as_it_is_does_not_clash() -> None:
    assert lampyris.simulate(scene(), "mmas-dstar", patience=None)
    assert lampyris.simulate(scene(), "astar", patience=3)


# ---- the front door --------------------


def test_load_grid_takes_what_its_messages_name(tmp_path: Path) -> None:
    """The message named ``--values costmap``, which ``load_grid`` had no way to be told."""
    file = tmp_path / "cost.npy"
    np.save(file, np.full((3, 4), 200, dtype=np.uint8))
    with pytest.raises(LampyrisError) as caught:
        lampyris.load_grid(file)
    assert 'values="costmap"' in str(caught.value)
    assert "--" not in str(caught.value)
    grid = lampyris.load_grid(file, values="costmap", resolution=0.5)
    assert grid.terrain is not None
    assert (int(grid.terrain[0, 0]), grid.resolution) == (200, 0.5)
    with pytest.raises(LampyrisError):
        lampyris.load_grid(file, values="costmap", max_cells=11)


def test_dir_shows_public_names_only() -> None:
    shown_names = [name for name in dir(lampyris) if not name.startswith("__")]
    assert sorted(shown_names) == sorted(set(lampyris.__all__) - {"__version__"})
    for name in lampyris.__all__:
        assert getattr(lampyris, name) is not None
    assert not hasattr(lampyris, "Any")
    assert not hasattr(lampyris, "importlib")


# ---- limits --------------------


def test_the_longest_values_that_are_shown_whole() -> None:
    for n in (MAX_SHOWN - 1, MAX_SHOWN, MAX_SHOWN + 1):
        text = "x" * (n - 2)  # and its quotation marks
        assert (shown(text) == repr(text)) == (n <= MAX_SHOWN)
        assert len(shown(text)) <= MAX_SHOWN
    for digits in (MAX_DIGITS - 1, MAX_DIGITS, MAX_DIGITS + 1):
        number = 10 ** (digits - 1)
        assert (shown(number) == str(number)) == (digits <= MAX_DIGITS)


def test_the_greatest_whole_number() -> None:
    for n in (MOST_WHOLE - 1, MOST_WHOLE, MOST_WHOLE + 1):
        assert is_whole(n) == is_whole(-n) == (n <= MOST_WHOLE)
    assert lampyris.Budget(expansions=MOST_WHOLE).expansions == MOST_WHOLE
    assert lampyris.plan(scene(), "astar", budget=lampyris.Budget(expansions=MOST_WHOLE))
    with pytest.raises(SettingError):
        lampyris.Budget(expansions=MOST_WHOLE + 1)
