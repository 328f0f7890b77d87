"""Fleets and swarms as an engine answers: the plans of the library in frames, and what is counted of them."""

from __future__ import annotations

import itertools
import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.app.engine import work
from lampyris.app.engine.bootstrap import hello
from lampyris.app.engine.fleets import fleet as fleet_module
from lampyris.app.engine.fleets import swarm as swarm_module
from lampyris.app.engine.fleets.alone import conflicts_alone
from lampyris.app.engine.fleets.fleet import (
    MOST_ROBOTS,
    MOST_SECONDS,
    parking,
    present_fleet,
    robots_of,
    seconds_of,
)
from lampyris.errors import LampyrisError, LimitError, SceneError, SettingError
from lampyris.fleets import PLANNER
from lampyris.model.grid import Grid

ROWS = ("........", ".##.##..", ".#...#..", ".#.#.#..", "........")
MAP = {"rows": list(ROWS)}


def ask(verb: str, **more: Any) -> list[tuple[str, bytes]]:
    question = {"verb": verb, "job": 3, **more}
    return [(chr(piece[4]), piece[5:]) for piece in work.answer(question, lambda: None)]


def told(frames: Sequence[tuple[str, bytes]], kind: str) -> Any:
    (found,) = [value for one, value in frames if one == kind]
    return json.loads(found) if kind in "HZX" else found


def paths_in(data: bytes) -> tuple[list[list[tuple[int, int]]], list[tuple[int, int]], list[int]]:
    """Paths, goals and shortest paths of a frame ``R``, read step by step."""
    (n,) = struct.unpack_from("<I", data)
    ends = struct.unpack_from(f"<{4 * n}h", data, 4)
    steps = struct.unpack_from(f"<{n}I", data, 4 + 8 * n)
    shortest = struct.unpack_from(f"<{n}i", data, 4 + 12 * n)
    halves = [half for byte in data[4 + 16 * n :] for half in (byte & 15, byte >> 4)]
    assert len(halves) in (sum(steps), sum(steps) + 1)
    left = iter(halves)
    moves = ((0, 0), (1, 0), (0, 1), (-1, 0), (0, -1))
    paths = []
    for r in range(n):
        path = [(ends[4 * r], ends[4 * r + 1])]
        for _ in range(steps[r]):
            dx, dy = moves[next(left)]
            path.append((path[-1][0] + dx, path[-1][1] + dy))
        paths.append(path)
    return paths, [(ends[4 * r + 2], ends[4 * r + 3]) for r in range(n)], list(shortest)


@pytest.mark.parametrize("planner", ["lacam", "pibt"])
def test_a_plan_is_that_of_the_library(planner: str) -> None:
    frames = ask("fleet", scenario={"map": "env-3"}, robots=25, seed=4, planner=planner)
    assert [kind for kind, _ in frames] == ["H", "R", "L", "Z"]
    fleet = lampyris.random_fleet(lampyris.load_grid("env-3"), 25, seed=4)
    plan = lampyris.plan_fleet(fleet, planner=planner, seed=4)
    paths, goals, shortest = paths_in(told(frames, "R"))
    assert paths == [[tuple(cell) for cell in path.tolist()] for path in plan.paths]
    assert goals == list(fleet.goals)
    assert plan.shortest is not None
    assert shortest == plan.shortest.tolist()
    end = told(frames, "Z")
    same = ("makespan", "sum_of_costs", "lower_bound", "gap", "iterations", "planner", "sentence")
    assert {key: end[key] for key in same} == {key: getattr(plan, key) for key in same}
    assert end["lost"] == []


def test_conflicts_of_robots_that_take_no_notice_are_counted_pair_by_pair() -> None:
    grid = lampyris.load_grid("env-3")
    fleet = lampyris.random_fleet(grid, 40, seed=2)
    found = conflicts_alone(fleet)
    assert found is not None
    tracks = [alone(grid, one.start, one.goal) for one in fleet.robots]
    last = max(map(len, tracks)) - 1
    at = [[track[min(t, len(track) - 1)] for track in tracks] for t in range(last + 1)]
    vertex = swap = 0
    where = np.zeros(grid.blocked.shape)
    for t in range(1, last + 1):
        for a, b in itertools.combinations(range(len(tracks)), 2):
            if at[t][a] == at[t][b]:
                vertex += 1
                where[at[t][a][::-1]] += 1
            elif at[t][a] == at[t - 1][b] and at[t][b] == at[t - 1][a]:
                swap += 1
                where[at[t][a][::-1]] += 1
                where[at[t][b][::-1]] += 1
    assert vertex > 0
    assert swap > 0
    assert (found.vertex, found.swap) == (vertex, swap)
    assert (found.where == where).all()


