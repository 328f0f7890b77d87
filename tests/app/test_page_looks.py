"""What can be measured of how the page looks and reads: contrast, names, sizes, places, colours, motion."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_browser import needs_chromium
from page_states import TABS, scenes, states, turn
from test_page_play import needs_node, node

from lampyris.report import style
from lampyris.report.film import sprites

LOOK = (Path(__file__).parent / "page_look.js").read_text(encoding="utf-8").split("\n", 1)[1]
COLOURS = (files("lampyris.app") / "static" / "colours.js").read_text(encoding="utf-8")
SIZES = {"desk": (1280, 720), "telephone": (390, 844)}
LOOKS = (("desk", "light"), ("telephone", "dark"), ("desk", "dark"), ("telephone", "light"))
"""The first with every commit, the others by night."""


@pytest.fixture(
    params=[LOOKS[0], *(pytest.param(look, marks=pytest.mark.nightly) for look in LOOKS[1:])], ids="-".join
)
def page(request: pytest.FixtureRequest, browser: Any, address: str) -> Iterator[Any]:
    """The page in a browser that was never here, in each size and theme."""
    size, theme = request.param
    width, height = SIZES[size]
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=theme, has_touch=size == "telephone"
    )
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")
    yield tab
    context.close()


@pytest.mark.nightly
@needs_chromium
def test_texts_are_read_controls_are_hit_and_named_and_nothing_sticks_out(page: Any, address: str) -> None:
    session = page.context.new_cdp_session(page)
    wrong: list[str] = []
    texts = targets = controls = 0
    for state in itertools.chain(states(page), scenes(page, address)):
        found = page.evaluate(LOOK)
        texts += found["texts"]
        targets += found["targets"]
        wrong += [f"{state}, {what}: {one}" for what in ("pale", "small", "out") for one in found[what]]
        for one in session.send("Accessibility.getFullAXTree")["nodes"]:
            role = one.get("role", {}).get("value")
            if one["ignored"] or role not in CONTROLS:
                continue
            controls += 1
            if not one.get("name", {}).get("value", "").strip():
                wrong.append(f"{state}, no name: {role}")
    assert not wrong, "\n".join(dict.fromkeys(wrong))
    assert min(texts, targets, controls) > 700, (texts, targets, controls)


CONTROLS = (
    *(
        "button",
        "textbox",
        "searchbox",
        "spinbutton",
        "combobox",
        "checkbox",
        "radio",
        "radiogroup",
        "slider",
    ),
    *("tab", "tabpanel", "link", "toolbar", "dialog", "application", "complementary", "main"),
    *("progressbar", "image", "img"),
)
"""What must have a name for who cannot see it."""


@pytest.mark.nightly
@needs_chromium
def test_the_first_thing_to_do_is_seen_at_once(page: Any) -> None:
    view = page.viewport_size
    for what in ("#timeline .main", "#welcome", "#status .st-now", "#welcome button >> text=Take the tour"):
        box = page.locator(what).bounding_box()
        assert box["y"] >= 0, what
        assert box["y"] + box["height"] <= view["height"], what
        at = [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2]
        hit = "([x, y, s]) => document.elementFromPoint(x, y)?.closest(s) !== null"
        assert page.evaluate(hit, [*at, what.split(" >> ")[0]]), f"{what} is covered"
    assert page.locator("#timeline .main").inner_text() == "Play"
    assert "Play" in page.inner_text("#status .st-next")
    page.click("#timeline .main")
    page.wait_for_selector(".st-speed:not([hidden])")
    assert page.locator("#welcome").is_hidden()
    page.reload()
    page.wait_for_selector("body.ready")
    assert page.locator("#welcome").is_hidden(), "who has been here is not told again"


@needs_chromium
def test_landmarks_and_headings_lead_through_the_page(page: Any) -> None:
    told = page.locator("body").aria_snapshot()
    for line in ("- banner", "- main", '- heading "lampyris" [level=1]', "- contentinfo"):
        assert line in told, line
    assert page.locator("h1:visible").count() == 1
    for section in TABS:
        turn(page, section)
    spoken = page.locator("[aria-live=polite], [role=status], [role=alert]").count()
    assert spoken >= 3


@needs_chromium
def test_nothing_moves_by_itself_for_who_asked_for_that(browser: Any, address: str) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, reduced_motion="reduce")
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")
    tab.evaluate("document.body.classList.add('busy')")
    moving = """[...document.querySelectorAll('*')].filter((one) => {
      const style = getComputedStyle(one);
      return style.animationName !== 'none' || !/^0s(, 0s)*$/.test(style.transitionDuration);
    }).length"""
    assert tab.evaluate(moving) == 0
    assert tab.evaluate("document.getAnimations().length") == 0
    context.close()


@pytest.mark.nightly
@needs_chromium
def test_twice_as_large_it_is_the_telephone_s_page_and_all_is_reached(browser: Any, address: str) -> None:
    """A zoom of 200 % of 1280 x 720 is a window of 640 x 360 with two pixels for each."""
    context = browser.new_context(viewport={"width": 640, "height": 360}, device_scale_factor=2)
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")
    wrong = [f"{what}: {one}" for what in ("pale", "out") for one in tab.evaluate(LOOK)[what]]
    assert not wrong, wrong
    for section in TABS:
        turn(tab, section)
        last = tab.locator(f"#{section}").locator("button:visible, input:visible, h2:visible").last
        last.scroll_into_view_if_needed()
        box = last.bounding_box()
        assert box is not None
        assert box["height"] > 0
        assert 0 <= box["y"] < 360, section
    context.close()


@pytest.mark.nightly
@needs_chromium
def test_where_the_focus_is_is_seen(page: Any) -> None:
    page.keyboard.press("Tab")
    for _ in range(30):
        page.keyboard.press("Tab")
        ring = page.evaluate(
            """() => { const at = document.activeElement; const own = getComputedStyle(at);
            const near = at.nextElementSibling ? getComputedStyle(at.nextElementSibling) : own;
            return [at.tagName, at.id, parseFloat(own.outlineWidth) || parseFloat(near.outlineWidth),
              own.outlineStyle !== 'none' || near.outlineStyle !== 'none']; }"""
        )
        assert ring[0] == "BODY" or (ring[2] >= 1 and ring[3]), ring


# ---- colours ----

NUMBERS = """
import { THEMES, VEIL, levels } from "./colours.js";
const worst = {};
for (const theme of ["light", "dark"]) {
  const light = (v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
  const bright = (rgb) => 0.2126 * light(rgb[0]) + 0.7152 * light(rgb[1]) + 0.0722 * light(rgb[2]);
  const parsed = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
  const { colour, share } = VEIL[theme];
  const ink = bright(parsed(THEMES[theme].ink));
  worst[theme] = Math.min(...[...levels("landscape", theme === "dark")].slice(1).map((packed) => {
    const under = [packed & 255, (packed >> 8) & 255, (packed >> 16) & 255];
    const ground = bright(parsed(colour).map((v, i) => share * v + (1 - share) * under[i]));
    return (Math.max(ground, ink) + 0.05) / (Math.min(ground, ink) + 0.05);
  }));
}
console.log(JSON.stringify(worst));
"""


@needs_node
def test_numbers_on_a_landscape_are_read(tmp_path: Path) -> None:
    worst = node(tmp_path, NUMBERS)
    assert worst.keys() == {"light", "dark"}
    assert min(worst.values()) >= 4.5, worst


SEEN_BY = {
    "everybody": np.eye(3),
    "protanopia": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deuteranopia": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "tritanopia": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}
"""Linear RGB as dichromats see it (Machado, Oliveira and Fernandes 2009, severity 1)."""


def lab(colour: str, who: str) -> np.ndarray:
    """A colour in CIELAB as somebody sees it."""
    s = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    f = np.cbrt(
        np.maximum(xyz @ np.clip(np.array(SEEN_BY[who]) @ linear, 0, 1) / [0.9505, 1.0, 1.0888], 0.008856)
    )
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def block(name: str) -> str:
    """What a constant of colours.js is set to."""
    found = re.search(rf"const {name}(?:: [^=]+)? = (.*?);\n", COLOURS, re.DOTALL)
    assert found, name
    return found[1]


def pairs(name: str) -> dict[str, str]:
    """Words and their colours in a table of colours.js."""
    return {key.strip('"'): value for key, value in re.findall(r'("[^"]+"|\w+): "(#\w{6})"', block(name))}


@pytest.mark.parametrize("who", SEEN_BY)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_causes_are_told_apart_by_everybody_in_both_themes(who: str, theme: str) -> None:
    causes = {**pairs("CAUSES"), **(pairs("ON_DARK") if theme == "dark" else {})}
    one_look = ("ring 1", "ring 2", "angle")
    physical = sorted(set(causes) - set(one_look))
    assert len(physical) >= 15
    for a, b in itertools.combinations(physical, 2):
        away = float(np.linalg.norm(lab(causes[a], who) - lab(causes[b], who)))
        assert away >= 11.5, (a, b, away)


@pytest.mark.parametrize("who", SEEN_BY)
def test_scales_grow_in_lightness_for_everybody(who: str) -> None:
    for name in ("CIVIDIS", "INFERNO"):
        rows = [tuple(map(int, row.split(","))) for row in re.findall(r"\[(\d+, \d+, \d+)\]", block(name))]
        assert len(rows) >= 9
        light = [lab("#{:02x}{:02x}{:02x}".format(*row), who)[0] for row in rows]
        assert all(b - a > 2 for a, b in itertools.pairwise(light)), (name, light)


@pytest.mark.parametrize("who", SEEN_BY)
def test_start_goal_robot_walkers_path_and_second_planner_are_told_apart(who: str) -> None:
    marks = {
        name: re.search(rf'export const {name} = "(#\w{{6}})"', COLOURS)
        for name in ("ROBOT", "START", "GOAL")
    }
    shown = {name: found[1] for name, found in marks.items() if found}
    shown["walker"] = re.findall(r'"random-walk": \["circle", "(#\w{6})"', COLOURS)[0]
    shown["second"] = re.findall(r'\["(#\w{6})", \[', block("LINES"))[1]
    fast = [tuple(map(int, row.split(","))) for row in re.findall(r"\[(\d+, \d+, \d+)\]", block("INFERNO"))][
        -1
    ]
    shown["path"] = "#{:02x}{:02x}{:02x}".format(*fast)
    assert len(shown) == 6
    for (a, one), (b, other) in itertools.combinations(shown.items(), 2):
        assert float(np.linalg.norm(lab(one, who) - lab(other, who))) >= 19, (a, b)


def test_films_and_races_have_the_colours_of_the_page() -> None:
    def rgb(text: str) -> tuple[int, ...]:
        return tuple(int(text[k : k + 2], 16) for k in (1, 3, 5))

    for name, mark in (("START", sprites.START), ("GOAL", sprites.GOAL), ("ROBOT", sprites.ROBOT)):
        assert f'export const {name} = "#{bytes(mark).hex()}"' in COLOURS
    assert tuple(f"#{bytes(mark).hex()}" for mark in (sprites.START, sprites.GOAL)) == (
        style.START,
        style.GOAL,
    )
    kinds = re.findall(r'\["(\w+)", "(#\w{6})", "(\w)"\]', block("KINDS"))
    assert [(shape, rgb(colour), letter) for shape, colour, letter in kinds] == [
        one[:3] for one in sprites.KINDS.values()
    ]
    lines = re.findall(r'\["(#\w{6})", \[', block("LINES"))
    assert tuple(map(rgb, lines[: len(style.RACE)])) == style.RACE


def test_what_stands_on_the_map_differs_in_shape_and_lines_in_their_dashes() -> None:
    shapes = re.findall(r'\["(\w+)", "#\w{6}", "(\w)"\]', block("KINDS"))
    assert len(shapes) == 4
    assert len({shape for shape, _ in shapes}) == len({letter for _, letter in shapes}) == 4
    dashes = re.findall(r'\["#\w{6}", (\[[^\]]*\])\]', block("LINES"))
    assert len(dashes) == len(set(dashes)) == 8
