"""Commands by name, panels that fold and resize, overlays, videos and comparisons of drives, in a browser."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import in_address, until

from lampyris.io.maps import library
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [needs_chromium, pytest.mark.nightly]


def command(page: Any, words: str) -> None:
    """Do what is called so, by keys alone."""
    page.keyboard.press("Control+k")
    page.locator("dialog.palette[open]").wait_for()
    page.keyboard.type(words)
    page.keyboard.press("Enter")
    page.locator("dialog.palette").wait_for(state="detached")


def test_every_layer_planner_law_and_map_is_found_and_chosen_by_keys(page: Any) -> None:
    page.keyboard.press("Control+k")
    page.locator("dialog.palette[open]").wait_for()
    field = page.get_by_role("combobox", name="Command")
    assert field.evaluate("one => one === document.activeElement")
    layers = ["None", "Cost", "Luciferin", "Clearance", "Expanded", "Reachable set", "Inflation"]
    planners = [*registry.list_planners(), *registry.list_planners("poses")]
    names = {
        "Planner": [
            (registry.title_of(name), called)
            for name in planners
            for called in (name, registry.title_of(name))
        ],
        "Speed law": [(name, name) for name in laws.LAWS],
        "Map": [(name, name) for name in library.names()],
        "Layer": [(name, name) for name in layers],
    }
    for group, some in names.items():
        for name, called in some:
            field.fill(f"{group} {called}")
            rows = page.locator("#palette-list li")
            found = [
                tuple(row)
                for row in rows.evaluate_all(
                    "all => all.map((li) => [li.children[0].innerText, li.children[1].innerText])"
                )
            ]
            assert (group, name) in found, (group, name, found[:5])
    field.fill("no such thing")
    assert page.locator("#palette-list li").count() == 0
    page.keyboard.press("Escape")
    page.locator("dialog.palette").wait_for(state="detached")

    command(page, "layer luciferin")
    until(page, lambda: page.get_by_label("Luciferin", exact=True).is_checked())
    command(page, "planner jps")
    until(page, lambda: in_address(page)["planner"]["name"] == "jps")
    command(page, "map env-2")
    page.locator("#where").get_by_text("env-2").wait_for()
    command(page, "erase walls")
    assert page.locator("#map").get_attribute("data-tool") == "free"
    command(page, "race planners")
    page.locator("dialog.race figure").nth(2).wait_for()


def test_panels_are_folded_and_resized_and_stay_so(page: Any) -> None:
    def wide(panel: str) -> float:
        return float(page.locator(f"#{panel}").bounding_box()["width"])

    before, stage = wide("left"), wide("stage")
    page.get_by_role("button", name="Hide the left panel").click()
    assert wide("left") == 0
    assert wide("stage") == pytest.approx(stage + before, abs=1)
    page.get_by_role("button", name="Show the left panel").click()
    assert wide("left") == before
    page.get_by_role("separator", name="Width of the right panel").focus()
    right = wide("right")
    for _ in range(5):
        page.keyboard.press("ArrowLeft")
    assert wide("right") == right + 80
    grip = page.get_by_role("separator", name="Width of the left panel").bounding_box()
    page.mouse.move(grip["x"] + 3, grip["y"] + 40)
    page.mouse.down()
    page.mouse.move(grip["x"] + 103, grip["y"] + 40, steps=4)
    page.mouse.up()
    assert wide("left") == pytest.approx(before + 100, abs=1)
    page.reload()
    page.wait_for_selector("body.ready")
    assert (wide("left"), wide("right")) == (pytest.approx(before + 100, abs=1), right + 80)
    page.get_by_role("button", name="Hide the left panel").click()
    page.keyboard.press("2")
    assert wide("left") > 0, "a panel that is asked for is there"
    page.get_by_role("separator", name="Width of the left panel").focus()
    for _ in range(25):
        page.keyboard.press("ArrowRight")
    chosen = wide("left")
    page.set_viewport_size({"width": 1024, "height": 720})
    until(page, lambda: wide("stage") >= 220)  # it leaves room for the map in a smaller window
    page.set_viewport_size({"width": 1280, "height": 720})
    until(page, lambda: wide("left") == chosen)


def test_a_tablet_held_upright_has_the_map_above_both_panels(page: Any) -> None:
    page.set_viewport_size({"width": 834, "height": 1112})
    boxes = {name: page.locator(f"#{name}").bounding_box() for name in ("stage", "left", "right")}
    assert boxes["stage"]["width"] == 834
    assert boxes["left"]["y"] == boxes["right"]["y"] > boxes["stage"]["y"] + boxes["stage"]["height"] - 1
    page.get_by_role("separator", name="Height of the map").focus()
    high = boxes["stage"]["height"]
    page.keyboard.press("ArrowDown")
    assert page.locator("#stage").bounding_box()["height"] == pytest.approx(high + 16, abs=1)


def test_a_click_sets_what_the_tool_says_and_never_the_other_end(page: Any) -> None:
    box = page.locator("#map").bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    before = in_address(page)
    page.get_by_role("button", name="Set the goal").click()
    free = [(dx, dy) for dx in range(-120, 121, 24) for dy in range(-120, 121, 24)]
    for dx, dy in free[:12]:
        page.mouse.click(middle[0] + dx, middle[1] + dy)
    now = in_address(page)
    assert now["start"] == before["start"]
    assert now["goal"] != before["goal"]
    page.get_by_role("button", name="Set the start").click()
    for dx, dy in free[12:24]:
        page.mouse.click(middle[0] + dx, middle[1] + dy)
    assert in_address(page)["goal"] == now["goal"]
    assert in_address(page)["start"] != now["start"]


def test_overlays_and_the_optimal_path_are_in_the_key(page: Any) -> None:
    page.get_by_role("button", name="Show the optimal path").click()
    page.locator("#legend").get_by_text("optimal path (A*)").wait_for()
    page.locator("#notes").get_by_text("% more").wait_for()
    page.get_by_role("button", name="Show the optimal path").click()
    page.locator("#legend").get_by_text("optimal path (A*)").wait_for(state="detached")
    page.click("#tab-settings")
    radius = page.get_by_label("radius", exact=False).first
    radius.fill("0.6")
    radius.press("Tab")
    page.click("#tab-now")
    page.get_by_label("Inflation").check()
    page.locator("#legend").get_by_text("too close to a wall").wait_for()


PLAYED = """async ([data, type]) => {
  const video = document.createElement("video");
  video.muted = true;
  document.body.append(video);
  video.src = `data:${type};base64,${data}`;
  await new Promise((over, fail) => { video.onloadeddata = over; video.onerror = () => fail(new Error(video.error.message)); });
  video.currentTime = video.duration / 2;
  await new Promise((over) => (video.onseeked = over));
  return [video.duration, video.videoWidth, video.videoHeight];
}"""


@pytest.mark.parametrize("name", ["WebM", "MP4"])
def test_a_film_is_had_as_a_video_that_plays(page: Any, browser: Any, tmp_path: Path, name: str) -> None:
    page.click("#tab-keep")
    with page.expect_download() as coming:
        page.get_by_role("button", name=name, exact=True).click()
    file = tmp_path / coming.value.suggested_filename
    coming.value.save_as(file)
    assert file.suffix == f".{name.lower()}"
    blank = browser.new_context().new_page()
    data = base64.b64encode(file.read_bytes()).decode()
    duration, width, height = blank.evaluate(PLAYED, [data, f"video/{name.lower()}"])
    blank.context.close()
    assert duration > 2
    assert min(width, height) > 300


def test_planners_of_poses_and_of_fleets_are_compared(page: Any) -> None:
    page.click("#tab-compare")
    page.get_by_role("button", name="Compare", exact=True).click()
    page.locator("#compare .results table").first.wait_for()
    page.get_by_role("button", name="Take D* Lite out").click()
    page.get_by_label("Add a planner").select_option("lattice")
    page.locator("#compare .adder").first.get_by_role("button", name="Add", exact=True).click()
    page.fill("#compare-seeds", "3")
    page.get_by_role("button", name="Compare", exact=True).click()
    table = page.locator("#compare table.controllers")
    table.wait_for()
    heads = set(table.locator("thead th").all_inner_texts())
    assert heads == {"AD-GSO", "A*", "State lattice"}
    assert page.get_by_role("button", name="Show it").is_hidden(), "the comparison before is no more"
    page.locator("#compare").get_by_text("seeds chosen above are not used").wait_for()
    page.click("#tab-fleet")
    page.fill("#fleet-number", "20")
    page.get_by_label("Seconds", exact=True).fill("0.5")
    page.get_by_role("button", name="Compare planners").click()
    page.locator("dialog[open] [role=status]", has_text="Costs in ticks").wait_for()
    rows = page.locator("dialog[open] tbody tr").all_inner_texts()
    assert len(rows) == len(registry.list_planners("fleets"))
    assert sum("Show" in row for row in rows) >= 3
    # The plan of the table is shown as it was made: nothing is asked again.
    costs = next(row for row in rows if row.startswith("PIBT")).split()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.locator("dialog[open] tbody").get_by_role("button", name="Show the plan of PIBT").click()
    makespan = page.locator("#fleet-now dt:text-is('Makespan') + dd")
    makespan.wait_for(state="attached")
    assert str(makespan.text_content()).split()[0] == costs[1]
    assert not [url for url in asked if "/api/" in url]


def test_what_becomes_of_a_study_is_in_view_after_it_was_sent(page: Any) -> None:
    page.route("**/api/study", lambda route: route.fulfill(json={"job": "job"}))
    page.route(
        "**/api/study/job", lambda route: route.fulfill(json={"done": 3, "total": 10, "state": "running"})
    )
    command(page, "send to a study")
    page.locator("#notes").get_by_text("The study was sent").wait_for()
    said = page.locator("#compare .study").get_by_text("3 of 10 runs")
    said.wait_for()
    box = said.bounding_box()
    assert 0 <= box["y"] <= page.viewport_size["height"] - box["height"]
