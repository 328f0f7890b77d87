"""Settings, comparison, tour and steps in a browser, as a person uses them. Skipped without chromium."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import changed, in_address, picture, until

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium


@pytest.mark.nightly
def test_a_setting_is_stored_undone_and_never_wrong(page: Any) -> None:
    page.click("#tab-settings")
    page.click("#settings .planner .settings summary")
    nt = page.get_by_label("neighbours wanted", exact=True)
    nt.fill("12")
    nt.press("Tab")
    assert in_address(page)["planner"] == {"name": "ad-gso", "settings": {"nt": 12}}
    nt.fill("0")
    nt.press("Tab")
    assert nt.get_attribute("aria-invalid") == "true"
    assert "1 to 10000" in page.inner_text("#settings .planner .settings")
    assert in_address(page)["planner"]["settings"] == {"nt": 12}
    nt.fill("10")
    nt.press("Tab")
    assert in_address(page)["planner"]["settings"] == {}, "defaults are not written down"
    page.locator("#settings .planner select").first.select_option("gso")
    assert in_address(page)["planner"] == {"name": "gso", "settings": {}}
    page.get_by_role("button", name="Undo").click()
    assert in_address(page)["planner"]["name"] == "ad-gso"
    assert page.get_by_label("neighbours wanted", exact=True).input_value() == "10"


@pytest.mark.nightly
def test_the_sensor_is_set_beside_the_traffic(page: Any) -> None:
    page.click("#tab-traffic")
    sensor = page.get_by_role("group", name="Sensor, for an unknown map")
    for label, value in (("Sensor range", "6"), ("Field of view", "90"), ("Cost of unseen cells", "2")):
        field = sensor.get_by_label(label)
        field.fill(value)
        field.press("Tab")
    wanted = {"sensor_range": 6, "field_of_view": 90, "unseen_cost": 2}
    assert in_address(page)["simulate"].items() >= wanted.items()


@pytest.mark.nightly
def test_a_rule_of_a_law_opens_its_own_settings(page: Any) -> None:
    page.click("#tab-settings")
    page.click("#settings .law .settings summary")
    page.get_by_label("approach", exact=True).check()
    page.get_by_label("distance", exact=True).fill("2.5")
    page.keyboard.press("Tab")
    law = in_address(page)["law"]
    assert law == {"name": "physical", "settings": {"approach": "on", "approach.distance": 2.5}}
    page.get_by_label("approach", exact=True).uncheck()
    assert in_address(page)["law"] == {"name": "physical", "settings": {}}


@pytest.mark.nightly
def test_three_planners_meet_and_the_clock_is_the_longest_run_s(page: Any) -> None:
    page.click("#tab-traffic")
    page.get_by_label("Random walkers").fill("5")
    page.keyboard.press("Tab")
    page.click("#tab-compare")
    page.get_by_label("seeds", exact=True).fill("2")
    page.get_by_role("button", name="Compare", exact=True).click()
    page.wait_for_selector("#compare table.measures")
    heads = page.locator("#compare table.measures thead th").all_inner_texts()
    assert [text.strip() for text in heads] == ["AD-GSO", "A*", "D* Lite"]
    row = page.locator("#compare table.measures tr", has_text="cost (cells)").locator("td")
    values = [float(text.split()[0]) for text in row.all_inner_texts()]
    stars = [k for k, text in enumerate(row.all_inner_texts()) if "best" in text]
    assert stars == [k for k, value in enumerate(values) if value == min(values)]
    assert page.locator("#compare figure.bars").count() == 3
    page.get_by_role("button", name="Side by side").click()
    assert page.locator(".mosaic canvas").count() == 3
    page.get_by_role("button", name="Leave", exact=True).click()
    assert page.locator(".mosaic canvas").count() == 0


TALLIES = {
    3: "Table 4.2: 77 of 78 printed numbers ✓, 1 ≈ (digits cut off).",
    4: "Table 4.2: 70 of 77 pointers of free cells ✓, 7 with row and column the wrong way round.",
    6: "Table 4.3: 12 of 13 printed numbers ✓, 1 ≠.",
    7: "Table 4.4: 9 of 9 printed numbers ✓.",
    8: "Table 4.5: 0 of 7 printed numbers ✓, 7 ≠.",
    9: "Table 4.6: 0 of 8 printed numbers ✓, 8 ≠.",
}
"""What ``lampyris reproduce`` finds of these tables, step by step."""


@pytest.mark.nightly
def test_the_tour_reproduces_the_tables_and_gives_back_what_was_there(page: Any) -> None:
    before = in_address(page)
    page.click("#tab-learn")
    page.get_by_role("button", name="Begin the tour").click()
    for step in range(1, 13):
        page.wait_for_selector(f"text=Step {step} of 12")
        if step in TALLIES:
            assert page.inner_text(".tour .tally") == TALLIES[step]
        if step == 10:
            assert "4 + 6 × 1.4 = 12.4" in page.inner_text(".tour")
        if step == 11:
            assert "arrives at tick 12 instead of 10" in page.inner_text(".tour")
            assert "Moving obstacles stand on every acceptable neighbour" in page.inner_text(".tour table")
        if step < 12:
            page.keyboard.press("ArrowRight") if step > 1 else page.get_by_role("button", name="Next").click()
    # Of node (5,5): two obstacles in ring 1 and one ahead in ring 2 leave 80 - 12 - 3, the angle of 135 degrees 60.
    row = page.locator(".tour tr", has_text="(5,5)").inner_text().split("\t")
    assert row[1:] == ["2, 1", "65", "135", "60", "60", "angle"]
    assert in_address(page)["map"] == "guide"
    page.get_by_role("button", name="Leave the tour").click()
    page.wait_for_selector("#where >> text=env-3")
    assert in_address(page) == before


@pytest.mark.nightly
def test_a_tour_that_is_cut_short_gives_it_back_too(page: Any, address: str) -> None:
    before = in_address(page)
    page.click("#tab-learn")
    page.get_by_role("button", name="Begin the tour").click()
    page.wait_for_selector("text=Step 1 of 12")
    assert in_address(page)["map"] == "guide"
    page.reload()
    page.wait_for_selector("#where >> text=env-3")
    page.wait_for_selector("#status >> text=found")
    assert {**in_address(page), "edits": []} == {**before, "edits": []}


def test_steps_are_the_record_of_the_plan(page: Any) -> None:
    page.click("#tab-learn")
    page.get_by_role("button", name="Show its steps").click()
    page.wait_for_selector("text=Ring 1:")
    assert page.locator(".slow table tbody tr").count() > 0
    for _ in range(6):
        if "is chosen" in page.inner_text(".slow"):
            break
        page.keyboard.press("ArrowRight")
    shares = [float(text) for text in page.locator(".slow table tbody tr td:last-child").all_inner_texts()]
    assert abs(sum(shares) - 1.0) < 0.001
    assert float(page.inner_text(".slow tr.chosen td:last-child")) == max(shares)
    page.keyboard.press("Escape")
    assert page.get_by_role("button", name="Show its steps").is_visible()


@pytest.mark.nightly
def test_a_scenario_file_is_saved_under_its_name(page: Any, tmp_path: Path) -> None:
    page.click("#tab-keep")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Scenario", exact=True).click()
    file = waiting.value
    assert file.suggested_filename == "env-3-ad-gso-seed-0.yaml"
    file.save_as(tmp_path / "kept.yaml")
    assert "planner" in (tmp_path / "kept.yaml").read_text()


@pytest.mark.nightly
def test_hints_on_a_touch_screen_say_tap(browser: Any, address: str) -> None:
    context = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")
    said = set()
    for name in ("Set the start", "Set the goal", "Paint walls", "Draw a patrol", "Move the map"):
        tab.locator("#tools").get_by_role("button", name=name).tap()
        said.add(tab.inner_text("#tip"))
    context.close()
    assert len(said) == 5
    assert any("tap" in words for words in said)
    for words in said:
        assert not any(mouse in words.lower() for mouse in ("click", "button", "wheel", "esc")), words


@pytest.mark.nightly
def test_inflation_says_when_no_cell_is_too_close(page: Any) -> None:
    page.get_by_label("Inflation").check(force=True)
    page.wait_for_selector("#layers >> text=none for this robot")


@pytest.mark.parametrize("width", [320, pytest.param(360, marks=pytest.mark.nightly)])
def test_a_narrow_telephone_need_not_be_scrolled_sideways(browser: Any, address: str, width: int) -> None:
    """WCAG 1.4.10: 320 pixels are enough, and no two tabs overlap."""
    context = browser.new_context(viewport={"width": width, "height": 844}, is_mobile=True, has_touch=True)
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    assert tab.evaluate("[document.documentElement.scrollWidth, innerWidth]") == [width, width]
    sides = tab.evaluate(
        """[...document.querySelectorAll(".tabs button")].flatMap((one) => {
          const { left, right } = one.getBoundingClientRect();
          return [left, right];
        })"""
    )
    context.close()
    assert len(sides) == 16
    assert sides == sorted(sides)
    assert sides[-1] <= width


@pytest.mark.nightly
@pytest.mark.parametrize("text", ["118.4 s / 188.7 s", "not planned yet"])
def test_the_time_is_whole_on_a_telephone(browser: Any, address: str, text: str) -> None:
    context = browser.new_context(viewport={"width": 390, "height": 844}, is_mobile=True, has_touch=True)
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    room, needed = tab.locator(".tl-where").first.evaluate(
        "(one, text) => (one.textContent = text, [one.clientWidth, one.scrollWidth])", text
    )
    context.close()
    assert needed <= room


@pytest.mark.nightly
def test_steps_stay_open_when_the_run_from_before_the_tour_comes_late(page: Any) -> None:
    """The tour gives back scenario and run; whoever opens the steps before that run is there keeps them."""
    page.get_by_role("button", name="Play", exact=True).click()
    page.wait_for_selector(".st-speed:not([hidden])")
    page.get_by_role("button", name="Pause").click()
    page.click("#tab-learn")
    page.get_by_role("button", name="Begin the tour").click()
    page.wait_for_selector("#learn >> text=Step 1 of 12")
    held: list[Any] = []
    page.route("**/api/simulate", lambda route: held.append(route))
    page.get_by_role("button", name="Leave the tour").click()
    page.get_by_role("button", name="Show its steps").click()
    page.get_by_label("Pace").wait_for()
    until(page, lambda: bool(held))
    for route in held:
        route.continue_()
    page.unroute("**/api/simulate")
    page.wait_for_selector(".st-speed:not([hidden])", state="attached")
    page.wait_for_timeout(500)
    assert page.get_by_label("Pace").is_visible()
    page.get_by_role("button", name="Play", exact=True).last.scroll_into_view_if_needed()
    page.locator("#timeline .main").click()
    page.get_by_label("Pace").wait_for(state="hidden")


@pytest.mark.nightly
def test_a_run_and_steps_are_never_on_the_map_together(page: Any) -> None:
    """Whoever looks for another moment of a run sees that moment; a run that is played in the tour is shown alone."""
    main = page.locator("#timeline .main")
    main.click()
    page.wait_for_selector(".st-speed:not([hidden])")
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("Home")
    page.keyboard.press("PageUp")
    page.wait_for_timeout(300)
    alone = picture(page)
    page.keyboard.press("Home")
    page.click("#tab-learn")
    page.get_by_role("button", name="Show its steps").click()
    page.get_by_label("Pace").wait_for()
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("PageUp")
    page.get_by_label("Pace").wait_for(state="hidden")
    until(page, lambda: changed(alone, picture(page)) < 0.001)
    page.get_by_role("button", name="Begin the tour").click()
    for _ in range(6):
        page.get_by_role("button", name="Next").click()
    page.wait_for_selector("#learn >> text=Step 7 of 12")
    page.wait_for_timeout(300)
    step = picture(page)
    main.click()
    until(page, lambda: changed(step, picture(page)) > 0.01)
    page.get_by_role("button", name="Pause").wait_for(state="hidden")
    until(page, lambda: changed(step, picture(page)) < 0.001)
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("Home")
    page.wait_for_timeout(300)
    assert changed(step, picture(page)) < 0.001


@pytest.mark.nightly
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_inflation_is_striped_inside_each_cell(page: Any, theme: str) -> None:
    """On a small map, too: it looked like a checkerboard of cells there."""
    page.emulate_media(color_scheme=theme)
    page.click("#tab-library")
    page.get_by_role("button", name="guide").click()
    page.wait_for_selector("#where >> text=guide")
    page.wait_for_selector("#status >> text=found")
    page.click("#tab-settings")
    radius = page.get_by_label("radius", exact=False).first
    radius.fill("0.6")
    radius.press("Tab")
    page.get_by_label("Inflation").check(force=True)
    page.locator("#legend li").get_by_text("too close to a wall").wait_for(state="attached")
    page.wait_for_timeout(300)
    found = page.evaluate(STRIPES)
    striped = [spread for spread in found if spread > 20]
    plain = [spread for spread in found if spread < 12]
    assert len(striped) > 8
    assert len(plain) > 20
    assert len(striped) + len(plain) > 0.8 * len(found)


STRIPES = """async () => {
  const canvas = document.querySelector("#map");
  const pen = canvas.getContext("2d");
  const [rows, side] = [10, Math.min(canvas.width - 140, canvas.height - 32) / 10];
  const [left, top] = [(canvas.width - 10 * side) / 2, (canvas.height - 10 * side) / 2];
  const spreads = [];
  for (let y = 0; y < rows; y++) {
    for (let x = 0; x < rows; x++) {
      const { data } = pen.getImageData(left + (x + 0.06) * side, top + (y + 0.06) * side, 0.2 * side, 0.88 * side);
      let [least, most] = [999, 0];
      for (let k = 0; k < data.length; k += 4) {
        const sum = data[k] + data[k + 1] + data[k + 2];
        least = Math.min(least, sum);
        most = Math.max(most, sum);
      }
      spreads.push((most - least) / 3);
    }
  }
  return spreads;
}"""
"""How far apart the darkest and the brightest pixel are in the left part of each cell of the map guide."""
