"""The whole walk without a mouse: Tab, arrows, Enter, Space and the keys that the help lists."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import fact, in_address, loaded, moment, until
from PIL import Image

from sizes import some

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = needs_chromium

MOST = 140
HERE = """() => {
  const at = document.activeElement;
  if (!at || at === document.body) return null;
  const box = at.getBoundingClientRect(), look = getComputedStyle(at);
  const label = at.labels?.[0], ring = label && box.width < 2 ? getComputedStyle(label) : look;
  const seen = (label && box.width < 2 ? label : at).getBoundingClientRect();
  const x = Math.min(Math.max((seen.left + seen.right) / 2, 0), innerWidth - 1);
  const y = Math.min(Math.max((seen.top + seen.bottom) / 2, 0), innerHeight - 1);
  const over = document.elementFromPoint(x, y);
  const labelled = at.getAttribute('aria-labelledby');
  return {
    role: at.getAttribute('role') ?? at.tagName.toLowerCase(),
    name: (at.getAttribute('aria-label') ?? (labelled && document.getElementById(labelled)?.innerText)
      ?? label?.innerText ?? at.innerText ?? '').trim().replace(/\\s+/g, ' '),
    ring: (ring.outlineStyle !== 'none' && parseFloat(ring.outlineWidth) >= 1.5) || ring.boxShadow !== 'none',
    seen: seen.width > 0 && (at.contains(over) || over?.contains(at) || over?.closest('label') === label),
  };
}"""


def here(page: Any) -> dict[str, Any] | None:
    """What has the focus; if anything has it, it is to be seen."""
    found: dict[str, Any] | None = page.evaluate(HERE)
    if found:
        assert found["ring"], f"no ring: {found}"
        assert found["seen"], f"not on the screen: {found}"
        assert found["name"], f"no name: {found}"
    return found


def tab_to(page: Any, name: str, key: str = "Tab") -> None:
    """Go on with Tab until what is called so has the focus."""
    for _ in range(MOST):
        page.keyboard.press(key)
        at = here(page)
        if at and re.fullmatch(name, at["name"]):
            return
    raise AssertionError(f"no way by Tab to {name}")


def cursor(page: Any) -> tuple[int, int]:
    """Where the map's cursor is, as it is said to anyone who cannot see it."""
    said = re.match(r"column (\d+), row (\d+), \w+", page.inner_text("[aria-live=polite]#live"))
    assert said, page.inner_text("#live")
    return int(said[1]), int(said[2])


