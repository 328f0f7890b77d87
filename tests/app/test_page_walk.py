"""One walk through the app, as a person would take it: the controls that are seen, a mouse, files."""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import Cell, aim, changed, click, draw, fact, in_address, moment, picture
from PIL import Image

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium

ROS = (
    "image: {}\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
    "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
)
DROP = """files => {
  const all = new DataTransfer();
  for (const [name, hex] of files) {
    const bytes = Uint8Array.from(hex.match(/../g) ?? [], pair => parseInt(pair, 16));
    all.items.add(new File([bytes], name));
  }
  return all;
}"""


@pytest.fixture(scope="module")
def address(shared_library: str) -> str:
    """Of the app whose library is written to, on another map."""
    return re.sub("m=[^&]*", "m=guide", shared_library)


@pytest.fixture
def wrong() -> list[str]:
    """What the page complains of."""
    return []


@pytest.fixture
def page(browser: Any, address: str, wrong: list[str]) -> Iterator[Any]:
    """The page in a browser that was never here and whose clipboard it may use."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab = context.new_page()
    tab.on("pageerror", lambda fault: wrong.append(str(fault)))
    tab.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    tab.goto(address)
    tab.get_by_text("A path was found.").first.wait_for()
    yield tab
    context.close()
    assert not wrong


def play_to_the_end(page: Any) -> None:
    page.get_by_role("combobox", name="Speed of play").select_option("50×")
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Play again").wait_for()


def save(page: Any, what: str, into: Path) -> Path:
    """Press one of the buttons of Export, and keep what the browser saves."""
    with page.expect_download() as coming:
        page.get_by_role("button", name=what, exact=True).click()
    file = into / coming.value.suggested_filename
    coming.value.save_as(file)
    page.get_by_text(f"Saved {file.name}").wait_for()
    return file


def part(page: Any, a: Cell, b: Cell) -> tuple[int, int, int, int]:
    """The pixels of the picture from one cell to another."""
    box = page.locator("#map").bounding_box()
    (left, top), (right, bottom) = aim(page, a), aim(page, b)
    return int(left - box["x"]), int(top - box["y"]), int(right - box["x"]), int(bottom - box["y"])


def of_the_run(page: Any) -> dict[str, str]:
    """What tells one run from another."""
    return {name: fact(page, name) for name in ("Tick", "Cost driven", "Digest")}


@pytest.mark.nightly
@pytest.mark.parametrize("films", [["WebP"], ["GIF", "WebP"]])
def test_a_walk(page: Any, browser: Any, tmp_path: Path, films: list[str]) -> None:
    page.get_by_role("button", name="env-3", exact=False).click()
    page.locator("#where").get_by_text("env-3").wait_for()
    page.keyboard.press("v")
    click(page, (4, 4))
    page.keyboard.press("n")
    click(page, (45, 46))
    page.get_by_role("tab", name="Planner").click()
    page.get_by_role("combobox", name="Planner").select_option("dstar-lite")
    page.get_by_label("seed", exact=True).fill("7")
    page.keyboard.press("Tab")
    page.get_by_text("A path was found.").first.wait_for()
    found = in_address(page)
    assert (found["map"], found["start"], found["goal"]) == ("env-3", [4, 4], [45, 46])
    assert (found["planner"]["name"], found["seed"], found["edits"]) == ("dstar-lite", 7, [])

    # Run, pause, scrub back.
    page.get_by_role("button", name="Play", exact=True).click()
    page.locator("#status dd").get_by_text(re.compile("^(1[2-9]|2[0-9]) of")).wait_for()
    page.get_by_role("button", name="Pause").click()
    paused = moment(page)
    page.wait_for_timeout(200)
    assert moment(page) == paused >= 12
    before = int(fact(page, "Tick").split()[-1])
    line = page.get_by_role("slider", name="Moment").bounding_box()
    y = line["y"] + line["height"] / 2
    page.mouse.move(line["x"] + line["width"] * paused / before, y)
    page.mouse.down()
    page.mouse.move(line["x"] + line["width"] * 8 / before, y, steps=6)
    page.mouse.up()
    assert 6 <= moment(page) <= 10
    stood = moment(page)

    # A wall across the way: the way ahead bends, what was driven stays.
    seen = picture(page)
    page.get_by_role("button", name="Paint walls").click()
    draw(page, [(1, 27), (14, 27)])
    page.locator("#timeline output").get_by_text(
        re.compile(rf"^{stood}\.0 s / (?!{before}\.0 s$)\d+\.0 s$")
    ).wait_for()
    page.mouse.move(5, 5)
    assert moment(page) == stood
    (edit,) = in_address(page)["edits"]
    assert edit["tick"] == stood + 1
    assert [9, 27] in edit["blocked"]
    assert edit["freed"] == []
    now = picture(page)
    # Beside the wall's end was no way before; where the robot has been is nothing other than it was.
    beside, driven = part(page, (15, 23), (18, 31)), part(page, (2, 2), (14, 8))
    assert changed(seen.crop(beside), now.crop(beside)) > 0.004
    assert changed(seen.crop(driven), now.crop(driven)) < 0.001
    page.get_by_role("combobox", name="Speed of play").select_option("50×")
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Play again").wait_for()
    events = page.locator("#status li").all_inner_texts()
    assert any("replanned" in event for event in events), events
    assert any("cells turned into walls" in event for event in events)
    page.get_by_text("The robot arrived at the goal.").first.wait_for()
    ran = of_the_run(page)
    page.get_by_role("button", name=re.compile(rf"^{stood + 1}\.0 s\s.*replanned")).click()
    shown = moment(page)
    assert shown == stood + 1

    # Three planners in this world.
    page.get_by_role("tab", name="Compare").click()
    some = page.get_by_role("list", name="Planners that meet").get_by_role("listitem")
    some.nth(2).wait_for()
    assert some.count() == 3
    page.get_by_role("button", name="Compare", exact=True).click()
    table = page.locator("#compare table").first
    table.wait_for()
    head = table.get_by_role("columnheader").all_inner_texts()
    assert [word for word in head if word.strip()] == ["AD-GSO", "A*", "D* Lite"]
    assert table.get_by_role("row", name=re.compile("^outcome")).inner_text().count("arrived") == 3
    page.get_by_role("button", name="Side by side").click()
    page.get_by_role("img", name="A* on the map").wait_for()
    page.get_by_role("button", name="Leave").click()
    assert moment(page) == shown, "the comparison gives back what was shown"

    # Film, link, scenario.
    page.get_by_role("tab", name="Export").click()
    for what in films:
        with Image.open(save(page, what, tmp_path)) as film:
            assert (film.format, film.is_animated) == (what.upper(), True)
            first = film.convert("RGB")
            film.seek(film.n_frames - 1)
            assert film.n_frames > 20
            assert changed(first, film.convert("RGB")) > 0.001
    page.get_by_role("button", name="Copy the link").click()
    page.get_by_text("Link copied.").first.wait_for()
    page.get_by_label("Find a map").or_(page.get_by_role("tab", name="Map")).first.click()
    page.get_by_label("Find a map").click()
    page.keyboard.press("Control+v")
    link = page.get_by_label("Find a map").input_value()
    saved = save(page, "Scenario", tmp_path)
    state = in_address(page)
    other = browser.new_context(viewport={"width": 1280, "height": 720})
    try:
        fresh = other.new_page()
        fresh.goto(link)
        there(fresh, state, shown, ran)
    finally:
        other.close()
    page.reload()
    there(page, state, shown, ran)

    # The saved scenario on the command line.
    code = "from lampyris.cli import main; main()"
    told = subprocess.run(
        [sys.executable, "-c", code, "run", str(saved), "--json", "--no-timing"],
        capture_output=True,
        check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    assert hashlib.sha256(told.stdout.rstrip(b"\n")).hexdigest().startswith(ran["Digest"])


def there(page: Any, state: dict[str, Any], shown: int, ran: dict[str, str]) -> None:
    """The same state: scenario, moment, and the run to its end."""
    page.locator("#status dd").get_by_text(f"{shown} of {ran['Tick'].split()[-1]}").wait_for()
    assert in_address(page) == state
    page.get_by_role("tab", name="Planner").click()
    assert page.get_by_role("combobox", name="Planner").input_value() == "dstar-lite"
    assert page.get_by_label("seed", exact=True).input_value() == "7"
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("End")
    page.get_by_text("The robot arrived at the goal.").first.wait_for()
    assert of_the_run(page) == ran


def bring(page: Any, *files: Path) -> None:
    """Choose files in the browser's own dialog."""
    with page.expect_file_chooser() as asked:
        page.get_by_role("button", name="Open files").click()
    asked.value.set_files(list(files))


