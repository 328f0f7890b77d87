"""Every law at the front door, with a limit on jerk or without, from rest and driving."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris import Robot, Scene, api
from lampyris.errors import InternalFault, SettingError
from lampyris.io.maps.load import load_map
from lampyris.model.path import path_of
from lampyris.model.profile import Profile
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.compare import compare, entry_of, jerk_of
from sizes import some

Case = tuple[Any, Scene]


def case(name: str, **robot: Any) -> Case:
    document = load_map(name)
    query = document.queries[0]
    scene = Scene(document.grid, query.start, query.goal, robot=Robot(radius=0.3, **robot))
    return api.plan(scene, "astar"), scene


def driven(way: Any, scene: Scene, law: str, **how: Any) -> Profile:
    """A profile from a start that drives: as fast as asked for, or as fast as the refusal allows."""
    try:
        return api.speed_profile(scene, way, law, **how)
    except SettingError as fault:
        if fault.code != "PROFILE_INFEASIBLE":
            raise
        greatest = float(fault.allowed.removeprefix("at most ").removesuffix(" m/s"))
        return api.speed_profile(scene, way, law, **(how | {"v0": greatest}))


@pytest.mark.commit(2)
@pytest.mark.parametrize("jerk_max", some([1.0, None, 5.0, 0.1], 2))
@pytest.mark.parametrize("law", laws.names())
def test_every_law_passes_the_referee_whatever_the_limit_on_jerk(law: str, jerk_max: float | None) -> None:
    for name in ("guide", "env-1"):
        plan, scene = case(name, jerk_max=jerk_max)
        course = api.smooth(scene, plan)
        for v0 in (0.0, 0.04, 0.9):
            for way, how in ((course, {}), (plan, {}), (plan, {"smooth": "arcs"})):
                made = driven(way, scene, law, v0=v0, **how)
                assert made.law == law
                assert (made.duration > 0.0, made.v[-1]) == (True, 0.0)
                if way is course and law not in ("rpp", "dissertation"):
                    assert "jerk" not in entry_of(made, course, scene.robot, 1.0).broken


@pytest.mark.parametrize("law", laws.names())
def test_paths_of_one_and_two_cells_whatever_the_robot_can(law: str) -> None:
    for robot in ({}, {"v_max": 9.0, "a_max": 5.0}, {"jerk_max": 0.2}, {"v_max": 9.0, "jerk_max": 50.0}):
        _, scene = case("env-6", **robot)
        free = np.argwhere(~scene.grid.blocked)
        y, x = next((int(y), int(x)) for y, x in free if not scene.grid.blocked[y, x + 1 : x + 2].any())
        for cells in ([[x, y]], [[x, y], [x + 1, y]]):
            made = api.speed_profile(scene, path_of(np.array(cells), scene.moves), law)
            assert made.v[-1] == 0.0


def test_rivals_that_break_the_limit_on_jerk_are_told_apart() -> None:
    plan, scene = case("env-1", jerk_max=0.3)
    course = api.smooth(scene, plan)
    chosen = [*laws.names(), laws.with_settings("rpp", {"desired": 1.0})]
    broken = {k: e.broken for k, e in enumerate(compare(course, scene, chosen))}
    names = dict(enumerate(laws.names()))
    for k, found in broken.items():
        assert ("jerk" in found) == (names.get(k, "rpp") in ("rpp", "dissertation"))
    free = replace(scene, robot=replace(scene.robot, jerk_max=None))
    assert all("jerk" not in e.broken for e in compare(course, free, chosen))


def test_jerk_is_judged_with_waits_and_hops() -> None:
    still = np.zeros(3)
    hop = Profile(
        "rpp", np.array([0.0, 0.0, 2.0]), still, still, np.array([0.0, 3.0, 7.0]), ("wait",) * 3, "m/s"
    )
    assert jerk_of(hop) == pytest.approx(32 * 2.0 / 4.0**3)
    s, v = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0]), np.array([0.0, 1.0, 0.0, 0.0, 1.0, 0.0])
    a = np.array([0.5, -0.5, 0.0, 0.5, -0.5, 0.0])
    t = np.array([0.0, 2.0, 4.0, 9.0, 11.0, 13.0])
    # From rest to 0.5 m/s2 in half of 2 s; from 0.5 to -0.5 in 2 s.
    assert jerk_of(Profile("rpp", s, v, a, t, ("wait",) * 6, "m/s")) == pytest.approx(0.5)
    one = np.zeros(1)
    assert jerk_of(Profile("rpp", one, one, one, one, ("start",), "m/s")) == 0.0


def test_ours_is_held_to_the_limit_on_jerk(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, scene = case("env-1", jerk_max=0.05)
    free = replace(scene, robot=replace(scene.robot, jerk_max=None))
    true = laws.profile
    monkeypatch.setattr(laws, "profile", lambda way, scene, **how: true(way, free, **how))
    for law in ("physical", "optimum"):
        with pytest.raises(InternalFault, match=r"jerk: a changes by") as raised:
            api.speed_profile(scene, plan, law)
        assert "np." not in str(raised.value)
    assert api.speed_profile(scene, plan, "rpp").law == "rpp"
