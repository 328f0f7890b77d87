"""The map under hands and keys in a browser: ends, brush, link, files, a server that goes."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_browser import app, needs_chromium
from page_person import addressed, in_address, later, until
from test_page_play import needs_node, node

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium


@pytest.fixture(scope="module")
def address(shared_library: str) -> str:
    """Of the app whose library is written to, of no map."""
    return re.sub("&m=.*", "", shared_library)


@pytest.fixture
def tab(browser: Any) -> Iterator[Any]:
    """A tab of a browser that was never here."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, has_touch=True)
    made = context.new_page()
    yield made
    context.close()


@pytest.fixture
def wrong() -> list[str]:
    """What the page complains of. A test that asks for what is refused takes that out."""
    return []


@pytest.fixture
def page(tab: Any, address: str, wrong: list[str]) -> Iterator[Any]:
    """The page; whatever it complains of, or asks of another machine, fails the test."""
    home = address.split("#")[0]
    tab.on("pageerror", lambda fault: wrong.append(str(fault)))
    tab.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    tab.on("request", lambda asked: wrong.append(asked.url) if foreign(asked.url, home) else None)
    arrive(tab, f"{address}&m=env-3")
    yield tab
    assert not wrong


def foreign(url: str, home: str) -> bool:
    """Whether this is asked of anybody but the server; blobs are the page's own."""
    return not url.startswith((home, "blob:", "data:"))


def arrive(tab: Any, address: str) -> None:
    """Open the page and wait until it has a plan."""
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")


def at(page: Any, cell: tuple[int, int], size: int = 50) -> tuple[float, float]:
    """Where a cell of a fitted map of that many cells a side is on the screen."""
    box = page.locator("#map").bounding_box()
    scale = min((box["width"] - 140) / size, (box["height"] - 32) / size)
    left = box["x"] + (box["width"] - size * scale) / 2
    top = box["y"] + (box["height"] - size * scale) / 2
    return left + (cell[0] + 0.5) * scale, top + (cell[1] + 0.5) * scale


def test_clicks_set_the_end_of_the_tool_and_a_drag_keeps_off_walls(page: Any) -> None:
    page.keyboard.press("v")
    page.mouse.click(*at(page, (8, 3)))
    page.keyboard.press("n")
    page.mouse.click(*at(page, (45, 46)))
    now = in_address(page)
    assert (now["start"], now["goal"]) == ([8, 3], [45, 46])
    page.mouse.move(*at(page, (8, 3)))
    page.mouse.down()
    page.mouse.move(*at(page, (11, 2)), steps=8)
    page.mouse.move(*at(page, (12, 2)), steps=4)  # a wall
    page.mouse.up()
    assert in_address(page)["start"] == [11, 2]
    page.keyboard.press("Control+z")
    assert in_address(page)["start"] == [8, 3], "a drag is undone at once"


@pytest.mark.nightly
def test_the_brush_leaves_no_holes_and_a_stroke_is_undone_at_once(page: Any) -> None:
    page.keyboard.press("b")
    page.mouse.move(*at(page, (5, 40)))
    page.mouse.down()
    page.mouse.move(*at(page, (30, 48)))  # one event, many cells
    page.mouse.up()
    (edit,) = in_address(page)["edits"]
    assert edit["tick"] == 0
    assert edit["freed"] == []
    page.keyboard.press("b")
    page.keyboard.press("e")
    page.mouse.move(*at(page, (5, 40)))
    page.mouse.down()
    page.mouse.move(*at(page, (30, 48)))
    page.mouse.up()
    # Painted and erased in the same places: what was painted is gone, what were walls before are free.
    left = in_address(page)["edits"]
    assert all(one["blocked"] == [] for one in left)
    page.keyboard.press("Control+z")
    assert in_address(page)["edits"] == [edit]
    page.keyboard.press("Control+z")
    assert in_address(page)["edits"] == []
    page.keyboard.press("Control+Shift+z")
    assert in_address(page)["edits"] == [edit]


