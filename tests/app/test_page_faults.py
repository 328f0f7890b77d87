"""What fails or comes late in the middle of something: nothing on the screen is ever of another scenario."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import aim, click, draw, fact, in_address, moment, until

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium

ACROSS = [(24, 12), (49, 12)]
"""Through the way on env-3, far behind its first ticks."""


@pytest.fixture
def wrong() -> list[str]:
    """What the page complains of; tests that break something expect a refusal."""
    return []


@pytest.fixture
def tab(browser: Any, address: str, wrong: list[str]) -> Any:
    """The page, whose refused requests are no fault."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    made = context.new_page()
    made.on("pageerror", lambda fault: wrong.append(str(fault)))
    made.goto(address)
    made.locator("#status").get_by_text("found").first.wait_for()
    yield made
    context.close()
    assert not wrong


def refuse(tab: Any, glob: str, times: int = 1000) -> None:
    """Answer as a busy server does."""
    fault = {"error": {"code": "BUSY", "what": "2 jobs run and 8 wait", "todo": "try again"}}
    tab.route(
        glob,
        lambda route: route.fulfill(status=429, body=json.dumps(fault), content_type="application/json"),
        times=times,
    )


def stand(tab: Any) -> int:
    """Run, and stand still after some ticks."""
    tab.keyboard.press("r")
    tab.locator("#status dd").get_by_text(re.compile("^([4-9]|1[0-9]) of")).first.wait_for()
    tab.keyboard.press("Space")
    tab.get_by_role("button", name="Play", exact=True).wait_for()
    return moment(tab)


@pytest.mark.nightly
def test_a_run_that_cannot_be_made_again_ends_before_the_wall(tab: Any) -> None:
    stood = stand(tab)
    refuse(tab, "**/api/simulate")
    tab.keyboard.press("b")
    draw(tab, ACROSS)
    tab.locator("#status").get_by_text("since then a wall was painted").first.wait_for()
    tab.locator("#notes").get_by_text("2 jobs run").wait_for()
    assert moment(tab) == stood
    tab.keyboard.press("End")
    assert moment(tab) == stood, "nothing is shown of what would go through the wall"
    # A second wall comes at the same moment, not at the start; playing asks again.
    draw(tab, [(2, 40), (6, 40)])
    (edit,) = in_address(tab)["edits"]
    assert edit["tick"] == stood + 1
    tab.unroute("**/api/simulate")
    tab.get_by_role("button", name=re.compile("^Play")).first.click()
    until(tab, lambda: moment(tab) > stood + 2)
    tab.keyboard.press("End")
    tab.locator("#status dt").get_by_text("Outcome").wait_for()
    assert fact(tab, "Outcome")


@pytest.mark.nightly
def test_the_old_run_is_not_looked_at_while_the_new_one_is_waited_for(tab: Any) -> None:
    stood = stand(tab)
    held: list[Any] = []
    tab.route("**/api/simulate", lambda route: held.append(route))
    tab.keyboard.press("b")
    draw(tab, ACROSS)
    until(tab, lambda: bool(held))
    tab.keyboard.press("End")
    assert moment(tab) == stood
    held[0].continue_()
    tab.unroute("**/api/simulate")
    until(tab, lambda: "+" not in tab.inner_text("#timeline output"))
    tab.keyboard.press("End")
    assert moment(tab) > stood


def late(tab: Any, glob: str) -> Callable[[], None]:
    """Hold back what is asked of there, until it is let go."""
    held: list[Any] = []
    tab.route(glob, lambda route: held.append(route))

    def go() -> None:
        until(tab, lambda: bool(held))
        for one in held:
            one.continue_()
        tab.unroute(glob)

    return go


@pytest.mark.nightly
def test_the_last_map_that_was_clicked_is_the_one_that_comes(tab: Any) -> None:
    go = late(tab, "**/api/maps/env-5")
    tab.get_by_role("button", name="env-5").click()
    tab.get_by_role("button", name="env-1 ").click()
    tab.locator("#where").get_by_text("env-1").wait_for()
    go()
    tab.wait_for_timeout(400)
    assert tab.inner_text("#where b") == "env-1"
    assert in_address(tab)["map"] == "env-1"


@pytest.mark.nightly
def test_a_stroke_ends_where_its_map_does(tab: Any) -> None:
    go = late(tab, "**/api/maps/env-5")
    tab.get_by_role("button", name="env-5").click()
    tab.keyboard.press("b")
    tab.mouse.move(*aim(tab, (1, 40)))
    tab.mouse.down()
    tab.mouse.move(*aim(tab, (4, 40)), steps=3)
    go()
    tab.locator("#where").get_by_text("env-5").wait_for()
    tab.mouse.move(*aim(tab, (9, 40)), steps=5)
    tab.mouse.up()
    now = in_address(tab)
    assert (now["map"], now["edits"]) == ("env-5", [])


@pytest.mark.nightly
def test_a_map_that_is_not_there_is_not_taken_for_the_one_before(tab: Any, address: str) -> None:
    click(tab, (4, 4))
    refuse(tab, "**/api/maps/env-5", times=1)
    tab.goto("about:blank")  # else it is another address of the page that is there: see the next test
    tab.goto(re.sub("m=.*", "m=nosuch", address))
    tip = tab.locator("#tip")
    tip.get_by_text("The map cannot be opened").wait_for()
    assert "nosuch" in tip.inner_text()
    click(tab, (20, 20))  # nothing to click on
    tab.keyboard.press("Control+z")
    tab.locator("#where").get_by_text("env-3").wait_for()
    assert in_address(tab)["goal"] == [4, 4]
    tab.keyboard.press("Control+Shift+z")
    tip.get_by_text("The map cannot be opened").wait_for()
    tab.get_by_role("button", name="env-1 ").click()
    tab.locator("#where").get_by_text("env-1").wait_for()
    tab.locator("#status").get_by_text("found").first.wait_for()
    assert "cannot" not in tip.inner_text()


@pytest.mark.nightly
def test_an_address_with_another_map_is_followed_in_the_same_tab(tab: Any, address: str) -> None:
    """It was left alone, and written over."""
    click(tab, (4, 4))
    tab.get_by_role("button", name="Paint walls").click()
    draw(tab, [(20, 45), (26, 45)])
    drawn = in_address(tab)
    tab.goto(re.sub("m=.*", "m=env-1", address))
    tab.locator("#notes").get_by_text("one undo away").wait_for()
    tab.locator("#where").get_by_text("env-1").wait_for()
    tab.locator("#status").get_by_text("found").first.wait_for()
    assert in_address(tab)["map"] == "env-1"
    draw(tab, [(2, 2), (8, 2)])
    other = in_address(tab)
    assert other["edits"]
    tab.goto(re.sub("m=.*", "m=env-1", address))
    assert in_address(tab) == other, "on the same map what is there stays"
    for _ in range(2):
        tab.keyboard.press("Control+z")
    tab.locator("#where").get_by_text("env-3").wait_for()
    assert in_address(tab) == drawn
