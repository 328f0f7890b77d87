"""What the app shows to who opens it for the first time, and its tour; not without chromium."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from page_browser import needs_chromium

from lampyris.app.server.opening import recorded_answers

pytestmark = needs_chromium


@pytest.fixture
def first(address: str, browser: Any) -> Iterator[Any]:
    """A tab of a new browser, at the address of an app that was started without a map."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    tab = context.new_page()
    tab.goto(address.partition("&m=")[0])
    yield tab
    context.close()


def test_what_the_page_asks_at_first_is_what_is_recorded(address: str, browser: Any) -> None:
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    tab = context.new_page()
    asked: dict[str, Any] = {}

    def note(request: Any) -> None:
        if request.method == "POST":
            asked.setdefault(request.url.rpartition("/")[2], json.loads(request.post_data))

    tab.on("request", note)
    tab.goto(address.partition("&m=")[0])
    tab.locator(".st-cause", has_text="moving obstacle").wait_for()
    context.close()
    for verb, held in recorded_answers().items():
        given = {key: value for key, value in asked[verb].items() if value is not None}
        assert given == held.question, f"{verb}: run python tools/app_opening.py"


def test_it_opens_on_a_robot_that_brakes_for_somebody_and_a_draft_comes_before_that(first: Any) -> None:
    first.locator(".st-cause", has_text="moving obstacle").wait_for()  # nothing was pressed
    assert re.fullmatch(r"[\d.]+ s / [\d.]+ s", first.inner_text(".tl-where"))
    assert first.get_by_label("Luciferin", exact=True).is_checked()
    assert first.locator("#welcome").is_visible()
    assert "m" in first.inner_text("#stage .scale")
    first.get_by_role("button", name="Take the tour").click()
    for title in ("Drag the goal", "Paint a wall", "Read why", "Race planners", "Export"):
        first.locator("#first-steps h2", has_text=title).wait_for()
        first.locator("#first-steps .btn.primary").click()
    first.locator("#first-steps").wait_for(state="detached")
    first.get_by_role("button", name=re.compile("^guide")).click()
    first.locator("#where").get_by_text("guide").wait_for()
    address = first.url.partition("&s=")[0]
    first.goto("about:blank")
    first.goto(address)
    first.locator("#where").get_by_text("guide").wait_for()
