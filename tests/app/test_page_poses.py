"""Planners of poses in the page: footprints, handles that set headings, drives by several controllers."""

from __future__ import annotations

import base64
import json
import math
import zlib
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import aim, changed, fact, in_address, picture, until
from test_page_hands import address, page, tab, wrong

from lampyris import scenarios
from lampyris.app.engine.driving import digest
from lampyris.app.engine.parse import scenario_of_request

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium
__all__ = ["address", "page", "tab", "wrong"]


def choose(page: Any, planner: str) -> None:
    """Choose a planner in the panel of settings."""
    page.get_by_role("tab", name="Planner").click()
    page.locator("select[aria-label=Planner]").select_option(planner)


def test_handles_turn_the_ends_and_a_rectangle_is_planned_for(page: Any) -> None:
    """The plan is one of poses; a dragged handle and the key Q set headings, which are kept and undone."""
    choose(page, "lattice")
    until(page, lambda: "Length" in page.locator("#status").inner_text())
    page.get_by_label("shape", exact=True).select_option("rectangle")
    page.get_by_label("drive", exact=True).select_option("ackermann")
    until(page, lambda: in_address(page)["robot"].get("rectangle") == [1.2, 0.8])
    scenario = in_address(page)
    assert scenario["robot"] == {"rectangle": [1.2, 0.8], "drive": "ackermann"}
    x, y = aim(page, tuple(scenario["start"]))
    arm = max(30.0, 0.6 * (aim(page, (1, 0))[0] - aim(page, (0, 0))[0]) + 12)
    page.mouse.move(x + arm, y)
    page.mouse.down()
    page.mouse.move(x, y + 60, steps=3)
    page.mouse.up()
    until(page, lambda: in_address(page)["start_yaw"] is not None)
    assert math.isclose(in_address(page)["start_yaw"], -math.pi / 2, abs_tol=1e-5)
    assert float(fact(page, "Length").split()[0]) > 10
    page.keyboard.press("Control+z")
    until(page, lambda: in_address(page)["start_yaw"] is None)
    page.keyboard.press("Control+Shift+z")
    until(page, lambda: in_address(page)["start_yaw"] is not None)
    page.locator("#map").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("q")
    until(page, lambda: math.isclose(in_address(page)["start_yaw"], -math.radians(75), abs_tol=1e-5))


ROWS = ["." * 24 for _ in range(9)] + ["#" * 15 + "." * 9] + ["." * 24 for _ in range(8)]
SIZE = (24, 18)


def link(address: str, **more: Any) -> str:
    """The address of a yard with two walkers, where a disc is planned for."""
    scenario = {
        "version": 1, "map": {"rows": ROWS, "name": "yard", "resolution": 0.25}, "start": [3, 4], "goal": [4, 14],
        "robot": {}, "preset": "robot", "planner": {"name": "lattice", "settings": {}}, "seed": 4,
        "obstacles": [{"kind": "random-walk", "count": 2}], "edits": [], **more,
    }  # fmt: skip
    packer = zlib.compressobj(wbits=-15)
    packed = packer.compress(json.dumps(scenario).encode()) + packer.flush()
    said = base64.urlsafe_b64encode(packed).decode().rstrip("=")
    return f"{address.split('&')[0]}&s={said}"


def opened(page: Any, address: str, **more: Any) -> Any:
    """The group Drive of the page of :func:`link`, with a plan."""
    page.goto("about:blank")
    page.goto(link(address, **more))
    page.wait_for_selector("body.ready")
    until(page, lambda: "Length" in page.locator("#status").inner_text())
    page.get_by_role("tab", name="Planner").click()
    return page.get_by_role("group", name="Drive", exact=True)


def results(page: Any) -> dict[str, list[str]]:
    """The rows of the table of controllers, by their headings; the first is that of the columns."""
    rows = page.locator(".st-results tr").all()
    return {
        row.locator("th[scope=row], td").first.inner_text(): row.locator(
            "td:not(:first-child), th[scope=col], th + td"
        ).all_inner_texts()
        for row in rows
    }


def seconds(page: Any) -> float:
    """The moment that is shown."""
    return float(page.locator(".tl-where").inner_text().split()[0])


