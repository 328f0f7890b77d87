"""A server that is killed: the page says so, keeps what was drawn, and continues with the next one."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_browser import app, needs_chromium
from page_person import click, draw, fact, in_address, moment, until

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [needs_chromium, pytest.mark.nightly]


@pytest.fixture
def context(browser: Any) -> Iterator[Any]:
    """A browser that was never here."""
    made = browser.new_context(viewport={"width": 1280, "height": 720})
    yield made
    made.close()


@pytest.fixture
def port() -> int:
    """A free one."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        found: int = free.getsockname()[1]
        return found


def ready(page: Any) -> None:
    page.locator("#status").get_by_text(
        re.compile("found|drives|stands|slowed|speeds|waits|arrived")
    ).first.wait_for()


def is_gone(page: Any, port: int) -> None:
    """The page says by itself that nobody answers, and how to go on."""
    page.get_by_role("alert").get_by_text(f"lampyris app --port {port}").wait_for()


def furnish(page: Any) -> dict[str, Any]:
    """Draw some of everything: ends, walls, a crowd, a patrol."""
    page.get_by_role("button", name="env-3", exact=False).click()
    page.locator("#where").get_by_text("env-3").wait_for()
    page.keyboard.press("v")
    click(page, (4, 4))
    page.keyboard.press("n")
    click(page, (45, 46))
    page.get_by_role("button", name="Paint walls").click()
    draw(page, [(1, 40), (8, 40)])
    page.get_by_role("button", name="Draw a patrol").click()
    click(page, (27, 33))
    click(page, (27, 36))
    page.get_by_role("button", name="Place this patrol").click()
    page.get_by_role("tab", name="Traffic").click()
    page.get_by_label("Random walkers").fill("9")
    page.keyboard.press("Tab")
    page.get_by_text("A path was found.").first.wait_for()
    drawn = in_address(page)
    assert [one["kind"] for one in drawn["obstacles"]] == ["patrol", "random-walk"]
    assert len(drawn["edits"][0]["blocked"]) > 5
    return drawn


def test_a_server_killed_in_the_middle_of_a_run(context: Any, port: int, tmp_path: Path) -> None:
    page = context.new_page()
    with app(tmp_path, port=port) as address:
        page.goto(address)
        ready(page)
        drawn = furnish(page)
        page.get_by_role("button", name="Play", exact=True).click()
        page.locator("#status dd").get_by_text(re.compile("^(1[0-9]) of")).wait_for()
    is_gone(page, port)
    page.get_by_role("button", name="Pause").or_(
        page.get_by_role("button", name="Play", exact=True)
    ).first.click()
    stood = moment(page)

    # Offline: a wall at that moment.
    page.get_by_role("button", name="Paint walls").click()
    draw(page, [(33, 5), (40, 5)])
    painted = in_address(page)
    assert painted["edits"][0] == drawn["edits"][0]
    assert painted["edits"][1]["tick"] >= stood
    with app(tmp_path, port=port) as address:
        page.goto(address)
        page.get_by_role("alert").wait_for(state="hidden")
        assert in_address(page) == painted, "nothing that was drawn is lost"
        page.get_by_role("combobox", name="Speed of play").select_option("50×")
        page.get_by_role("button", name="Play", exact=True).click()
        page.get_by_role("button", name="Play again").wait_for()
        assert fact(page, "Outcome")
        assert page.locator("#status li").filter(has_text="cells turned into walls").count() == 1
        assert int(fact(page, "Tick").split()[0]) > stood


def test_a_run_that_was_still_coming_goes_on_by_itself(context: Any, port: int, tmp_path: Path) -> None:
    page = context.new_page()
    with app(tmp_path, "office-400", port=port) as address:
        page.goto(address)
        ready(page)
        page.get_by_role("tab", name="Traffic").click()
        page.get_by_label("Random walkers").fill("400")
        page.keyboard.press("Tab")
        page.get_by_role("button", name="Play", exact=True).click()
        page.locator("#timeline output").get_by_text(re.compile(r"^[2-9]\.\d s / .*[+]$")).wait_for()
    is_gone(page, port)
    # A tick of this map is a second.
    reached = float(page.inner_text("#timeline output").split(" / ")[1].split()[0])
    with app(tmp_path, "office-400", port=port) as address:
        page.goto(address)
        page.get_by_role("alert").wait_for(state="hidden")
        # More may have come than was played.
        page.get_by_role("combobox", name="Speed of play").select_option("50×")
        until(page, lambda: moment(page) > reached + 3)
        page.get_by_role("button", name="Pause").wait_for()


def test_a_tab_that_was_closed_meanwhile(context: Any, port: int, tmp_path: Path) -> None:
    page = context.new_page()
    with app(tmp_path, "env-3", port=port) as address:
        page.goto(address)
        ready(page)
        furnish(page)
    # Idle and offline: the page hears of it by itself; what is painted then is kept too.
    is_gone(page, port)
    page.get_by_role("button", name="Paint walls").click()
    draw(page, [(20, 45), (26, 45)])
    drawn = in_address(page)
    assert len(drawn["edits"][0]["blocked"]) > 12
    page.close()
    with app(tmp_path, "env-3", port=port) as address:
        page = context.new_page()
        page.goto(address)
        ready(page)
        assert in_address(page) == drawn, "the map that was asked for is the one that was drawn on"
        page.get_by_role("tab", name="Traffic").click()
        assert page.get_by_label("Random walkers").input_value() == "9"
        page.get_by_text("patrol from (27,33), 2 cells").wait_for()
        page.get_by_role("button", name="Play", exact=True).click()
        page.locator("#status dd").get_by_text(re.compile("^[3-9] of")).wait_for()
        page.close()
    with app(tmp_path, "env-5", port=port) as address:
        page = context.new_page()
        page.goto(address)
        page.locator("#where").get_by_text("env-5").wait_for()
        page.get_by_role("button", name="Undo").click()
        page.locator("#where").get_by_text("env-3").wait_for()
        assert in_address(page) == drawn, "on another map it is one undo away"


def test_the_next_start_s_map_does_not_take_the_place_of_what_was_drawn(
    context: Any, port: int, tmp_path: Path
) -> None:
    """The address of a start names the map that it was given, whatever has been chosen since."""
    page = context.new_page()
    with app(tmp_path, "env-5", port=port) as address:
        page.goto(address)
        ready(page)
        drawn = furnish(page)
    is_gone(page, port)
    with app(tmp_path, "env-5", port=port) as address:
        page.goto(address)
        page.get_by_role("alert").wait_for(state="hidden")
        assert in_address(page) == drawn
        page.reload()
        ready(page)
        assert in_address(page) == drawn


def test_an_old_tab_that_is_loaded_again(context: Any, port: int, tmp_path: Path) -> None:
    page = context.new_page()
    with app(tmp_path, port=port) as address:
        page.goto(address)
        ready(page)
        drawn = furnish(page)
    with app(tmp_path, port=port) as address:
        page.reload()
        page.get_by_role("alert").get_by_text("Open the address that it printed").wait_for()
        page.goto(address)
        ready(page)
        page.get_by_role("alert").wait_for(state="hidden")
        assert in_address(page) == drawn