def alone(grid: Grid, start: tuple[int, int], goal: tuple[int, int]) -> list[tuple[int, int]]:
    """A shortest path: at each cell the first neighbour of north, west, east, south that is nearer to the goal."""
    steps = {goal: 0}
    queue = [goal]
    for x, y in queue:
        for dx, dy in ((0, -1), (-1, 0), (1, 0), (0, 1)):
            cell = (x + dx, y + dy)
            if grid.contains(cell) and not grid.blocked[cell[1], cell[0]] and cell not in steps:
                steps[cell] = steps[x, y] + 1
                queue.append(cell)
    path = [start]
    while path[-1] != goal:
        x, y = path[-1]
        near = [(x, y - 1), (x - 1, y), (x + 1, y), (x, y + 1)]
        path.append(next(cell for cell in near if steps.get(cell) == steps[x, y] - 1))
    return path


def test_a_wall_that_is_painted_is_planned_around_from_where_the_robots_are() -> None:
    agents = [0, 0, 7, 0, 7, 0, 0, 0, 2, 2, 4, 2]
    wall = [{"tick": 0, "blocked": [[3, 0], [3, 2]], "freed": []}]
    frames = ask("fleet", scenario={"map": MAP, "edits": wall}, agents=agents, settings={"improve": False})
    end = told(frames, "Z")
    paths, _, _ = paths_in(told(frames, "R"))
    assert end["found"]
    assert [path[0] for path in paths] == [(0, 0), (7, 0), (2, 2)]
    assert [path[-1] for path in paths] == [(7, 0), (0, 0), (4, 2)]
    assert not {(3, 0), (3, 2)} & {cell for path in paths for cell in path}


def test_robots_whose_goals_are_walled_off_are_named_and_stand_aside() -> None:
    agents = [0, 0, 7, 0, 7, 0, 0, 0, 2, 2, 4, 4]
    # Robot 0's goal gets a wall, robot 2 is walled in.
    blocked = [[7, 0], [2, 3], [2, 4], [3, 2]]
    agents[4:6] = [7, 1]
    frames = ask(
        "fleet", scenario={"map": MAP, "edits": [{"tick": 0, "blocked": blocked, "freed": []}]}, agents=agents
    )
    end = told(frames, "Z")
    assert end["found"]
    assert end["lost"] == [0, 2]
    paths, goals, _ = paths_in(told(frames, "R"))
    assert paths[1][-1] == (0, 0), "the others go where they were sent"
    assert paths[2] == [(2, 2)], "where it is it is in nobody's way"
    assert paths[0][-1] == goals[0] != (0, 0), "its own cell is another robot's goal"
    assert abs(goals[0][0]) + abs(goals[0][1]) == 1


def test_the_nearest_cell_that_nobody_needs_is_where_a_robot_stands_aside() -> None:
    blocked = np.zeros((1, 5), dtype=bool)
    assert parking(blocked, (2, 0), set()) == (2, 0)
    assert parking(blocked, (2, 0), {(2, 0), (1, 0), (3, 0)}) == (4, 0)
    assert parking(blocked, (2, 0), {(x, 0) for x in range(5)}) == (2, 0)


@pytest.mark.parametrize(
    ("more", "kind", "code"),
    [
        ({"robots": 0}, SettingError, "ROBOTS"),
        ({"robots": MOST_ROBOTS + 1}, SettingError, "ROBOTS"),
        ({"robots": 39}, SettingError, "ROBOTS"),
        ({}, SettingError, "ROBOTS"),
        ({"robots": 2, "seconds": 31}, SettingError, "SECONDS"),
        ({"robots": 2, "seconds": True}, SettingError, "SECONDS"),
        ({"robots": 2, "planner": "nobody"}, LampyrisError, "PLANNER"),
        ({"robots": 2, "settings": {"nt": 1}}, SettingError, "SETTING"),
        ({"agents": []}, SettingError, "AGENTS"),
        ({"agents": [0, 0, 7]}, SettingError, "AGENTS"),
        ({"agents": [0, 0, 7, 0.5]}, SettingError, "AGENTS"),
        ({"agents": [0, 0, 7, -1]}, SettingError, "AGENTS"),
        ({"agents": [1, 1, 7, 0]}, SceneError, "START_OCCUPIED"),
        ({"agents": [9, 0, 7, 0]}, SceneError, "START_OUTSIDE"),
        ({"agents": [0, 0, 7, 0, 0, 0, 6, 0]}, SettingError, "FLEET"),
    ],
)
def test_what_is_wrong_with_a_question_is_said(
    more: dict[str, Any], kind: type[LampyrisError], code: str
) -> None:
    with pytest.raises(kind) as found:
        ask("fleet", scenario={"map": MAP}, **more)
    assert found.value.code == code


