"""What somebody sees who opens the page for the first time, presses Play, and draws (issue 24)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from page_browser import needs_chromium

from sizes import some

pytestmark = needs_chromium

HEARD = """
globalThis.heard = [];
const fill = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, ...where) {
  globalThis.heard.push(String(text));
  return fill.call(this, text, ...where);
};
"""
"""Writes down every text that is drawn on a canvas."""

OVER = """() => {
  const right = document.querySelector("#below").getBoundingClientRect().right;
  return [...document.querySelectorAll("#timeline :is(button, select, output, .tl-track)")]
    .filter((one) => one.getBoundingClientRect().right > right).map((one) => one.className);
}"""


@pytest.fixture
def tab(browser: Any, address: str) -> Iterator[Any]:
    """The page with a crowd on its map, in a wide window."""
    context = browser.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    made = context.new_page()
    wrong: list[str] = []
    made.on("pageerror", lambda fault: wrong.append(str(fault)))
    made.add_init_script(HEARD)
    made.goto(address)
    made.wait_for_selector("body.ready")
    made.wait_for_selector("#status >> text=found")
    yield made
    context.close()
    assert not wrong


def walkers(tab: Any, count: int) -> None:
    """Put random walkers on the map."""
    tab.get_by_role("tab", name="Traffic").click()
    tab.get_by_label("Random walkers").fill(str(count))
    tab.get_by_label("Random walkers").press("Enter")


def key(tab: Any, name: str) -> Any:
    """An entry of the map's key."""
    return tab.locator("#legend li").get_by_text(name, exact=True)


def cell(tab: Any, x: int, y: int) -> tuple[float, float]:
    """Pixels of a cell of env-3 on the page; the map is fitted, with 70 pixels beside it and 16 above."""
    box = tab.locator("#map").bounding_box()
    side = min(box["width"] - 140, box["height"] - 32)
    left, top = box["x"] + (box["width"] - side) / 2, box["y"] + (box["height"] - side) / 2
    return left + (x + 0.5) * side / 50, top + (y + 0.5) * side / 50


@pytest.mark.nightly
@pytest.mark.parametrize("width", some([821, 1023, 834, 900, 1000]))
def test_the_timeline_has_room_in_every_window(tab: Any, width: int) -> None:
    tab.set_viewport_size({"width": width, "height": 800})
    for _ in range(2):  # before a run, and with one
        assert tab.evaluate(OVER) == []
        tab.get_by_role("button", name="Play").click()
        tab.locator("#status dt").get_by_text("Tick").wait_for()
    assert tab.locator("#map").bounding_box()["width"] >= 300
    learn = tab.get_by_role("tab", name="Learn").bounding_box()
    assert learn["x"] + learn["width"] <= width


@pytest.mark.nightly
def test_the_key_tells_who_waits_and_the_gates(tab: Any) -> None:
    walkers(tab, 5)
    key(tab, "random walker (W)").wait_for()  # before any run
    tab.get_by_role("checkbox", name="Gates").check()
    key(tab, "gate on the path").wait_for()
    key(tab, "gate").wait_for()
    tab.get_by_role("checkbox", name="Gates").uncheck()
    key(tab, "gate").wait_for(state="detached")


@pytest.mark.nightly
def test_nothing_between_is_not_called_contact(tab: Any) -> None:
    """Zero is the free distance of cells side by side; the referee refuses a shared cell."""
    walkers(tab, 200)
    tab.get_by_role("button", name="Play").click()
    tab.wait_for_function("() => heard.includes('0: adjacent')")
    assert not tab.evaluate("() => heard.filter((one) => /contact|referee/.test(one))")
    assert tab.locator("#charts figcaption").nth(1).text_content().startswith("Free distance, m")


@pytest.mark.nightly
def test_a_click_draws_no_frame_round_the_map_and_a_key_does(tab: Any) -> None:
    def frame() -> str:
        found: str = tab.evaluate("() => getComputedStyle(document.querySelector('#map')).outlineStyle")
        return found

    for at in ((20, 30), (30, 30)):
        tab.mouse.click(*cell(tab, *at))
        assert tab.evaluate("() => document.activeElement.id") == "map"
        assert frame() == "none"
    tab.keyboard.press("ArrowLeft")
    assert frame() == "solid"
    tab.mouse.click(*cell(tab, 20, 30))
    assert frame() == "none"


def test_play_without_a_path_says_why_and_makes_no_run(tab: Any) -> None:
    """Walls all round the goal, by a scenario that is opened: a run of one tick was shown."""
    walls = [[25, 25], [26, 25], [27, 25], [25, 26], [27, 26], [25, 27], [26, 27], [27, 27]]
    scenario = {
        "version": 1, "map": "env-3", "start": [1, 1], "goal": [26, 26],
        "edits": [{"tick": 0, "blocked": walls, "freed": []}],
    }  # fmt: skip
    with tab.expect_file_chooser() as chooser:
        tab.get_by_role("button", name="Open files").click()
    body = json.dumps(scenario).encode()
    chooser.value.set_files([{"name": "shut.json", "mimeType": "application/json", "buffer": body}])
    tab.locator("#status").get_by_text("walls separate").first.wait_for()
    tab.get_by_role("button", name="Play").click()
    tab.locator("#notes").get_by_text("There is nothing to play.").wait_for()
    assert tab.locator(".tl-where").text_content() == "not run yet"
    assert tab.locator("#charts .ch-empty").is_visible()


WALL = """([x, y]) => {
  const map = document.querySelector("#map");
  const box = map.getBoundingClientRect();
  const ratio = map.width / box.width;
  const data = map.getContext("2d").getImageData((x - box.x) * ratio - 3, (y - box.y) * ratio - 3, 6, 6).data;
  const tones = new Set();
  for (let k = 0; k < data.length; k += 4) tones.add(`${data[k]},${data[k + 1]},${data[k + 2]}`);
  return [...tones];
}"""


@pytest.mark.nightly
def test_a_patrol_is_drawn_round_a_wall(tab: Any) -> None:
    """Waypoints on both sides of the wall of column 30: its cells in between stay as dark as walls are."""
    tab.get_by_role("button", name="Patrol").click()
    for at in ((20, 5), (36, 5)):
        tab.mouse.click(*cell(tab, *at))
    between = [tab.evaluate(WALL, list(cell(tab, 30, y))) for y in (4, 5, 6)]
    assert between == [["32,36,44"]] * 3, "while it is drawn"
    tab.keyboard.press("Enter")
    key(tab, "patrol (P)").wait_for()
    between = [tab.evaluate(WALL, list(cell(tab, 30, y))) for y in (4, 5, 6)]
    assert between == [["32,36,44"]] * 3
