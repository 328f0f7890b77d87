"""What the page could not do at first, in a browser, as a person uses it. Skipped without chromium."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import drawn, in_address, unpacked, until

from lampyris import scenarios

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [needs_chromium, pytest.mark.nightly]


def opened(page: Any, made: dict[str, Any]) -> None:
    """Open the link of a scenario."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    made = json.loads(json.dumps(made))
    packed = packer.compress(json.dumps(made).encode()) + packer.flush()
    text = base64.urlsafe_b64encode(packed).decode().rstrip("=")
    page.evaluate("(text) => { location.hash = location.hash.match(/t=[0-9a-f]+/)[0] + '&s=' + text; }", text)
    until(page, lambda: unlisted({**draft(page), **made}) == unlisted(draft(page)))
    page.wait_for_selector("#status >> text=found")


def draft(page: Any) -> dict[str, Any]:
    """The scenario that the tab keeps."""
    kept = page.evaluate("sessionStorage.getItem('lampyris-draft')")
    return {} if kept is None else dict(json.loads(kept))


def unlisted(value: Any) -> Any:
    """With lists of cells however they are written."""
    if isinstance(value, dict):
        return {key: unlisted(one) for key, one in value.items()} if "rows" not in value else unpacked(value)
    return [unlisted(one) for one in value] if isinstance(value, list) else value


# ---- maps by recipes --------------------


def test_a_map_is_made_looked_at_opened_linked_and_saved(page: Any, tmp_path: Path) -> None:
    page.get_by_role("button", name="Make a map").click()
    box = page.get_by_role("group", name="Make a map")
    box.get_by_label("Kind of map").select_option("random")
    box.get_by_label("columns").fill("40")
    box.get_by_label("rows").fill("30")
    box.get_by_label("density").fill("0.1")
    box.get_by_label("seed", exact=True).fill("7")
    box.locator("canvas[aria-label^='random, seed 7: 40 × 30']").wait_for()
    assert page.evaluate("document.querySelector('.made-picture').width") == 40
    box.get_by_role("button", name="Open this map").click()
    page.wait_for_selector("#where >> text=random, seed 7")
    page.wait_for_selector("#status >> text=found")
    kept = in_address(page)
    assert kept["map"] == {"recipe": "random", "size": [40, 30], "seed": 7, "settings": {"density": 0.1}}
    page.reload()
    page.wait_for_selector("#where >> text=random, seed 7")
    page.wait_for_selector("#status >> text=found")
    assert in_address(page) == kept
    page.click("#tab-keep")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Scenario", exact=True).click()
    waiting.value.save_as(tmp_path / "made.yaml")
    made = scenarios.load_scenario(tmp_path / "made.yaml")
    assert made.scene.grid.blocked.shape == (30, 40)
    assert getattr(made.map, "settings", None) == {"density": 0.1}


def test_a_size_that_no_recipe_takes_is_a_sentence(page: Any, wrong: list[str]) -> None:
    page.get_by_role("button", name="Make a map").click()
    box = page.get_by_role("group", name="Make a map")
    box.get_by_label("Kind of map").select_option("warehouse")
    box.get_by_label("columns").fill("5")
    box.locator("[role=status] >> text=too small").wait_for()
    assert box.get_by_role("button", name="Open this map").is_disabled()
    assert page.locator("#notes .note").count() == 0
    assert [text for text in wrong if "400" not in text] == []
    wrong.clear()


# ---- files that take a while --------------------