def test_limits_are_reached_and_not_passed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert robots_of({"robots": MOST_ROBOTS}, MOST_ROBOTS) == MOST_ROBOTS
    with pytest.raises(SettingError, match="1 to 1,000"):
        robots_of({"robots": MOST_ROBOTS + 1}, MOST_ROBOTS)
    assert seconds_of({"seconds": MOST_SECONDS}) == MOST_SECONDS
    with pytest.raises(SettingError, match="at most 30"):
        seconds_of({"seconds": MOST_SECONDS + 0.1})
    with pytest.raises(SettingError, match="for each of 1 to 1,000 robots"):
        present_fleet(Grid([[False]]), [0, 0, 0, 0] * (MOST_ROBOTS + 1))
    agents = [0, 0, 7, 0]
    monkeypatch.setattr(fleet_module, "MOST_PLACES", 8)
    assert told(ask("fleet", scenario={"map": MAP}, agents=agents), "Z")["makespan"] == 7
    monkeypatch.setattr(fleet_module, "MOST_PLACES", 7)
    with pytest.raises(LimitError, match="7 robots times ticks") as found:
        ask("fleet", scenario={"map": MAP}, agents=agents)
    assert found.value.code == "FLEET_PLACES"
    monkeypatch.setattr(swarm_module, "MOST_PLACES", 20)
    ask("swarm", scenario={"map": "env-6"}, robots=10, settings={"iterations": 2})
    with pytest.raises(LimitError, match="20 robots times iterations"):
        ask("swarm", scenario={"map": "env-6"}, robots=7, settings={"iterations": 3})


def test_a_swarm_is_that_of_the_library() -> None:
    settings = {"iterations": 60, "noise": 0.05}
    frames = ask("swarm", scenario={"map": "env-6"}, robots=20, seed=5, sources="drawn", settings=settings)
    assert [kind for kind, _ in frames] == ["H", "L", "G", "G", "Z"]
    grid = lampyris.load_grid("env-6")
    trace = lampyris.swarm_robots(grid, "drawn", 20, seed=5, swarm_settings=settings)
    first = 0
    for data in (value for kind, value in frames if kind == "G"):
        begins, n, robots, sources = struct.unpack_from("<IHHH", data)
        assert (begins, robots, sources) == (first, 20, 3)
        part = slice(first, first + n)
        at = 10
        places = np.frombuffer(data, "<f4", 2 * n * robots, at).reshape(n, robots, 2)
        assert np.abs(places - grid.to_points(trace.xy[part, :, 0], trace.xy[part, :, 1])).max() < 1e-4
        at += 8 * n * (robots + sources)
        assert (np.frombuffer(data, "<u2", n * sources, at).reshape(n, sources) == trace.held[part]).all()
        bright = np.frombuffer(data, "u1", n * robots, at + 2 * n * sources).reshape(n, robots)
        low, high = told(frames, "H")["luciferin"]
        assert np.abs(low + bright / 255 * (high - low) - trace.luciferin[part]).max() <= (high - low) / 255
        first += n
    assert first == 61
    assert told(frames, "Z")["held"] == trace.held[-1].tolist()


def test_a_swarm_that_the_page_cannot_hold_is_refused() -> None:
    with pytest.raises(LimitError) as found:
        ask("swarm", scenario={"map": "env-6"}, robots=1000, settings={"iterations": 100_000})
    assert found.value.code == "SWARM_PLACES"
    with pytest.raises(SettingError, match="three-peaks"):
        ask("swarm", scenario={"map": "env-6"}, robots=10, sources="sources.yaml")


def test_the_page_is_told_the_default_planner_first() -> None:
    names = [row["name"] for row in hello()["planners_of_fleets"]]
    assert names[0] == PLANNER
    assert sorted(names) == sorted(lampyris.list_planners("fleets"))
