"""What the page says to wrong deeds: what is wrong, with its place and value, and what to do about it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium

import lampyris
from sizes import sized

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium

GOOD = {
    "version": 1, "map": "env-3", "start": [28, 7], "goal": [26, 26], "preset": "robot", "seed": 0,
    "planner": {"name": "ad-gso", "settings": {}}, "obstacles": [], "edits": [],
}  # fmt: skip
ROS = b"""image: far.png
resolution: 0.05
origin: [0, 0, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.2
"""
BOX = [[x, y] for x in range(24, 30) for y in range(22, 30) if x in (24, 29) or y in (22, 29)]

PLANS: dict[str, tuple[dict[str, Any], str, str]] = {
    "start on a wall": ({"start": [12, 1]}, "The start (12, 1) is blocked", "Drag S to a free cell"),
    "goal walled in": (
        {"edits": [{"tick": 0, "blocked": BOX, "freed": []}]},
        "walls separate (28, 7) from (26, 26)",
        "Erase a wall",
    ),
    "robot too large": ({"robot": {"radius": 3}}, "the robot's radius is 3 m", "make the robot smaller"),
    "goal on a wall": ({"goal": [12, 1]}, "The goal (12, 1) is blocked", "Drag G to a free cell"),
    "start outside": ({"start": [99, 1]}, "(99, 1) is outside the map (allowed: x 0 to 49", "Undo"),
    "no such planner": ({"planner": "nobody"}, "no planner is called 'nobody' (allowed: ad-gso", "Undo"),
    "setting out of range": (
        {"planner": {"name": "ad-gso", "settings": {"nt": 0}}},
        "nt 0 (allowed: a whole number from 1 to 10,000)",
        "Undo",
    ),
    "too few iterations": (
        {"planner": {"name": "ad-gso", "settings": {"iter_max": 1}}},
        "iter_max",
        "more iterations",
    ),
}

FILES: dict[str, tuple[str, bytes, str]] = {
    "no map": ("thing.pdf", b"%PDF-1.4 nothing", "thing.pdf: this is PDF (allowed: PNG"),
    "ROS map without its picture": (
        "m.yaml",
        ROS,
        "open m.yaml and far.png together",
    ),
    "scenario of no map": ("s.json", b'{"version": 1, "map": "nowhere"}', "nowhere: there is no such map"),
    "empty": ("empty.png", b"", "empty.png: the file is empty"),
    "cut picture": ("cut.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0", "cut.png: the "),
    "words": ("notes.txt", b"#..\nhello\n", "notes.txt: line 2 "),
    "no scenario": ("some.json", b'{"width": 3}', "some.json"),
}


@pytest.fixture(scope="module")
def address(shared_library: str) -> str:
    """Of the app whose library is written to."""
    return shared_library


def choose(page: Any, name: str, content: bytes, folder: Path) -> None:
    """As if this file had been dropped."""
    file = folder / name
    file.write_bytes(content)
    page.set_input_files("#library input[type=file]", str(file))


def said(page: Any, words: str, where: str) -> str:
    """The text there once it has these words."""
    found = page.locator(where, has_text=words).last
    found.wait_for()
    text: str = found.inner_text()
    assert "Traceback" not in text
    assert "undefined" not in text
    return text


@sized("many", 1, len(PLANS))
def test_a_scenario_that_cannot_be_planned_says_why_and_what_to_do(
    quiet: Any, tmp_path: Path, many: int
) -> None:
    for what, (change, words, remedy) in [*PLANS.items()][:many]:
        choose(quiet, "s.json", json.dumps({**GOOD, **change}).encode(), tmp_path)
        said(quiet, words, "#status .st-now")
        assert remedy in quiet.inner_text("#status .st-next"), what
        # A good one on the same map is planned anew.
        choose(quiet, "s.json", json.dumps(GOOD).encode(), tmp_path)
        said(quiet, "A path was found.", "#status .st-now")


@pytest.mark.nightly
def test_runs_that_do_not_arrive_say_what_to_change(page: Any, tmp_path: Path) -> None:
    short = {**GOOD, "simulate": {"ticks": 3, "patience": None}}
    choose(page, "s.json", json.dumps(short).encode(), tmp_path)
    page.locator("#notes >> text=The scenario is loaded.").first.wait_for()
    page.click("#timeline .main")
    said(page, "had not arrived at tick 3", "#status .st-now")
    assert "Allow more ticks" in page.inner_text("#status .st-next")


@pytest.mark.nightly
def test_what_was_weakened_is_said_of_plans_runs_and_comparisons(page: Any, tmp_path: Path) -> None:
    weak = "min_clearance 10 was weakened to 0 cells: no path to the goal keeps more"
    asked = {"name": "ad-gso", "settings": {"min_clearance": 10, "choice": "exact"}}
    assert not page.locator("#status .st-otherwise").is_visible()
    choose(page, "s.json", json.dumps({**GOOD, "map": "env-1", "start": [37, 8], "goal": [5, 38],
                                       "planner": asked}).encode(), tmp_path)  # fmt: skip
    assert said(page, weak, "#status .st-otherwise") == f"Not as asked: {weak}."
    page.click("#timeline .main")
    page.wait_for_selector("#status >> text=Replans so far")
    assert said(page, weak, "#status .st-otherwise") == f"Not as asked: {weak}."
    page.click("#tab-compare")
    page.get_by_role("button", name="Add ad-gso min_clearance").click()
    page.get_by_role("button", name="Compare", exact=True).click()
    page.wait_for_selector("#compare table.measures")
    assert weak in said(page, "was weakened", "#compare .otherwise")
    assert page.locator("#compare .otherwise").count() == 1


def test_fields_say_what_they_take(page: Any) -> None:
    page.click("#tab-traffic")
    field = page.get_by_label("Random walkers")
    for wrong in ("many", "99999", "-1", "1.5"):
        field.fill(wrong)
        page.keyboard.press("Tab")
        page.locator("#traffic", has_text="Allowed: a whole number, 0 to 10000.").wait_for()
        assert field.get_attribute("aria-invalid") == "true"
    field.fill("9000")
    page.keyboard.press("Tab")


@pytest.fixture
def quiet(browser: Any, address: str) -> Any:
    """A page whose refused requests are no faults: the browser writes each to its console."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")
    yield tab
    context.close()