def turn(page: Any, cell: tuple[int, int], by: tuple[float, float]) -> None:
    """Drag the handle of an end, ahead of its footprint, to some pixels from its cell."""
    x, y = aim(page, cell, SIZE)
    per_cell = aim(page, (1, 0), SIZE)[0] - aim(page, (0, 0), SIZE)[0]
    page.mouse.move(x + max(30.0, 0.5 / 0.25 * per_cell + 12), y)
    page.mouse.down()
    page.mouse.move(x + by[0], y + by[1], steps=3)
    page.mouse.up()


@pytest.mark.nightly
def test_a_car_is_driven_and_a_second_controller_is_compared_with_it(page: Any, address: str) -> None:
    """A footprint and a heading are set by hand, Drive is pressed, and there are animation, chart and table."""
    group = opened(page, address, robot={"drive": "ackermann", "turn_radius": 0.8})
    page.get_by_label("shape", exact=True).select_option("rectangle")
    page.get_by_label("length", exact=False).first.fill("1.0")
    page.get_by_label("width", exact=False).first.fill("0.5")
    page.keyboard.press("Tab")
    turn(page, (4, 14), (0, -80))
    until(page, lambda: in_address(page).get("goal_yaw") is not None)
    assert math.isclose(in_address(page)["goal_yaw"], math.pi / 2, abs_tol=1e-4)
    group.get_by_label("Controller", exact=True).select_option("rpp")
    group.get_by_label("exact", exact=True).check()
    still = picture(page)
    group.get_by_role("button", name="Drive", exact=True).click()
    until(page, lambda: page.locator(".st-results th[scope=col]").count() == 2)
    assert page.locator(".st-results th[scope=col]").all_inner_texts() == ["rpp", "exact"]

    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("End")
    until(page, lambda: page.locator('#status dt:text-is("Took")').count() == 1)
    found = results(page)
    assert found["Outcome"] == ["arrived", "arrived"]
    assert float(found["Off path, m"][0]) > 0
    assert found["Off path, m"][1] == "0"
    assert found["Contacts"] == ["0", "0"]
    assert abs(float(found["Time, s"][0]) - seconds(page)) < 0.06
    # The chart is over seconds, and says what limits the speed.
    assert "over seconds" in page.locator(".ch-box figcaption").first.inner_text()
    assert page.locator(".ch-legend li").count() > 1
    end = picture(page)
    page.keyboard.press("Home")
    for _ in range(10):
        page.keyboard.press("PageUp")
    middle = picture(page)
    assert 2 < seconds(page) < float(found["Time, s"][0])
    assert min(changed(still, middle), changed(middle, end)) > 0.002, "the robot is somewhere else"
    said = in_address(page)
    assert said["drive"] == {"controller": "rpp"}
    assert [one["name"] for one in said.pop("controllers")] == ["exact"]
    said |= {end_: {"cell": said[end_], "yaw": said[f"{end_}_yaw"]} for end_ in ("goal",)}
    scenario = {key: value for key, value in said.items() if not key.endswith("_yaw") and key != "simulate"}
    page.keyboard.press("End")
    until(page, lambda: page.locator('#status dt:text-is("Digest")').count() == 1)
    made: Any = scenarios.run(scenario_of_request({"scenario": scenario}))
    assert fact(page, "Digest") == digest(made)[:16]


@pytest.mark.nightly
def test_a_drive_is_stopped_and_one_that_is_refused_says_why(page: Any, address: str) -> None:
    """Stop leaves the plan as it was; a setting that the drive refuses is said in a sentence."""
    mppi = {"controller": "mppi", "controller_settings": {"samples": 50_000, "steps": 200}}
    group = opened(page, address, drive=mppi)
    page.get_by_role("button", name="Play", exact=True).click()
    main_ = page.locator(".tl-buttons .main")
    until(page, lambda: main_.inner_text() == "Stop")
    assert "Driving" in page.locator("#status").inner_text()
    group.get_by_role("button", name="Stop", exact=True).click()
    until(page, lambda: main_.inner_text() == "Play")
    assert not page.locator(".st-results").is_visible()
    assert page.locator(".tl-where").inner_text() == "not run yet"

    group.get_by_label("Controller", exact=True).select_option("exact")
    group.get_by_label("pure-pursuit", exact=True).check()
    group.locator("summary").last.click()
    group.get_by_label("tracking", exact=True).select_option("velocity")
    group.get_by_role("button", name="Drive", exact=True).click()
    until(page, lambda: page.locator(".st-results .bad").count() > 0)
    assert "tracking" in page.locator(".st-results .bad").inner_text()
    assert results(page)["Outcome"] == ["arrived", "refused"]


