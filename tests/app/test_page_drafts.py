"""Drafts and links: what was drawn is kept for its tab, for tabs to come, and in the address of any of it."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Iterator
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import click, draw, in_address, later

from sizes import some

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium


@pytest.fixture
def context(browser: Any) -> Iterator[Any]:
    """A browser that was never here."""
    made = browser.new_context(viewport={"width": 1280, "height": 720})
    yield made
    made.close()


def opened(context: Any, address: str, map_: str = "env-3", words: str = "found") -> Any:
    """A new tab with the page on a map."""
    page = context.new_page()
    page.goto(re.sub("m=[a-z0-9-]+", f"m={map_}", address))
    page.locator("#status").get_by_text(words).first.wait_for()
    return page


def with_scenario(address: str, made: dict[str, Any]) -> str:
    """The address of a scenario."""
    pack = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = pack.compress(json.dumps(made).encode()) + pack.flush()
    return address.split("&")[0] + "&s=" + base64.urlsafe_b64encode(packed).decode().rstrip("=")


def wall(page: Any) -> None:
    """Paint some wall."""
    page.get_by_role("button", name="Paint walls").click()
    draw(page, [(1, 40), (8, 40)])


@pytest.mark.nightly
def test_looking_at_another_map_does_not_take_the_place_of_a_drawing(context: Any, address: str) -> None:
    page = opened(context, address)
    wall(page)
    drawn = in_address(page)
    page.close()
    # Twice elsewhere, nothing changed there: the drawing is still what was done last.
    opened(context, address, "env-5").close()
    page = opened(context, address, "env-5")
    page.wait_for_timeout(450)
    page.close()
    page = opened(context, address)
    assert in_address(page) == drawn


@pytest.mark.nightly
def test_each_tab_has_a_draft_of_its_own(context: Any, address: str) -> None:
    page = opened(context, address)
    wall(page)
    drawn = in_address(page)
    other = opened(context, address, "env-5")
    click(other, (3, 3))
    assert in_address(other)["map"] == "env-5"
    # As after a start of the server whose address holds nothing but the token.
    page.evaluate("history.replaceState(null, '', location.hash.split('&')[0])")
    page.reload()
    page.locator("#status").get_by_text("found").first.wait_for()
    assert in_address(page) == drawn


CHECKED = [[x, y] for y in range(100, 400) for x in range(y % 2, 512, 2)]


@pytest.mark.nightly
@pytest.mark.parametrize("runs", [False, True])
def test_large_drawings_are_in_the_address(context: Any, address: str, runs: bool) -> None:
    """Old links list the cells, ours write runs within rows; both are read, and what is written is short."""
    cells: Any = CHECKED
    if runs:
        row = [0, 0, 1, *[0, 1, 1] * 255]
        cells = {"rows": [100, *row[1:], *([1, 1, *row[2:], 1, *row[1:]] * 150)[: -len(row)]]}
    made = {
        "version": 1, "map": "random-512", "start": [3, 3], "goal": [40, 40],
        "edits": [{"tick": 0, "blocked": cells, "freed": []}],
    }  # fmt: skip
    page = context.new_page()
    page.goto(with_scenario(address, made))
    page.locator("#where").get_by_text("random-512").wait_for()
    later(page, 900)
    assert in_address(page)["edits"][0]["blocked"] == CHECKED
    assert len(page.url) < 4_000, "runs are short"


@pytest.mark.nightly
def test_an_address_that_cannot_hold_it_says_so_and_the_tab_keeps_it(context: Any, address: str) -> None:
    page = opened(context, address)
    wall(page)
    drawn = in_address(page)
    page.close()
    page = context.new_page()

    def short(route: Any) -> None:
        text = route.fetch().text()
        assert "LONGEST=500_000" in text
        route.fulfill(body=text.replace("LONGEST=500_000", "LONGEST=80"), content_type="text/javascript")

    page.route("**/state.js", short)
    page.goto(address)
    page.locator("#status").get_by_text("found").first.wait_for()
    click(page, (3, 30))
    page.locator("#notes").get_by_text("too large for the address").wait_for()
    assert "s=" not in page.url
    assert "m=" not in page.url
    page.unroute("**/state.js")
    page.reload()
    page.locator("#status").get_by_text("found").first.wait_for()
    assert in_address(page)["edits"] == drawn["edits"]
    assert in_address(page)["goal"] == [3, 30]


@pytest.mark.nightly
@pytest.mark.parametrize("rows", some([[1, 2, 1e12], [1, 2, None], [0, 0, 1 << 22, 1, 0, 1]]))
def test_a_damaged_drawing_is_a_sentence(context: Any, address: str, rows: list[Any]) -> None:
    page = context.new_page()
    edit = {"tick": 0, "blocked": {"rows": rows}, "freed": []}
    page.goto(with_scenario(address, {"version": 1, "map": "env-3", "edits": [edit]}))
    page.locator("#notes").get_by_text("The link is damaged").wait_for()


@pytest.mark.nightly
def test_who_comes_for_the_first_time_sees_something_move_and_another_map_is_empty(
    context: Any, address: str
) -> None:
    page = opened(context, re.sub("&m=.*", "", address), "office", "The robot")
    made = in_address(page)
    assert {one["kind"] for one in made["obstacles"]} == {"patrol"}
    assert made["drive"]
    page.get_by_role("button", name="env-5").click()
    page.locator("#where").get_by_text("env-5").wait_for()
    made = in_address(page)
    assert (made["obstacles"], made["robot"], made.get("drive")) == ([], {}, None)
    page.close()
    # Who asks for a map has it as it is.
    assert in_address(opened(context.browser.new_context(), address))["obstacles"] == []
