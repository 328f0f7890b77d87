"""Many robots in a browser: planned, watched, and planned again around what is painted; not without chromium."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_browser import needs_chromium
from page_person import changed, click, draw, drawn, in_address, picture, until

import lampyris

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium

ROBOTS = 60


def number(page: Any, name: str) -> str:
    """A number beside the map, by its name."""
    found: str = page.locator(f"#fleet-now dt:text-is('{name}') + dd").first.inner_text()
    return found


def counted(paths: Any) -> tuple[int, int]:
    """Ticks that robots wait before they are on their goals for good, and those in which another is in the next cell."""
    last = max(map(len, paths))
    at = [[tuple(path[min(t, len(path) - 1)]) for path in paths] for t in range(last)]
    waits = hindered = 0
    for path in paths:
        for t in range(len(path) - 1):
            if tuple(path[t]) == tuple(path[t + 1]):
                waits += 1
                after = next(tuple(cell) for cell in path[t:] if tuple(cell) != tuple(path[t]))
                hindered += after in at[t + 1]
    return waits, hindered


def tick_to(page: Any, tick: int) -> None:
    page.get_by_label("Tick", exact=True).evaluate(
        "(one, tick) => { one.value = tick; one.dispatchEvent(new Event('input')); }", tick
    )


def paint(page: Any, cell: tuple[int, int]) -> None:
    """A stroke on one cell, where no note lies over the map."""
    page.locator("#notes").evaluate("one => one.replaceChildren()")
    draw(page, [cell, cell])


@pytest.mark.nightly
def test_a_fleet_is_planned_watched_and_planned_again_around_what_is_painted(page: Any) -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("env-3"), ROBOTS, seed=4)
    plan = lampyris.plan_fleet(fleet, planner="pibt", seed=4)
    assert plan
    before = picture(page)
    page.click("#tab-fleet")
    page.fill("#fleet-number", str(ROBOTS))
    page.select_option("#fleet-planner", "pibt")
    page.fill("#fleet-seed", "4")
    page.get_by_role("button", name="Plan", exact=True).click()
    page.locator("#fleet-now dt:text-is('Makespan')").wait_for()
    page.locator("#fleet-time").get_by_role("button", name="Pause").click()
    waits, hindered = counted([path.tolist() for path in plan.paths])
    assert waits > 0
    assert number(page, "Makespan") == f"{plan.makespan} ticks"
    assert number(page, "Sum of costs") == f"{plan.sum_of_costs:,}"
    assert number(page, "Lower bound") == f"{plan.lower_bound:,}"
    assert number(page, "Ticks waited") == f"{waits:,}"
    assert [text.strip() for text in page.locator("#fleet-now dd").all_inner_texts()].count(
        f"{hindered:,}"
    ) >= 1
    assert (
        page.inner_text("#fleet .command")
        == f"lampyris fleet env-3 --robots {ROBOTS} --planner pibt --seconds 2 --seed 4"
    )

    # Keys: the last tick, where all have arrived, and back.
    page.locator("#map").focus()
    page.keyboard.press("End")
    assert number(page, "Tick") == str(plan.makespan)
    assert number(page, "On their goals") == f"{ROBOTS} of {ROBOTS}"
    page.keyboard.press(",")
    assert number(page, "Tick") == str((plan.makespan or 0) - 1)
    tick_to(page, 10)
    drawn(page)
    assert changed(before, picture(page)) > 0.01

    # A robot by a click.
    chosen = 7
    click(page, tuple(plan.at(10)[chosen].tolist()))
    assert page.input_value("#fleet-robot") == str(chosen)
    assert number(page, "Goal") == str(fleet.goals[chosen])
    assert number(page, "On its goal for good") == f"tick {len(plan.paths[chosen]) - 1}"

    # Its goal gets a wall while it is on its way.
    here = {tuple(cell) for cell in np.concatenate([plan.at(10), plan.at(11)]).tolist()}
    late = next(r for r in range(ROBOTS) if len(plan.paths[r]) > 30 and fleet.goals[r] not in here)
    page.keyboard.press("b")
    paint(page, fleet.goals[late])
    page.wait_for_selector(f".note >> text=Robot {late} cannot reach its goal any more")
    assert re.match(
        r"Wall painted at tick 10: planned again in [\d.]+ s\.", page.inner_text("#fleet [role=status]")
    )
    assert number(page, "Goals walled off") == "1"
    tick_to(page, 10_000)
    assert number(page, "On their goals") == f"{ROBOTS - 1} of {ROBOTS}"
    tick_to(page, 10)
    page.keyboard.press("e")
    paint(page, fleet.goals[late])
    page.wait_for_selector(f".note >> text=Robot {late} can reach its goal again")
    tick_to(page, 10_000)
    assert number(page, "On their goals") == f"{ROBOTS} of {ROBOTS}"

    # No wall comes onto a robot.
    tick_to(page, 10)
    page.keyboard.press("b")
    standing = next(r for r in range(ROBOTS) if (plan.at(10)[r] == plan.at(9)[r]).all())
    paint(page, tuple(plan.at(10)[standing].tolist()))
    page.wait_for_selector(f".note >> text=No wall on cells with a robot: Robot {standing} stands there.")

    # And the single robot is where it was.
    page.click("#tab-settings")
    page.wait_for_selector("#timeline:visible")
    page.keyboard.press("v")
    page.mouse.move(2, 2)
    drawn(page)
    until(page, lambda: changed(before, picture(page)) < 0.005)


@pytest.mark.nightly
def test_a_fleet_is_in_the_address_and_in_files(page: Any, tmp_path: Path) -> None:
    page.click("#tab-fleet")
    page.fill("#fleet-number", "30")
    page.select_option("#fleet-planner", "lns")
    page.fill("#fleet-seconds", "0.5")
    page.fill("#fleet-seed", "9")
    page.get_by_role("button", name="Plan", exact=True).click()
    page.locator("#fleet-now dt:text-is('Makespan')").wait_for()
    page.locator("#fleet-time").get_by_role("button", name="Pause").click()
    grid = lampyris.load_grid("env-3")
    fleet = lampyris.random_fleet(grid, 30, seed=9)
    costs = number(page, "Sum of costs")

    def kept(name: str) -> bytes:
        with page.expect_download() as coming:
            page.locator("#fleet").get_by_role("button", name=name, exact=True).click()
        coming.value.save_as(tmp_path / name)
        return (tmp_path / name).read_bytes()

    record = json.loads(kept("JSON"))
    assert f"{record['sum_of_costs']:,}" == costs
    assert [tuple(goal) for goal in record["goals"]] == list(fleet.goals)
    rows = kept("CSV").decode().splitlines()
    assert rows[0] == "robot,tick,x,y"
    assert len(rows) == 1 + sum(map(len, record["paths"]))
    assert kept("Film")[8:12] == b"WEBP"
    assert kept("Picture")[1:4] == b"PNG"
    (tmp_path / "s.yaml").write_bytes(kept("Scenario"))
    scenario = lampyris.load_scenario(tmp_path / "s.yaml")
    assert scenario.fleet == fleet
    assert lampyris.run(scenario).sum_of_costs == record["sum_of_costs"]

    # Somebody else opens the address: the same panel, planned, with the wall that is painted.
    page.click("#fleet-time button >> nth=0")
    tick_to(page, 0)
    free = next(
        cell
        for cell in ((x, 25) for x in range(50))
        if not grid.blocked[25, cell[0]] and cell not in fleet.starts
    )
    page.keyboard.press("b")
    paint(page, free)
    page.wait_for_selector("#fleet [role=status] >> text=planned again")
    state = in_address(page)["fleet"]
    assert (state["open"], state["planned"], state["robots"], state["blocked"]) == (
        True,
        True,
        30,
        [list(free)],
    )
    other = page.context.new_page()
    other.goto(page.url)
    other.locator("#fleet-now dt:text-is('Makespan')").wait_for()
    assert other.input_value("#fleet-planner") == "lns"
    assert (other.input_value("#fleet-number"), other.input_value("#fleet-seed")) == ("30", "9")
    assert other.locator("#fleet").get_by_role("button", name="Clear painted walls").is_visible()

    # A new tab of this browser has it as the draft.
    third = page.context.new_page()
    third.goto(page.url.split("&s=")[0])
    third.locator("#fleet-now dt:text-is('Makespan')").wait_for()
    assert third.input_value("#fleet-planner") == "lns"


@pytest.mark.nightly
def test_glowworm_robots_are_simulated_and_counted(page: Any) -> None:
    trace = lampyris.swarm_robots(lampyris.load_grid("env-3"), robots=40, seed=2, iterations=80)
    page.click("#tab-fleet")
    page.get_by_role("button", name="Glowworms").click()
    page.fill("#fleet-number", "40")
    page.fill("#swarm-iterations", "80")
    page.fill("#fleet-seed", "2")
    page.get_by_role("button", name="Simulate", exact=True).click()
    page.locator("#fleet-time").get_by_role("button", name="Pause").click()
    page.locator("#map").focus()
    page.keyboard.press("End")
    assert number(page, "Iteration") == "80"
    assert [number(page, f"At source {k}") for k in range(3)] == [str(many) for many in trace.held[-1]]
    assert page.inner_text("#fleet [role=status]") == trace.sentence


@pytest.mark.nightly
def test_the_plan_of_a_comparison_avoids_walls_of_later_ticks(page: Any) -> None:
    """A wall painted at tick 20 is in the compared plans, although tick 5 is shown when they are asked for."""
    grid = lampyris.load_grid("env-3")
    fleet = lampyris.random_fleet(grid, ROBOTS, seed=4)
    plan = lampyris.plan_fleet(fleet, planner="pibt", seed=4)
    page.click("#tab-fleet")
    page.fill("#fleet-number", str(ROBOTS))
    page.select_option("#fleet-planner", "pibt")
    page.fill("#fleet-seconds", "0.5")
    page.fill("#fleet-seed", "4")
    page.get_by_role("button", name="Plan", exact=True).click()
    page.locator("#fleet-now dt:text-is('Makespan')").wait_for()
    page.locator("#fleet-time").get_by_role("button", name="Pause").click()
    tick_to(page, 20)
    # Where the planner that is shown below would drive without the wall.
    ends = {*fleet.starts, *fleet.goals}
    here = {tuple(cell) for cell in np.concatenate([plan.at(20), plan.at(21)]).tolist()}
    driven = [tuple(cell) for path in plan.paths for cell in path.tolist()]
    wall = max((cell for cell in {*driven} - ends - here if wall_fits(grid, cell)), key=driven.count)
    page.keyboard.press("b")
    paint(page, wall)
    page.wait_for_selector("#fleet [role=status] >> text=planned again")
    tick_to(page, 5)
    asked: list[Any] = []
    page.on("request", lambda one: asked.append(one.post_data_json) if "/api/fleet" in one.url else None)
    page.get_by_role("button", name="Compare planners").click()
    page.locator("dialog[open] [role=status]", has_text="Costs in ticks").wait_for()
    assert asked
    for question in asked:
        assert question["scenario"]["edits"] == [{"tick": 0, "blocked": [list(wall)], "freed": []}]
    page.locator("dialog[open] tbody").get_by_role("button", name="Show the plan of PIBT").click()
    page.locator("#fleet-now dt:text-is('Makespan')").wait_for()
    page.locator("#fleet-time").get_by_role("button", name="Pause").click()
    with page.expect_download() as coming:
        page.locator("#fleet").get_by_role("button", name="JSON", exact=True).click()
    record = json.loads(Path(coming.value.path()).read_bytes())
    assert list(wall) not in [cell for path in record["paths"] for cell in path]
    assert page.locator("#fleet").get_by_role("button", name="Clear painted walls").is_visible()


def wall_fits(grid: lampyris.Grid, cell: tuple[int, int]) -> bool:
    """Whether all cells around it are free, so that a wall there separates nothing."""
    x, y = cell
    around = grid.blocked[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
    return around.shape == (3, 3) and not around.any()
