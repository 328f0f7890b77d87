"""What a comparison says, keeps in its link and shows, in a browser. Skipped without chromium."""

from __future__ import annotations

import re
import struct
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import addressed, aim, drawn, in_address
from test_app_work import ask, robot_of, state
from test_page_gaps import opened

from lampyris.planning.registry import names, title_of
from sizes import some

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [needs_chromium, pytest.mark.nightly]


def compare(page: Any, seeds: int = 1) -> Any:
    """Compare, and the table of it."""
    page.click("#tab-compare")
    page.get_by_label("seeds", exact=True).fill(str(seeds))
    page.get_by_role("button", name="Compare", exact=True).click()
    page.wait_for_selector("#compare table.measures")
    return page.locator("#compare table.measures")


def marks(table: Any) -> dict[str, list[str]]:
    """The mark of each cell of each row."""
    found = {}
    for row in table.locator("tbody tr").all():
        cells = row.locator("td").all_inner_texts()
        found[row.locator("th").inner_text()] = ["★" * ("★" in c) + "☆" * ("☆" in c) for c in cells]
    return found


# ---- who is best --------------------


def test_a_star_is_what_the_server_says_and_one_run_has_none(page: Any) -> None:
    page.click("#tab-traffic")
    page.get_by_label("Random walkers").fill("20")
    page.keyboard.press("Tab")
    table = compare(page)
    assert all("★" not in row for row in marks(table).values())
    assert any("☆" in row for row in marks(table).values())
    assert "takes 6 seeds" in table.locator("caption").inner_text()
    table = compare(page, 6)
    found = marks(table)
    labels = [text.strip() for text in table.locator("thead th").all_inner_texts()]
    planners = [next(name for name in names() if title_of(name) == label) for label in labels]
    best = ask("compare", as_asked(page), planners=planners, seeds=6)[-1][1]["best"]
    # Times are of the machine, and others here.
    rows = {title: found.get(title) for title in ("iterations", "expansions", "ticks", "waits", "replans")}
    for name, row in rows.items():
        who, star = best.get(name, {}).get("who", []), "★" if best.get(name, {}).get("sure") else "☆"
        assert row == [star if planner in who else "" for planner in planners], name
    assert {one["sure"] for name, one in best.items() if name in rows} == {True, False}


# ---- the link --------------------


def test_who_meets_and_the_comparison_that_is_shown_are_in_the_link(page: Any, browser: Any) -> None:
    page.click("#tab-compare")
    page.get_by_role("button", name="Take D* Lite out").click()
    page.get_by_label("Add a planner").select_option("jps")
    page.get_by_role("button", name="Add", exact=True).first.click()
    page.get_by_label("Add a speed law").select_option("constant")
    page.get_by_role("button", name="Add", exact=True).nth(1).click()
    compare(page, 2)
    page.get_by_role("button", name="Side by side").click()
    page.get_by_role("button", name="Pause").click()
    slider = page.get_by_role("slider", name="Moment")
    slider.focus()
    page.keyboard.press("Home")
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    addressed(page)
    link = page.evaluate("location.href")
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    other = context.new_page()
    other.goto(link)
    other.wait_for_selector("#compare table.measures")
    assert other.locator(".mosaic canvas").count() == 3
    assert other.get_by_label("seeds", exact=True).input_value() == "2"
    listed = [
        text.strip().removesuffix("×").strip() for text in other.locator(".entrants li").all_inner_texts()
    ]
    assert listed == ["AD-GSO", "A*", "Jump point search", "constant"]
    assert other.inner_text(".tl-where").startswith("5.0 s ")
    # Left, the comparison is in the link no more; who meets is.
    other.get_by_role("button", name="Leave", exact=True).click()
    addressed(other)
    other.reload()
    other.wait_for_selector("#status >> text=found")
    assert other.locator("#compare table.measures").count() == 0
    other.click("#tab-compare")
    assert other.get_by_label("seeds", exact=True).input_value() == "2"
    context.close()


def as_asked(page: Any) -> dict[str, Any]:
    """The scenario of the address as the page sends it: without headings that nobody has set."""
    return {key: value for key, value in in_address(page).items() if value is not None}


@pytest.mark.parametrize("text", some(['[["a"],[["b"]],-1,1,1e9]', "x", "[]", "[[[1]],0,0,9,9]", "null"]))
def test_a_link_that_no_page_has_written_chooses_nobody(page: Any, text: str) -> None:
    page.evaluate("(c) => { location.hash += '&c=' + encodeURIComponent(c); }", text)
    page.click("#tab-compare")
    page.wait_for_selector("#compare .entrants")
    page.wait_for_timeout(300)
    assert page.locator("#notes .bad").count() == 0


# ---- old comparisons, stopped ones, whose charts --------------------


def test_a_stopped_comparison_leaves_nothing_to_show_and_another_law_makes_it_old(page: Any) -> None:
    compare(page)
    page.wait_for_selector("#charts figcaption >> text=/over seconds \\(/")
    assert page.locator("#charts figcaption").first.inner_text().endswith(")")
    page.get_by_role("button", name="Leave", exact=True).click()
    page.wait_for_selector("#compare >> text=Show it")
    page.click("#tab-settings")
    page.locator("#settings .law select").first.select_option("constant")
    page.click("#tab-compare")
    page.wait_for_selector("#compare >> text=The world has changed since")
    page.route("**/api/compare", lambda route: None)
    page.get_by_role("button", name="Compare", exact=True).click()
    page.locator("#compare .meeting").get_by_role("button", name="Stop", exact=True).click()
    page.wait_for_selector("#compare >> text=Stopped.")
    assert page.get_by_role("button", name="Show it").is_hidden()


