"""What is shown before a run, and what a file of it will show."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import in_address, later, until
from PIL import Image

pytestmark = [needs_chromium, pytest.mark.nightly]
CROWD = [{"kind": "random-walk", "count": 12}]


@pytest.fixture(scope="module")
def address(shared_library: str) -> str:
    """Of the app whose library is written to."""
    return shared_library


def opened(page: Any, scenario: dict[str, Any], tmp_path: Path) -> None:
    """Open a scenario by dropping its file."""
    file = tmp_path / "one.json"
    file.write_text(json.dumps(scenario))
    page.locator("input[type=file]").first.set_input_files(str(file))
    page.wait_for_selector("#notes >> text=The scenario is loaded")
    later(page, 400)


def picture(page: Any) -> bytes:
    """The map without the notes above it: they go after five seconds, however slow the machine is."""
    page.evaluate("document.getElementById('notes').style.opacity = 0")
    found: bytes = page.locator("#map").screenshot()
    return found


def settled(page: Any) -> bytes:
    """The map once it is drawn: the same four times in a row."""
    last, same = b"", 0
    for _ in range(600):
        now = picture(page)
        same = same + 1 if now == last else 0
        last = now
        if same == 3:
            return now
        page.wait_for_timeout(100)
    raise AssertionError("the map is drawn for ever")


def test_obstacles_are_seen_before_the_run_and_go_when_they_are_taken_away(page: Any, tmp_path: Path) -> None:
    own = in_address(page)
    # There and back once before: what is drawn late after the page was opened is then there for good.
    for crowd in ([], CROWD, []):
        opened(page, {**own, "obstacles": crowd}, tmp_path)
    empty = settled(page)
    opened(page, {**own, "obstacles": CROWD}, tmp_path)
    until(page, lambda: picture(page) != empty)
    opened(page, {**own, "obstacles": []}, tmp_path)
    until(page, lambda: picture(page) == empty)


def test_a_picture_has_the_layer_that_is_shown_and_the_page_says_what_it_will_show(page: Any) -> None:
    page.click("#tab-keep")
    says = page.locator("#keep-shows")
    assert "without a layer" in says.inner_text()
    asked: list[Any] = []
    page.on("request", lambda one: asked.append(one.post_data_json) if "export" in one.url else None)
    shown = ("without a layer", "with luciferin beneath", "with cost beneath", "not clearance")
    for layer, said in zip(("None", "Luciferin", "Cost", "Clearance"), shown, strict=True):
        # Its radio is in a panel that may be folded away; a person would unfold it.
        page.locator("#layers label").filter(has_text=layer).locator("input").dispatch_event("click")
        page.wait_for_selector(f"#keep-shows:has-text('{said}')")
        with page.expect_download() as file:
            page.get_by_role("button", name="PNG", exact=True).click()
        Image.open(BytesIO(Path(file.value.path()).read_bytes())).verify()
    assert [one["settings"]["layer"] for one in asked] == ["none", "luciferin", "cost", "none"]


def test_a_deleted_map_can_be_brought_back(page: Any, tmp_path: Path) -> None:
    Image.new("L", (9, 7), 255).save(tmp_path / "attic.png")
    page.locator("input[type=file]").first.set_input_files(str(tmp_path / "attic.png"))
    card = page.locator(".map-card", has_text="attic")
    card.wait_for()
    page.get_by_role("button", name="Delete the map attic.png").click()
    page.get_by_role("button", name="Bring back attic.png").wait_for()
    assert card.count() == 0
    page.get_by_role("button", name="Bring back attic.png").click()
    card.wait_for()
    assert page.get_by_role("button", name="Bring back attic.png").count() == 0