def test_a_film_says_its_share_and_is_stopped_and_made_whole(page: Any, tmp_path: Path) -> None:
    page.click("#tab-keep")
    keep = page.locator("#keep")
    keep.get_by_role("button", name="WebP").wait_for()
    page.evaluate(
        """() => {
          const words = document.querySelector("#keep [role=status]");
          const bar = document.querySelector("#keep progress");
          window.told = [];
          new MutationObserver(() => window.told.push([words.textContent, bar.value, bar.hidden]))
            .observe(words, { childList: true });
        }"""
    )
    with page.expect_download() as waiting:
        keep.get_by_role("button", name="WebP").click()
    waiting.value.save_as(tmp_path / "run.webp")
    assert (tmp_path / "run.webp").read_bytes()[8:12] == b"WEBP"
    keep.locator("[role=status] >> text=Saved").wait_for()
    told = page.evaluate("window.told")
    shares = [(words, value) for words, value, _ in told if "Drawing the film" in words]
    assert shares
    for words, value in shares:
        done, of = (int(word) for word in words.split(": ")[1].split(" frames")[0].split(" of "))
        assert abs(value - done / of) <= 0.2
    # Stopped as soon as the first share is told: a quick machine has drawn it before anybody could press.
    page.evaluate(
        """() => {
          const words = document.querySelector("#keep [role=status]");
          const all = [...document.querySelectorAll("#keep button")];
          const stop = all.find((one) => one.textContent === "Stop");
          new MutationObserver(() => words.textContent.includes("Drawing the film") && stop.click())
            .observe(words, { childList: true });
        }"""
    )
    keep.get_by_role("button", name="GIF").click()
    keep.locator("[role=status] >> text=Stopped.").wait_for()
    assert keep.locator("progress").is_hidden()
    with page.expect_download() as again:
        keep.get_by_role("button", name="CSV").click()
    assert again.value.suggested_filename.endswith(".csv")


# ---- why it is as fast as it is --------------------


def test_the_chart_of_a_run_says_what_bounds_it_and_what_the_rules_allow(page: Any) -> None:
    page.click("#tab-traffic")
    page.get_by_label("Random walkers").fill("20")
    page.keyboard.press("Tab")
    page.click("#tab-settings")
    page.locator("#settings .law select").first.select_option("dissertation")
    page.wait_for_timeout(300)
    page.get_by_label("Speed of play").select_option("50")
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Play again").wait_for()
    plot = page.locator("#charts .u-over").first.bounding_box()
    said = []
    for share in (0.2, 0.4, 0.6, 0.8):
        page.mouse.move(plot["x"] + share * plot["width"], plot["y"] + 30)
        said.append(page.locator("#charts figcaption").first.inner_text())
    for words in said:
        speed = float(words.split(": ")[1].split(" ")[0])
        bounds = [float(part.split("≤ ")[1]) for part in words.split("; ")[1].split(", ")]
        assert bounds == sorted(bounds)
        assert speed <= bounds[0] + 0.5
        cause = words.split(" vu, ")[1].split(";")[0]
        assert f"{cause} ≤" not in words, "the speed itself says what its own rule allows"
    assert any("ring 1 ≤" in words for words in said)
    assert all("limit ≤ 80" in words for words in said)
    # The same on the plan's chart has its own words, and the distance chart its line.
    page.mouse.move(10, 10)
    assert page.locator("#charts figcaption").nth(1).inner_text().startswith("Free distance, m")
    red = page.evaluate(
        """() => {
          const canvas = document.querySelectorAll("#charts canvas")[1];
          const { width } = canvas;
          const { data } = canvas.getContext("2d").getImageData(0, 0, width, canvas.height);
          const rows = new Map();
          for (let k = 0; k < data.length; k += 4) {
            if (data[k] === 179 && data[k + 1] === 38 && data[k + 2] === 30 && data[k + 3] === 255) {
              const y = Math.floor(k / 4 / width);
              rows.set(y, (rows.get(y) ?? 0) + 1);
            }
          }
          return [...rows.values()].filter((many) => many > width / 2).length;
        }"""
    )
    assert red == 2, "the line of contact, two pixels high, from side to side"


# ---- layers of large maps --------------------


