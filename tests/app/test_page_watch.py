"""Timeline, charts, status, layers and hover in a browser, as a person uses them; not without chromium."""

from __future__ import annotations

import base64
import json
import re
import zlib
from typing import Any

import numpy as np
import pytest
from page_browser import needs_chromium
from page_person import aim, in_address, until

from lampyris.app.engine.layers import layer_of
from lampyris.app.engine.parse import scenario_of_request

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [needs_chromium, pytest.mark.nightly]


def fact(page: Any, name: str) -> str:
    """What the status says of something."""
    row = page.locator("#status dt", has_text=re.compile(f"^{re.escape(name)}$")).locator("+ dd")
    return str(row.inner_text())


def run_to_its_end(page: Any) -> int:
    """Play it as fast as it goes; its last tick."""
    page.get_by_label("Speed of play").select_option("50")
    page.get_by_role("button", name="Play", exact=True).click()
    page.wait_for_selector("#status >> text=arrived at the goal")
    page.get_by_role("button", name="Play again").wait_for()
    shown = re.fullmatch(r"(\d+)\.0 s / (\d+)\.0 s", page.inner_text(".tl-where"))
    assert shown
    assert shown[1] == shown[2]
    # A cell of 1 m at 1 m/s: a tick is a second.
    assert (
        page.locator(".tl-where")
        .get_attribute("title")
        .startswith(f"Tick {shown[2]} of {shown[2]}; a tick is 1 s")
    )
    return int(shown[2])


def test_a_run_is_scrubbed_by_keys_by_hand_and_by_its_chart(page: Any) -> None:
    last = run_to_its_end(page)
    assert fact(page, "Outcome") == "arrived"
    slider = page.get_by_role("slider", name="Moment")
    assert slider.get_attribute("aria-valuemax") == str(last)
    now = lambda: int(slider.get_attribute("aria-valuenow"))  # noqa: E731
    slider.focus()
    moves = [("Home", 0), ("ArrowRight", 1), ("ArrowRight", 2), ("Shift+ArrowRight", 12), ("ArrowLeft", 11)]
    for key, tick in [*moves, ("End", last), ("[", last), ("Home", 0), ("]", last), ("Home", 0)]:
        page.keyboard.press(key)
        assert now() == tick, key
        assert slider.get_attribute("aria-valuetext") == f"{tick}.0 s of {last}.0 s, tick {tick}"
    page.wait_for_selector("#status >> text=stands at the start")
    box = slider.bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.9 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.25 * box["width"], y, steps=5)
    page.mouse.up()
    assert abs(now() - 0.25 * last) <= 1
    plot = page.locator("#charts .u-over").first
    box = plot.bounding_box()
    plot.click(position={"x": 0.75 * box["width"], "y": 20})
    assert abs(now() - 0.75 * last) <= 1
    head = page.locator("#charts .ch-head-line").first.bounding_box()
    assert abs(head["x"] + 1 - (box["x"] + 0.75 * box["width"])) < 1.5 * box["width"] / last
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Play again").wait_for()
    assert now() == last


def test_charts_tell_run_and_plan_over_time_and_way(page: Any) -> None:
    charts = page.locator("#charts")
    assert page.inner_text("#charts .ch-legend").split() == ["limit", "curvature", "start", "goal"]
    run_to_its_end(page)
    for of in ("Run", "Plan"):
        for over in ("Time", "Distance"):
            charts.get_by_role("button", name=of, exact=True).click()
            charts.get_by_role("button", name=over, exact=True).click()
            box = page.locator("#charts .u-over").first.bounding_box()
            page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 30)
            said = page.inner_text("#charts figcaption >> nth=0")
            unit = {"Time": "s", "Distance": "m"}[over]
            assert re.search(rf"\b{unit}\b", said.partition(":")[0]), said
            assert said.endswith("1 m/s, limit")
    assert page.locator("#charts .ch-head-line:visible").count() == 0, "a plan has no moment"


def test_layers_have_their_ends_told(page: Any) -> None:
    for name, low in [("Cost", "0 cells, at the goal"), ("Clearance", "m, tight"), ("Expanded", "1, first")]:
        page.get_by_role("radio", name=name).check()
        page.wait_for_selector(f".ly-ends >> text={low}")
    assert page.locator("#layers .ly-order", has_text="So far").is_visible()
    page.get_by_role("radio", name="None").check()
    assert not page.locator(".ly-legend").is_visible()
    page.click("#tab-traffic")
    page.get_by_label("Random walkers").fill("9")
    page.keyboard.press("Tab")
    page.get_by_role("radio", name="Reachable set").check()
    run_to_its_end(page)
    page.wait_for_selector(".ly-ends >> text=0 ticks, soon")
    assert fact(page, "Obstacles") == "9"


def test_where_a_layer_says_nothing_no_scale_says_anything(page: Any) -> None:
    legend = page.locator("#layers .ly-legend")
    page.get_by_label("Reachable set", exact=True).check()
    page.wait_for_selector("#layers >> text=Nothing moves.")
    assert legend.is_hidden()
    # Of another map's numbers there is nothing left while its own are on their way.
    page.get_by_label("Cost", exact=True).check()
    legend.wait_for()
    page.route("**/api/layer", lambda route: None)
    page.locator('.map-card[title^="guide"]').click()
    page.wait_for_selector("#where >> text=guide")
    legend.wait_for(state="hidden")