@pytest.mark.nightly
@sized("many", 3, len(FILES))
def test_files_that_are_no_maps_say_which_and_why_and_change_nothing(
    quiet: Any, tmp_path: Path, many: int
) -> None:
    before = quiet.inner_text("#where")
    for name, content, words in [*FILES.values()][:many]:
        choose(quiet, name, content, tmp_path)
        said(quiet, words, "#notes .note.bad")
        for button in quiet.locator("#notes .note button").all():
            button.click()
    assert quiet.inner_text("#where") == before
    assert quiet.inner_text("#status .st-now") == "A path was found."


@pytest.mark.nightly
def test_more_obstacles_than_fit_are_counted(quiet: Any, tmp_path: Path) -> None:
    crowd = {**GOOD, "obstacles": [{"kind": "random-walk", "count": 9000}]}
    choose(quiet, "s.json", json.dumps(crowd).encode(), tmp_path)
    quiet.locator("#notes >> text=The scenario is loaded.").first.wait_for()
    quiet.click("#timeline .main")
    assert "ask for fewer" in said(quiet, "of 9000 random walkers fit", "#notes .note.bad")


def test_every_node_of_the_path_has_a_row(quiet: Any, tmp_path: Path) -> None:
    plain = {**GOOD, "preset": "dissertation", "map": "guide", "start": [0, 9], "goal": [7, 0]}
    choose(quiet, "s.json", json.dumps(plain).encode(), tmp_path)
    said(quiet, "A path was found.", "#status .st-now")
    quiet.click("#status summary:text-is('Every node of the path')")
    rows = quiet.locator("#status details table tbody tr")
    rows.first.wait_for()
    made = lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0), "dissertation")
    found = lampyris.plan(made)
    table = lampyris.node_table(made, found)
    assert rows.count() == len(found.cells)
    first = rows.nth(1).locator("td").all_inner_texts()
    assert first[:5] == [
        "({}, {})".format(*found.cells[1]),
        str(table.ring1[1]),
        str(table.ring2[1]),
        f"{table.obstacle_velocity[1]:g}",
        f"{table.angle_deg[1]:g}",
    ]