def drop(page: Any, *files: Path) -> None:
    """Let files fall onto the map, all at once."""
    things = page.evaluate_handle(DROP, [[file.name, file.read_bytes().hex()] for file in files])
    for word in ("dragenter", "dragover", "drop"):
        page.locator("#map").dispatch_event(word, {"dataTransfer": things})


def hall(width: int, height: int) -> list[list[int]]:
    """Grey values of a hall with a wall across, and a door in it."""
    return [[0 if y == height // 2 and x != width - 3 else 254 for x in range(width)] for y in range(height)]


def planned_on(page: Any, size: tuple[int, int]) -> None:
    """Click a start above the wall and a goal below it; there is a way, and it leads through the door."""
    page.locator("#status").get_by_text("Click a start and a goal on the map.").first.wait_for()
    click(page, (2, 2), size)
    page.locator("#status").get_by_text("Click a goal on the map.").first.wait_for()
    click(page, (2, size[1] - 3), size)
    page.locator("#status").get_by_text("A path was found.").first.wait_for()
    assert float(fact(page, "Cost").split()[0]) >= 2 * (size[0] - 5)


@pytest.mark.nightly
def test_files_of_a_robot_are_planned_on(page: Any, tmp_path: Path) -> None:
    rows = hall(24, 16)
    grey = Image.new("L", (24, 16))
    grey.putdata([value for row in rows for value in row])
    grey.save(tmp_path / "cellar.png")
    bring(page, tmp_path / "cellar.png")
    page.locator("#where").get_by_text("24 × 16").wait_for()
    planned_on(page, (24, 16))
    rows = hall(20, 30)
    (tmp_path / "hall.pgm").write_bytes(b"P5 20 30 255\n" + bytes(value for row in rows for value in row))
    # As a robot's own map saver wrote it.
    (tmp_path / "hall.yaml").write_text(ROS.format("/home/robot/maps/hall.pgm"))
    drop(page, tmp_path / "hall.yaml", tmp_path / "hall.pgm")
    page.locator("#where").get_by_text("20 × 30, 0.05 m a cell").wait_for()
    planned_on(page, (20, 30))
    play_to_the_end(page)
    assert fact(page, "Outcome") == "arrived"
    assert page.get_by_role("button", name="cellar").count() >= 1, "both are in the library"
    page.reload()
    page.locator("#where").get_by_text("20 × 30, 0.05 m a cell").wait_for()


@pytest.mark.nightly
def test_a_wrong_file_gives_a_sentence(page: Any, wrong: list[str], tmp_path: Path) -> None:
    files = {
        "noise.png": (bytes((7 * k * k + 3) % 251 for k in range(900)), "not a PNG, BMP or PGM"),
        "cut.map": (b"type octile\nheight 20\nwidth 20\nmap\n" + b"." * 20 + b"\n", "1 of 20 rows"),
        "alone.yaml": (ROS.format("gone.pgm").encode(), "open alone.yaml and gone.pgm together"),
        "far.yaml": (ROS.format("/home/somebody/gone.pgm").encode(), "open far.yaml and gone.pgm together"),
        "empty.png": (b"", "empty"),
    }
    for name, (content, words) in files.items():
        (tmp_path / name).write_bytes(content)
        bring(page, tmp_path / name)
        said = page.locator(".note.bad").filter(has_text=name)
        said.wait_for()
        text = said.inner_text()
        assert words in text, text
        assert len(text) < 300
        assert not re.search(r"Traceback|Error\b|line \d+, in |/tmp|0x", text), text
        said.get_by_role("button", name="Dismiss").click()
    page.locator("#where").get_by_text("guide").wait_for()
    page.get_by_text("A path was found.").first.wait_for()
    assert len(wrong) == len(files)
    assert all("400 (Bad Request)" in one for one in wrong)
    wrong.clear()