@pytest.mark.nightly
def test_cells_are_driven_in_continuous_time_if_that_is_chosen(page: Any, address: str) -> None:
    """Planners of cells are simulated in ticks or driven; going back from poses takes cells in ticks again."""
    group = opened(page, address, obstacles=[])
    choose(page, "astar")
    until(page, lambda: "Gap" in page.locator("#status").inner_text())
    assert not group.get_by_role("button", name="Drive", exact=True).is_visible()
    group.get_by_label("continuous time").check()
    group.get_by_role("button", name="Drive", exact=True).click()
    until(page, lambda: page.locator(".tl-where").inner_text().endswith(" s"))
    assert not page.locator(".st-results").is_visible()
    group.get_by_label("continuous time").uncheck()
    page.get_by_role("button", name="Play", exact=True).click()
    until(page, lambda: "/" in page.locator(".tl-where").inner_text())
    until(page, lambda: page.locator(".tl-where").get_attribute("title").startswith("Tick "))


@pytest.mark.nightly
def test_rounds_of_pad_are_shown_one_by_one(page: Any, address: str) -> None:
    """Spheres, tunnel and paths of a round, which is chosen by a slider; another planner has none."""
    opened(
        page,
        address,
        planner={"name": "pad", "settings": {"weight": 1.05}},
        obstacles=[],
        robot={"rectangle": [0.9, 0.5], "drive": "ackermann", "turn_radius": 0.75},
    )
    rounds = page.get_by_label("Rounds of pad")
    until(page, rounds.is_visible)
    still = picture(page)
    rounds.check()
    until(page, lambda: changed(still, picture(page)) > 0.005)
    assert "Round " in page.locator("#layers").inner_text()
    assert "No path costs less than" in page.locator("#layers").inner_text()
    rounds.uncheck()
    until(page, lambda: changed(still, picture(page)) < 0.001)
    choose(page, "lattice")
    until(page, lambda: not rounds.is_visible())


@pytest.mark.nightly
def test_a_footprint_is_to_scale_before_and_in_a_simulation_in_ticks(page: Any, address: str) -> None:
    """A planner on cells: the robot at both ends of its path, and in the direction of its steps."""
    box = {"rectangle": [0.9, 0.5]}
    page.goto("about:blank")
    page.goto(link(address, planner={"name": "astar", "settings": {}}, obstacles=[], robot=box))
    page.get_by_role("tab", name="Planner").click()
    until(page, lambda: "Gap" in page.locator("#status").inner_text())
    wide = picture(page)
    page.get_by_label("shape", exact=True).select_option("disc")
    until(page, lambda: in_address(page)["robot"] == {})
    until(page, lambda: changed(wide, picture(page)) > 0.001)
    page.keyboard.press("Control+z")
    until(page, lambda: in_address(page)["robot"] == box)
    page.get_by_role("button", name="Play", exact=True).click()
    until(page, lambda: page.get_by_role("button", name="Play again").is_visible())
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("Home")
    begun = picture(page)
    page.keyboard.press("PageUp")
    assert changed(begun, picture(page)) > 0.001


@pytest.mark.nightly
def test_a_robot_that_drives_again_is_not_said_to_wait(page: Any, address: str) -> None:
    """The sentence of an event stays for a second, but not beside a speed that contradicts it."""
    car = {"rectangle": [0.9, 0.5], "drive": "ackermann", "turn_radius": 0.8}
    opened(page, address, robot=car, obstacles=[{"kind": "random-walk", "count": 3}])
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("End")
    until(page, lambda: page.locator('#status dt:text-is("Took")').count() == 1)
    page.keyboard.press("Home")
    for _ in range(3):
        page.keyboard.press("PageUp")
    said = set()
    for _ in range(80):
        page.keyboard.press("ArrowRight")
        page.wait_for_timeout(120)  # what is seen changes ten times a second
        sentence, speed = page.inner_text("#status .st-now"), page.inner_text(".st-speed b").split()[0]
        said.add((sentence.startswith("The robot waits"), float(speed) > 0))
    assert (True, False) in said
    assert (True, True) not in said
    assert (False, True) in said