def test_a_layer_that_takes_long_says_so_and_the_old_one_stays(page: Any) -> None:
    """Answers are held back for longer than anybody used to wait, and the seed changes again and again."""
    page.get_by_label("Cost", exact=True).check()
    page.wait_for_selector("#layers .ly-legend", state="visible")
    before = page.inner_text("#layers .ly-ends")

    def late(route: Any) -> None:
        page.wait_for_timeout(1500)
        route.continue_()

    asked: list[str] = []
    page.on("request", lambda one: asked.append(one.url) if one.url.endswith("/api/layer") else None)
    page.route("**/api/layer", late)
    page.click("#tab-settings")
    seed = page.get_by_label("seed", exact=True).first
    for k in range(1, 4):
        seed.fill(str(k))
        page.keyboard.press("Tab")
        page.wait_for_timeout(150)
    page.wait_for_selector("#layers .ly-busy >> text=Cost of 50 × 50 cells")
    assert page.inner_text("#layers .ly-ends") == before
    assert page.locator("#layers .ly-legend").is_visible()
    page.locator("#layers .ly-busy").wait_for(state="hidden")
    assert 1 <= len(asked) <= 3
    assert not page.locator("#layers .bad").count()


def test_a_plan_that_takes_long_is_not_taken_for_the_one_before(page: Any) -> None:
    """While the answer is held back the status says so, and not that the path to the old goal was found."""

    def late(route: Any) -> None:
        page.wait_for_timeout(1500)
        route.continue_()

    page.route("**/api/plan", late)
    page.click("#tab-settings")
    page.get_by_label("seed", exact=True).first.fill("7")
    page.keyboard.press("Tab")
    page.wait_for_selector("#status >> text=Planning")
    page.wait_for_selector("#status >> text=the one from before the change")
    assert page.locator("#status >> text=found").count() == 0
    page.wait_for_selector("#status >> text=found")
    assert page.locator("#status >> text=Planning").count() == 0


# ---- studies of worlds that change --------------------


def test_walls_that_come_later_are_in_no_study_and_the_page_says_what_to_do(page: Any) -> None:
    made = {**in_address(page), "edits": [{"tick": 4, "blocked": [[20, 12], [21, 12]], "freed": []}]}
    opened(page, made)
    page.click("#tab-compare")
    page.wait_for_selector("#compare .cannot >> text=A study draws new obstacles")
    send = page.get_by_role("button", name="Send to a study")
    assert send.is_disabled()
    page.get_by_role("button", name="Compare", exact=True).click()
    page.wait_for_selector("#compare table.measures")
    page.get_by_role("button", name="Leave", exact=True).click()
    page.get_by_role("button", name="Walls from the start").click()
    assert in_address(page)["edits"] == [{"tick": 0, "blocked": [[20, 12], [21, 12]], "freed": []}]
    assert page.locator("#compare .cannot").is_hidden()
    assert send.is_enabled()


# ---- runs side by side --------------------


def test_side_by_side_each_map_has_its_own_run_and_the_walls_of_the_moment(
    page: Any,
) -> None:
    wall = [[k, 2] for k in range(2, 9)]
    crowd = [{"kind": "random-walk", "count": 25}]
    opened(
        page, {**in_address(page), "obstacles": crowd, "edits": [{"tick": 6, "blocked": wall, "freed": []}]}
    )
    page.click("#tab-compare")
    page.get_by_role("button", name="Compare", exact=True).click()
    page.wait_for_selector("#compare table.measures")
    page.wait_for_selector("#compare >> text=The obstacles are those of")
    page.get_by_role("button", name="Side by side").click()
    page.wait_for_selector("#compare >> text=Each map shows the obstacles of its own run")
    slider = page.get_by_role("slider", name="Moment")
    slider.focus()

    def pictures(tick: int) -> list[list[int]]:
        page.keyboard.press("Home")
        for _ in range(tick):
            page.keyboard.press("ArrowRight")
        page.wait_for_timeout(200)
        drawn(page)
        found: list[list[int]] = page.evaluate(PICTURES)
        return found

    first, later, last = pictures(0), pictures(3), pictures(12)
    assert len(first) == 3
    for k in range(3):
        assert first[k] != later[k], "time goes on in every map"
        walls = [sum(1 for v in some[k] if v < 130) for some in (first, last)]
        assert walls[1] > walls[0], "the wall has come in every map"
    assert len({tuple(some) for some in last}) == 3, "each is another run"


PICTURES = """() => [...document.querySelectorAll(".mosaic canvas")].map((canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const out = [];
  for (let k = 0; k < data.length; k += 4) out.push(data[k] + data[k + 1] + data[k + 2]);
  return out;
})"""