STROKES = """
import { line, brush } from "./hand.js";
import { applyEdits, withStroke } from "./ground.js";
let state = 12345;
const draw = (n) => {
  state = (state * 1103515245 + 12345) % 2147483648;
  return Math.floor(state / 65536) % n;
};
const wrong = [];
for (let round = 0; round < 400; round++) {
  const a = [draw(40), draw(40)], b = [draw(40), draw(40)];
  const cells = line(a, b);
  const long = Math.max(Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1]));
  if (cells.length !== long + 1) wrong.push(['long', a, b]);
  if (String([cells[0], cells.at(-1)]) !== String([a, b])) wrong.push(['ends', a, b]);
  const size = Math.hypot(b[0] - a[0], b[1] - a[1]);
  cells.forEach(([x, y], k) => {
    const [px, py] = cells[Math.max(k - 1, 0)];
    if (k && Math.max(Math.abs(x - px), Math.abs(y - py)) !== 1) wrong.push(['gap', a, b]);
    const off = size ? Math.abs((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / size : 0;
    if (off > 0.5 + 1e-9) wrong.push(['off', a, b, off]);
  });
}
for (let size = 1; size <= 9; size++) {
  const cells = brush(size), keys = new Set(cells.map(String));
  if (keys.size !== cells.length || !keys.has('0,0')) wrong.push(['brush', size]);
}
for (let round = 0; round < 200; round++) {
  const width = 7, base = Uint8Array.from({ length: 42 }, () => draw(3));
  let edits = [];
  const ticks = [0, 0, 4, 9];
  for (let k = 0; k < 4; k++) {
    const tick = ticks[draw(4)];
    const before = new Uint8Array(42), now = new Uint8Array(42), after = new Uint8Array(42);
    applyEdits(base, edits.filter((e) => e.tick < tick), tick, width, before);
    applyEdits(base, edits, tick, width, now);
    const stroke = new Map(Array.from({ length: draw(9) }, () => [draw(42), draw(2)]));
    edits = withStroke(edits, tick, stroke, before, width);
    applyEdits(base, edits, tick, width, after);
    for (const [cell, value] of stroke) now[cell] = value;
    if (String(now) !== String(after)) wrong.push(['stroke', round, k]);
    if (edits.some((e, j) => j && e.tick <= edits[j - 1].tick)) wrong.push(['order', round]);
  }
}
console.log(JSON.stringify(wrong.slice(0, 5)));
"""


@needs_node
def test_lines_and_strokes_are_what_they_say(tmp_path: Path) -> None:
    """Lines are connected and never further than half a cell off; strokes painted are strokes applied."""
    assert node(tmp_path, STROKES) == []


@pytest.mark.nightly
def test_everything_by_keyboard(page: Any) -> None:
    press = page.keyboard.press
    press("1")
    assert page.evaluate("document.activeElement.id") == "tab-library"
    page.get_by_title("guide 10").focus()
    press("Enter")
    page.wait_for_selector("#where >> text=guide")
    page.wait_for_selector("#status >> text=found")
    press("m")
    for _ in range(12):
        press("ArrowLeft")
        press("ArrowUp")
    assert "column 0, row 0" in page.inner_text("#live")
    press("ArrowRight")
    press("ArrowRight")
    assert "free" in page.inner_text("#live")
    press("v")
    press("Enter")
    assert in_address(page)["start"] == [2, 0]
    press("w")  # the start's own cell stays free
    assert in_address(page)["edits"] == []
    press("ArrowRight")
    press("w")
    assert in_address(page)["edits"] == [{"tick": 0, "blocked": [[3, 0]], "freed": []}]
    press("Control+z")
    press("p")
    press("Enter")
    press("ArrowRight")
    press("Enter")
    press("Enter")
    assert in_address(page)["obstacles"] == [{"kind": "patrol", "waypoints": [[3, 0], [4, 0]]}]
    press("r")
    page.wait_for_selector("#timeline >> text=/ \\d+/")
    press("?")
    assert page.locator("#help").is_visible()
    press("Escape")
    assert not page.locator("#help").is_visible()


@pytest.mark.nightly
def test_a_link_is_the_state(page: Any, browser: Any) -> None:
    page.mouse.click(*at(page, (8, 3)))
    page.get_by_role("tab", name="Traffic").click()
    page.get_by_label("Random walkers").fill("7")
    page.keyboard.press("Tab")
    now = in_address(page)
    page.wait_for_timeout(300)
    link = page.url
    page.reload()
    page.wait_for_selector("#status >> text=found")
    assert in_address(page) == now
    other = browser.new_context()
    try:
        fresh = other.new_page()
        arrive(fresh, link)
        fresh.get_by_role("tab", name="Traffic").click()
        assert fresh.get_by_label("Random walkers").input_value() == "7"
    finally:
        other.close()


@pytest.mark.nightly
def test_a_link_holds_moment_layer_and_place(page: Any) -> None:
    page.locator("#layers label").filter(has_text="Luciferin").click()
    page.keyboard.press("m")
    page.keyboard.press("+")
    page.keyboard.press("r")
    page.wait_for_selector("#status dd >> text=/^([5-9]|1[0-9]) of/")
    page.keyboard.press("Space")
    later(page, 250)
    addressed(page)  # it stands still, and the address says so
    zoom = page.inner_text("#zoom output")
    tick = page.inner_text("#status dd >> nth=0")
    page.reload()
    page.wait_for_selector(f"#status dd >> text={tick}")
    assert page.inner_text("#zoom output") == zoom
    assert page.locator("#layers label").filter(has_text="Luciferin").locator("input").is_checked()