def test_without_a_goal_no_layer_is_asked_for(page: Any) -> None:
    legend, layers = page.locator("#layers .ly-legend"), page.locator("#layers")
    page.get_by_label("Cost", exact=True).check()
    legend.wait_for()
    asked: list[str] = []
    page.on("request", lambda one: asked.append(one.url) if one.url.endswith("/api/layer") else None)
    made = {**in_address(page), "map": {"rows": ["....", "...."]}, "start": None, "goal": None}
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    text = base64.urlsafe_b64encode(packer.compress(json.dumps(made).encode()) + packer.flush()).decode()
    page.evaluate("(s) => { location.hash = location.hash.split('&')[0] + '&s=' + s; }", text.rstrip("="))
    layers.locator("text=Set a start and a goal first.").wait_for()
    page.get_by_label("Clearance", exact=True).check()
    page.mouse.move(*aim(page, (1, 1), (4, 2)))
    page.wait_for_timeout(500)
    assert not asked
    assert legend.is_hidden()


def test_the_end_of_a_run_tells_hits_near_misses_and_what_its_mean_is_of(page: Any) -> None:
    page.click("#tab-traffic")
    page.get_by_label("Random walkers").fill("20")
    page.keyboard.press("Tab")
    assert fact(page, "Mean speed moving").endswith("m/s")
    run_to_its_end(page)
    assert fact(page, "Hits") == "0"
    assert fact(page, "Near misses").isdigit()
    assert fact(page, "Mean speed moving").endswith("m/s")
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("Home")
    page.keyboard.press("End")
    page.locator("#status dt").get_by_text("Outcome").wait_for()
    names = page.locator("#status dt").all_inner_texts()
    assert (
        names.index("Outcome") < names.index("Iterations") < names.index("Collisions") < names.index("Hits")
    )
    # The line of the moment does not cross the words at the foot of the second chart.
    line, plot = (
        page.locator(f"#charts {one}").nth(1).bounding_box() for one in (".ch-head-line", ".u-over")
    )
    assert line["y"] + line["height"] <= plot["y"] + plot["height"] - 13


def test_a_hovered_cell_has_the_library_s_numbers(page: Any) -> None:
    """To a 255th of the layer's range, as they are sent, and three figures, as they are told."""
    # Headings of ends are the page's own keys; here they are null, and the server is not sent them.
    made = {key: value for key, value in in_address(page).items() if key not in ("start_yaw", "goal_yaw")}
    for name in ("Cost", "Clearance", "Luciferin"):
        # A layer that a hover has asked for already is not asked for again.
        page.get_by_label(name, exact=True).check()
        page.wait_for_selector(f'#layers .ly-ramp[aria-label^="{name} from"]')
        values = layer_of(name.lower(), scenario_of_request({"scenario": made}), 0, None)
        there = values[np.isfinite(values)]
        cells = np.argwhere(np.isfinite(values))[200::500, ::-1].tolist()
        assert len(cells) > 3
        for x, y in cells:
            page.mouse.move(*aim(page, (x, y)))
            page.wait_for_selector(f"#hover:has-text('({x}, {y})')")
            head = "Cost to the goal" if name == "Cost" else name
            words = page.locator(f'#hover dt:text-is("{head}") + dd').inner_text()
            told = float(words.removeprefix("about ").split()[0].replace(",", ""))
            near = (there.max() - there.min()) / 254 + 0.005 * abs(values[y, x])
            assert abs(told - values[y, x]) <= near, (name, x, y)


def test_a_ruler_measures_in_metres_by_hand_and_by_keyboard(page: Any) -> None:
    page.get_by_role("button", name="Measure a distance").click()
    said = page.locator("#ruler-said")
    until(page, lambda: "Drag from one place" in said.inner_text())
    page.mouse.move(*aim(page, (5, 20)))
    page.mouse.down()
    page.mouse.move(*aim(page, (8, 16)), steps=3)
    page.mouse.up()
    assert said.inner_text() == "5.00 m, heading 53\u00b0 (5.0 cells)"
    page.keyboard.press("Escape")
    assert not said.is_visible()
    before = in_address(page)
    page.locator("#map").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("u")
    until(page, lambda: said.inner_text().startswith("0.00 m"))
    for _ in range(3):
        page.keyboard.press("ArrowDown")
    until(page, lambda: said.inner_text().startswith("3.00 m, heading 270"))
    page.keyboard.press("u")
    until(page, lambda: not said.is_visible())
    assert in_address(page) == before, "measuring changes nothing"


def test_a_cell_says_what_it_costs_and_a_node_why_it_is_so_fast(page: Any) -> None:
    box = page.locator("#map").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.wait_for_selector("#hover >> text=Luciferin")
    said = page.inner_text("#hover")
    assert re.search(r"\(\d+, \d+\)", said)
    assert "Cost to the goal" in said
    seen = set()
    for k in range(60):
        page.mouse.move(box["x"] + box["width"] * (0.3 + 0.4 * k / 60), box["y"] + 0.45 * box["height"])
        page.wait_for_timeout(30)
        seen |= set(re.findall(r"Speed\s+(\S+ m/s: \w+)", page.inner_text("#hover")))
    assert "1 m/s: limit" in seen
    page.mouse.move(box["x"] + 5, box["y"] + box["height"] + 40)
    assert not page.locator("#hover").is_visible()