# ---- the walls of each run --------------------


def test_the_obstacles_of_the_overlay_are_those_of_the_longest_run(page: Any) -> None:
    opened(page, {**in_address(page), "obstacles": [{"kind": "random-walk", "count": 25}]})
    frames = ask("compare", as_asked(page), planners=["ad-gso", "astar", "dstar-lite"])
    runs: list[list[tuple[int, int]]] = []
    ticks: list[int] = []
    last: list[tuple[int, int]] = []
    for kind, value in frames:
        if kind == "Z":
            ticks.append(value["ticks"])
            runs.append(last)
        elif kind == "T":
            n, bodies = struct.unpack_from("<HH", value, 4)
            at = 8 + 9 * n
            last = [*struct.iter_unpack("<hh", value[at : at + 4 * n * bodies])][-bodies:]
    longest = ticks.index(max(ticks))
    others = {cell for k, run in enumerate(runs) if k != longest for cell in run}
    cell = next(cell for cell in runs[longest] if cell not in others)
    compare(page)
    page.wait_for_selector(
        f"#compare >> text=The obstacles are those of {('AD-GSO', 'A*', 'D* Lite')[longest]}"
    )
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("End")
    page.mouse.move(*aim(page, cell))
    page.wait_for_selector("#hover dt >> text=Obstacle")


def test_where_a_run_s_robot_stands_its_small_map_has_no_wall(page: Any) -> None:
    """A wall that comes where the first robot stands: in that run it does not come, in the others it does."""
    first, other, third = (
        robot_of(ask("simulate", state(planner=name))) for name in ("ad-gso", "astar", "dstar-lite")
    )
    tick = next(t for t in range(3, 40) if first[t] not in other[: t + 1] + third[: t + 1])
    cell = first[tick]
    opened(page, {**in_address(page), "edits": [{"tick": tick + 1, "blocked": [cell], "freed": []}]})
    compare(page)
    page.get_by_role("button", name="Side by side").click()
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("slider", name="Moment").focus()

    def seen(at: str) -> list[int]:
        page.keyboard.press(at)
        page.wait_for_timeout(300)
        drawn(page)
        found: list[int] = page.evaluate(SEEN, list(cell))
        return found

    before, after = seen("Home"), seen("End")
    assert [a < b - 200 for a, b in zip(after, before, strict=True)] == [False, True, True]


SEEN = """([x, y]) => [...document.querySelectorAll(".mosaic canvas")].map((canvas) => {
  const scale = Math.min((canvas.width - 12) / 50, (canvas.height - 12) / 50, 96);
  const at = (side, k) => Math.round((side - 50 * scale) / 2 + (k + 0.25) * scale);
  const pen = canvas.getContext("2d");
  const [r, g, b] = pen.getImageData(at(canvas.width, x), at(canvas.height, y), 1, 1).data;
  return r + g + b;
})"""


# ---- the window of results --------------------


@pytest.mark.nightly
def test_results_are_sorted_drawn_and_resized_and_studies_are_listed(page: Any) -> None:
    page.click("#tab-compare")
    page.get_by_role("button", name="Results page").click()
    page.wait_for_selector("#results >> text=No comparison of planners on cells yet")
    page.keyboard.press("Escape")
    page.get_by_label("seeds", exact=True).fill("6")
    page.get_by_role("button", name="Compare", exact=True).click()
    page.wait_for_selector("#compare table.measures")
    page.get_by_role("button", name="Results page").click()
    window = page.locator("#results")
    expansions = window.get_by_role("button", name="expansions", exact=True)

    def column() -> list[float]:
        at = window.locator("thead th").all_inner_texts()
        k = next(k for k, text in enumerate(at) if text.startswith("expansions"))
        cells = window.locator(f"tbody tr > :nth-child({k + 1})").all_inner_texts()
        return [float(text.split()[0].replace(",", "")) for text in cells]

    expansions.click()
    assert column() == sorted(column())
    page.keyboard.press("Enter")
    assert column() == sorted(column(), reverse=True)
    assert window.locator("th[aria-sort=descending]").count() == 1
    # Intervals are drawn where there are any, on axes of their own.
    assert window.locator(".rs-multiples .rs-one", has_text="planning (ms)").locator(".whisker").count() == 3
    assert window.locator(".rs-coordinates g").count() == 3
    before = window.locator(".rs-coordinates line").count()
    window.get_by_label("iterations", exact=True).check()
    assert window.locator(".rs-coordinates line").count() == before + 1
    box = window.bounding_box()
    page.mouse.move(box["x"] + box["width"] - 4, box["y"] + box["height"] - 4)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] - 204, box["y"] + box["height"] - 104, steps=4)
    page.mouse.up()
    assert window.bounding_box()["width"] < box["width"] - 100
    window.get_by_role("button", name="Close the results").click()

    page.get_by_label("starts and goals").fill("1")
    page.get_by_label("seeds of each").fill("2")
    page.get_by_role("button", name="Send to a study").click()
    page.wait_for_selector("#compare >> text=Done:", timeout=240_000)
    page.get_by_role("button", name="Results page").click()
    window.get_by_role("button", name=re.compile("^Show here")).click()
    page.wait_for_selector("#results-title >> text=Study on env-3")
    assert window.locator("tbody tr").count() == 3