@pytest.mark.nightly
def test_a_wall_painted_while_it_drives_makes_the_run_again_from_there(page: Any) -> None:
    page.keyboard.press("r")
    page.wait_for_selector("#status dd >> text=/^([5-9]|1[0-9]) of/")
    page.keyboard.press("b")
    page.mouse.move(*at(page, (24, 22)))
    page.mouse.down()
    page.mouse.move(*at(page, (24, 24)), steps=3)
    page.mouse.up()
    (edit,) = in_address(page)["edits"]
    assert edit["tick"] > 4, "what was driven stays"
    page.wait_for_selector("#timeline >> text=/ \\d+/")
    page.keyboard.press("Home")
    page.keyboard.press("Control+z")
    assert in_address(page)["edits"] == []


@pytest.mark.nightly
def test_files_become_maps_or_a_sentence(page: Any, wrong: list[str], tmp_path: Path) -> None:
    rows = [b"\xfe" * 20 if y != 5 else b"\x00" * 15 + b"\xfe" * 5 for y in range(12)]
    (tmp_path / "hall.pgm").write_bytes(b"P5 20 12 255\n" + b"".join(rows))
    (tmp_path / "hall.yaml").write_text(
        "image: hall.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "bad.png").write_bytes(b"nothing of a picture")
    (tmp_path / "case.yaml").write_text("version: 1\nmap: guide\nseed: 5\nplanner: a-star\n")
    files = page.locator("#library input[type=file]")
    files.set_input_files([tmp_path / "hall.yaml", tmp_path / "hall.pgm"])
    page.wait_for_selector("#where >> text=20 × 12, 0.05 m a cell")
    files.set_input_files([tmp_path / "bad.png"])
    page.wait_for_selector(".note.bad >> text=bad.png")
    assert "Traceback" not in page.inner_text("body")
    assert "20 × 12" in page.inner_text("#where"), "what was there stays"
    files.set_input_files([tmp_path / "case.yaml"])
    page.wait_for_selector("#where >> text=guide")
    now = in_address(page)
    assert (now["map"], now["seed"], now["planner"]) == ("guide", 5, {"name": "a-star", "settings": {}})
    assert all("400 (Bad Request)" in fault for fault in wrong)
    wrong.clear()


@pytest.mark.nightly
def test_two_fingers_pinch_and_paint_nothing(page: Any) -> None:
    box = page.locator("#map").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    device = page.context.new_cdp_session(page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        told = [{"x": px, "y": py, "id": k} for k, (px, py) in enumerate(points)]
        device.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": told})

    page.keyboard.press("b")
    before = page.inner_text("#zoom output")
    touch("touchStart", (x - 20, y))
    touch("touchStart", (x - 20, y), (x + 20, y))
    for k in range(1, 6):
        touch("touchMove", (x - 20 - 8 * k, y), (x + 20 + 8 * k, y))
    touch("touchEnd")
    until(page, lambda: page.inner_text("#zoom output") != before)
    page.keyboard.press("v")
    assert not page.evaluate("JSON.parse(localStorage.getItem('lampyris-draft') ?? '{}').edits?.length")
    page.keyboard.press("0")
    until(page, lambda: page.inner_text("#zoom output") == before)


@pytest.mark.nightly
def test_a_server_that_goes_takes_nothing_along(tab: Any, tmp_path: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with app(tmp_path, port=port) as address:
        arrive(tab, address)
    tab.keyboard.press("b")
    tab.mouse.move(*at(tab, (5, 40)))
    tab.mouse.down()
    tab.mouse.move(*at(tab, (9, 40)))
    tab.mouse.up()
    tab.wait_for_selector("#gone >> text=kept")
    drawn = in_address(tab)["edits"]
    assert drawn
    with app(tmp_path, port=port) as address:
        tab.goto(address)
        tab.wait_for_selector("#gone", state="hidden")
        assert in_address(tab)["edits"] == drawn
        tab.wait_for_timeout(300)
        assert address.split("#")[1] in tab.url, "the address has the new token"


@pytest.mark.nightly
def test_what_was_told_of_a_run_is_forgotten_with_what_is_cut_off_it(page: Any) -> None:
    """Back to the start and a wall undone within a frame: there are fewer events than were counted."""
    page.keyboard.press("r")
    page.wait_for_selector("#status dd >> text=/^([5-9]|1[0-9]) of/")
    page.keyboard.press("b")
    page.mouse.move(*at(page, (24, 22)))
    page.mouse.down()
    page.mouse.move(*at(page, (24, 24)), steps=3)
    page.mouse.up()
    page.wait_for_selector("#status dt >> text=Outcome")
    page.evaluate(
        """() => {
          for (const init of [{ key: "Home" }, { key: "." }, { key: "." }, { key: "z", ctrlKey: true }]) {
            const pressed = new KeyboardEvent("keydown", { ...init, bubbles: true, cancelable: true });
            document.body.dispatchEvent(pressed);
          }
        }"""
    )
    page.wait_for_timeout(300)
    assert in_address(page)["edits"] == []
