"""Planners of poses in the page: footprints, handles that set headings, scenarios."""

from __future__ import annotations

import math
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import aim, fact, in_address, until
from test_page_hands import address, page, tab, wrong

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


def test_poses_are_not_simulated_and_the_page_says_so(page: Any) -> None:
    """Play says what to do instead; another planner forgets nothing and takes cells again."""
    choose(page, "lattice")
    until(page, lambda: "Length" in page.locator("#status").inner_text())
    page.get_by_role("button", name="Play").first.click()
    until(page, lambda: "not simulated in ticks" in page.locator("body").inner_text())
    choose(page, "astar")
    until(page, lambda: "Cost" in page.locator("#status").inner_text())