def walk_to(page: Any, cell: tuple[int, int]) -> None:
    """Move the cursor, by tens and by ones."""
    press = page.keyboard.press
    press("ArrowRight")
    x, y = cursor(page)
    for off, less, more in [(cell[0] - x, "ArrowLeft", "ArrowRight"), (cell[1] - y, "ArrowUp", "ArrowDown")]:
        for _ in range(abs(off) // 10):
            press(f"Shift+{more if off > 0 else less}")
        for _ in range(abs(off) % 10):
            press(more if off > 0 else less)
    assert cursor(page) == cell


@pytest.mark.nightly
def test_the_walk_without_a_mouse(page: Any, tmp_path: Path) -> None:
    press = page.keyboard.press

    # A map from the library, found by its name.
    press("1")
    tab_to(page, "Find a map")
    page.keyboard.type("env-3")
    tab_to(page, "env-3 50 × 50")
    press("Enter")
    page.locator("#where").get_by_text("env-3").wait_for()

    # Start and goal with the cursor.
    press("m")
    at = here(page)
    assert at
    assert at["name"] == "Map"
    # While the map that was chosen is opened there is none for the cursor to be on.
    until(page, lambda: press("ArrowRight") or "column" in page.inner_text("#live"))
    walk_to(page, (4, 4))
    press("s")
    assert page.inner_text("#live") == "start at column 4, row 4"
    walk_to(page, (45, 46))
    press("g")
    assert page.inner_text("#live") == "goal at column 45, row 46"
    page.get_by_text("A path was found.").first.wait_for()
    now = in_address(page)
    assert (now["map"], now["start"], now["goal"], now["edits"]) == ("env-3", [4, 4], [45, 46], [])
    walk_to(page, (8, 2))
    until(page, lambda: "free" in page.inner_text("#live") or "wall" in page.inner_text("#live"))

    # Run, pause, scrub.
    press("Space")
    until(page, lambda: moment(page) >= 12)
    press("Space")
    paused = moment(page)
    before = fact(page, "Tick").split()[-1]
    tab_to(page, "Moment")
    press("ArrowLeft")
    assert moment(page) == paused - 1
    press("Home")
    press("Shift+ArrowRight")
    assert moment(page) == 10

    # A wall across the way, in a line; the cursor is where it was.
    press("m")
    assert cursor(page) == (8, 2)
    walk_to(page, (1, 27))
    press("w")
    assert page.inner_text("#live") == "wall at column 1, row 27"
    walk_to(page, (14, 27))
    press("Shift+W")
    assert page.inner_text("#live") == "wall from column 1, row 27 to column 14, row 27"
    until(page, lambda: fact(page, "Tick").split()[-1] not in (before, f"{before}+"))
    until(page, lambda: not fact(page, "Tick").endswith("+"))
    assert moment(page) == 10
    (edit,) = in_address(page)["edits"]
    assert (edit["tick"], edit["freed"]) == (11, [])
    assert {(x, 27) for x in range(1, 15)} >= {tuple(cell) for cell in edit["blocked"]} >= {(1, 27), (9, 27)}
    press("End")
    page.get_by_text("The robot arrived at the goal.").first.wait_for()
    assert page.locator("#status li").filter(has_text="replanned").count() == 1
    digest = fact(page, "Digest")

    # Three planners.
    press("5")
    page.get_by_role("button", name="Compare", exact=True).wait_for()
    tab_to(page, "Compare")
    press("Enter")
    table = page.locator("#compare table").first
    table.wait_for()
    head = table.get_by_role("columnheader").all_inner_texts()
    assert [word for word in head if word.strip()] == ["AD-GSO", "A*", "D* Lite"]
    tab_to(page, "Side by side")
    press("Space")
    page.get_by_role("img", name="A* on the map").wait_for()
    tab_to(page, "Leave")
    press("Enter")
    press("4")
    page.get_by_text("The robot arrived at the goal.").first.wait_for()

    # A film, and the same state after loading the page again.
    press("6")
    page.get_by_role("button", name="WebP", exact=True).wait_for()
    tab_to(page, "WebP")
    with page.expect_download() as coming:
        press("Enter")
    coming.value.save_as(tmp_path / "film.webp")
    with Image.open(tmp_path / "film.webp") as film:
        assert film.n_frames > 20
    state = in_address(page)
    page.reload()
    until(page, lambda: page.locator("#status dt").get_by_text("Digest").count() == 1)
    assert fact(page, "Digest") == digest
    assert in_address(page) == state


def circle(page: Any, key: str) -> list[str]:
    """The names of all that takes the focus from here until the page's end."""
    names: list[str] = []
    for _ in range(MOST):
        page.keyboard.press(key)
        at = here(page)
        if at is None:
            return names
        names.append(at["name"])
    raise AssertionError(f"{key} never leaves: {names[-4:]}")


@pytest.mark.nightly
@pytest.mark.parametrize(("left", "right"), some([("3", "6"), ("1", "4"), ("2", "5"), ("1", "7")]))
def test_the_focus_goes_round_and_is_seen_everywhere(page: Any, left: str, right: str) -> None:
    """With every panel open in turn: no trap, nothing without a name or a ring, and the same way back."""
    page.keyboard.press(left)
    page.keyboard.press(right)
    page.wait_for_selector('body:not(:has([aria-busy="true"]))')
    loaded(page)
    circle(page, "Tab")
    there, back = circle(page, "Tab"), circle(page, "Shift+Tab")
    assert len(there) > 25
    assert there == back[::-1]


def test_the_help_lists_the_keys_and_gives_the_focus_back(page: Any) -> None:
    page.keyboard.press("m")
    page.keyboard.press("?")
    help_ = page.get_by_role("dialog", name="Keys")
    help_.wait_for()
    keys = set(help_.locator("kbd").all_inner_texts())
    assert set("SGWXRMTLVBEP?") | {"Enter", "Space", "Home", "End", "Esc"} <= keys
    for _ in range(12):
        page.keyboard.press("Tab")
        at = here(page)
        assert at is None or page.evaluate("document.activeElement.closest('dialog')?.open"), at
    page.keyboard.press("Escape")
    assert not help_.is_visible()
    at = here(page)
    assert at
    assert at["name"] == "Map"


@pytest.mark.nightly
def test_all_maps_are_one_stop_of_tab_and_arrows_go_among_them(page: Any) -> None:
    tab_to(page, "Find a map")
    page.keyboard.press("Tab")
    assert (here(page) or {})["name"].startswith("env-3"), "the open one"
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowUp")
    assert (here(page) or {})["name"].startswith("guide") or (here(page) or {})["name"].startswith("env-")
    page.keyboard.press("Home")
    first = (here(page) or {})["name"]
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowUp")
    assert (here(page) or {})["name"] == first
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    page.locator("#where").get_by_text("env-1").wait_for()
    page.keyboard.press("Tab")
    assert not (here(page) or {})["name"].startswith("env-")
    # A search leaves a way in, wherever the stop was.
    page.get_by_label("Find a map").fill("env-6")
    page.keyboard.press("Tab")
    assert (here(page) or {})["name"].startswith("env-6")


@pytest.mark.nightly
def test_escape_leaves_a_field(page: Any) -> None:
    page.get_by_role("tab", name="Traffic").click()
    field = page.get_by_label("Random walkers")
    field.fill("4")
    page.keyboard.press("Escape")
    assert page.evaluate("document.activeElement === document.body")
    page.keyboard.press("b")
    assert page.get_by_role("button", name="Paint walls").get_attribute("aria-pressed") == "true"


@pytest.mark.nightly
def test_the_focus_is_on_stop_while_it_compares_and_comes_back(page: Any) -> None:
    page.get_by_role("tab", name="Compare").click()
    held: list[Any] = []
    page.route("**/api/compare", lambda route: held.append(route))
    page.get_by_role("button", name="Compare", exact=True).focus()
    page.keyboard.press("Enter")
    until(page, lambda: (here(page) or {}).get("name") == "Stop")
    until(page, lambda: bool(held))
    held[0].continue_()
    page.locator("#compare table").first.wait_for()
    assert (here(page) or {})["name"] == "Compare"
