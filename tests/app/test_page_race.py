"""A race and the landscape in 3-D, in a browser. Skipped without chromium."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from page_browser import needs_chromium
from page_person import in_address
from PIL import Image
from test_app_race import raced

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [needs_chromium, pytest.mark.nightly]

TONES = """() => [...document.querySelectorAll(".race-map > canvas:first-child")].map((canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const free = data[0] + data[1] + data[2];
  const known = new Map();
  for (let k = 0; k < data.length; k += 4) {
    const tone = (data[k] << 16) | (data[k + 1] << 8) | data[k + 2];
    known.set(tone, (known.get(tone) ?? 0) + 1);
  }
  return [...known.entries()];
})"""
FREE, WALL = (250 << 16) | (249 << 8) | 245, (32 << 16) | (36 << 8) | 44


def test_a_race_takes_two_clicks_and_colours_the_recorded_cells(page: Any) -> None:
    page.click("#tab-compare")
    page.get_by_role("button", name="Race", exact=True).click()
    page.locator("dialog.race .race-bar").get_by_role("button", name="Pause").wait_for()
    assert page.locator("dialog.race figure").count() == 3
    page.keyboard.press("End")
    page.locator("dialog.race .race-bar").get_by_role("button", name="Play").wait_for()
    assert page.locator("dialog.race figcaption b >> text=arrived").count() == 3
    coloured = [
        sum(many for tone, many in tones if tone not in (FREE, WALL)) for tones in page.evaluate(TONES)
    ]
    page.keyboard.press("Home")
    assert page.locator("dialog.race figcaption b >> text=searching").count() == 3
    assert all(tone in (FREE, WALL) for tones in page.evaluate(TONES) for tone, many in tones if many > 1)
    shown = {key: value for key, value in in_address(page).items() if value is not None}
    heads, orders = raced(shown, ["ad-gso", "astar", "dstar-lite"])
    # The rings of AD-GSO lie on the field and on walls, which stay walls.
    assert coloured == [heads[0]["field"], *(len(set(order.tolist())) for order in orders[1:])]
    page.keyboard.press("Escape")
    assert page.locator("dialog.race").count() == 0


def test_the_landscape_is_drawn_and_turned(page: Any) -> None:
    page.get_by_label("Luciferin").first.check(force=True)
    page.get_by_label("Contour lines").check()
    page.get_by_role("button", name="In 3-D").click()
    page.get_by_role("button", name="Pause").click()
    view = page.locator("dialog.deep canvas")
    before = view.screenshot()
    view.focus()
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(500)
    after = view.screenshot()
    assert before != after
    assert len(before) > 20_000, "more than one colour"


@pytest.mark.nightly
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_tree_is_told_from_the_ground_by_lightness(page: Any, theme: str) -> None:
    page.emulate_media(reduced_motion="reduce", color_scheme=theme)
    page.click("#tab-compare")
    for planner in ("theta-star", "jps", "rrt-star"):  # the sixth colour is the darkest
        page.get_by_label("Add a planner").select_option(planner)
        page.locator("#compare .adder").first.get_by_role("button", name="Add", exact=True).click()
    page.get_by_role("button", name="Race", exact=True).click()
    page.locator("dialog.race figure").nth(5).wait_for()
    page.get_by_label("Moment of the race").evaluate(
        "one => { one.value = 20; one.dispatchEvent(new Event('input')); }"
    )
    page.wait_for_timeout(500)
    shown = page.locator("dialog.race figure").nth(5).locator("canvas")
    tree, ground = shown.nth(1).evaluate(LINES), shown.nth(0).evaluate(MOST)
    high, low = max(tree, ground), min(tree, ground)
    assert (high + 0.05) / (low + 0.05) > 2


LUMINANCE = """const luminance = ([r, g, b]) => [r, g, b]
  .map((v) => v / 255)
  .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
  .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
const { data } = one.getContext("2d").getImageData(0, 0, one.width, one.height);"""
LINES = f"""(one) => {{ {LUMINANCE}
  const found = [];
  for (let k = 0; k < data.length; k += 4) if (data[k + 3] > 150) found.push(luminance(data.slice(k, k + 3)));
  return found.sort((a, b) => a - b)[found.length >> 1];
}}"""
"""The luminance of what is drawn on a canvas that is clear elsewhere, in the middle."""
MOST = f"""(one) => {{ {LUMINANCE}
  const found = new Map();
  for (let k = 0; k < data.length; k += 4) {{
    const colour = String(data.slice(k, k + 3));
    found.set(colour, (found.get(colour) ?? 0) + 1);
  }}
  return luminance([...found].sort((a, b) => b[1] - a[1])[0][0].split(",").map(Number));
}}"""
"""The luminance of the colour that most of a canvas has."""


@pytest.mark.nightly
def test_the_landscape_follows_the_theme(page: Any) -> None:
    """As if it had been opened in that theme."""
    page.emulate_media(reduced_motion="reduce", color_scheme="dark")
    page.get_by_label("Luciferin").first.check(force=True)

    def seen() -> np.ndarray:
        page.wait_for_timeout(1000)
        with Image.open(io.BytesIO(page.locator("dialog.deep canvas").screenshot())) as image:
            return np.asarray(image.convert("RGB")).astype(int)

    page.get_by_role("button", name="In 3-D").click()
    dark = seen()
    page.keyboard.press("Escape")
    page.emulate_media(reduced_motion="reduce", color_scheme="light")
    page.get_by_role("button", name="In 3-D").click()
    light = seen()
    page.emulate_media(reduced_motion="reduce", color_scheme="dark")
    after = seen()
    assert (np.abs(light - dark).max(axis=2) > 24).mean() > 0.5
    assert (np.abs(after - dark).max(axis=2) > 24).mean() < 0.01


def test_two_fingers_bring_the_landscape_nearer(browser: Any, address: str) -> None:
    """Pinching zooms, and a finger that is left alone turns it without a jump."""
    context = browser.new_context(viewport={"width": 390, "height": 844}, is_mobile=True, has_touch=True)
    page = context.new_page()
    page.goto(address)
    page.wait_for_selector("body.ready")
    page.wait_for_selector("#status >> text=found")
    page.get_by_label("Luciferin").first.check(force=True)
    page.get_by_role("button", name="In 3-D").click()
    page.get_by_role("button", name="Pause").click()
    view = page.locator("dialog.deep canvas")
    box = view.bounding_box()
    middle = [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2]
    session = context.new_cdp_session(page)

    def touch(kind: str, *apart: float) -> None:
        points = [{"x": middle[0] + side, "y": middle[1], "id": k} for k, side in enumerate(apart)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def covered() -> float:
        """Share of the view that is ground."""
        page.wait_for_timeout(500)
        with Image.open(io.BytesIO(view.screenshot())) as image:
            pixels = np.asarray(image.convert("RGB")).astype(int)
        return float((np.abs(pixels - pixels[2, 2]).max(axis=2) > 8).mean())

    before = covered()
    touch("touchStart", -40, 40)
    for apart in (50, 60, 70, 80):
        touch("touchMove", -apart, apart)
    near = covered()
    touch("touchMove", -40, 40)
    back = covered()
    touch("touchEnd")
    context.close()
    assert near > 1.8 * before
    assert back == pytest.approx(before, rel=0.1)
