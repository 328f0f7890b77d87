"""Pages: whatever a name holds, a page shows it and obeys none of it."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from html_reader import page, part, read
from jinja2 import UndefinedError

import lampyris
from lampyris.report.charts import pair_charts, study_charts
from lampyris.report.charts.chart_parts import COLOURS, ErrorBar, Steps, look, thinned
from lampyris.report.charts.svg import clean
from lampyris.report.html.render import PageFigure, printable
from lampyris.report.html.table import Tab
from sizes import some

HOSTILE = (
    "<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "' onmouseover='x", "a & b < c > d",
    "</td></table>", "<!-- ", "]]>", "$\\frac{1}{2}$", "$x", "\u202eevil\u202c", "\x00\x1b[31m", "a\nb",
    "_hidden", "日本語 経路", "\ud800", "", " ", "url(http://a)", "--ink: red", "x" * 300,
)  # fmt: skip
NAN = math.nan


def test_every_word_is_escaped_and_shown() -> None:
    for words in HOSTILE:
        whole = page(
            words, '<p>{{ words }}</p><a href="#a" title="{{ words }}">x</a><p id="a"></p>', words=words
        )
        reader = read(whole)
        told = "".join(reader.words)
        if words.isprintable():
            assert told.count(words) >= 2
        assert "script" not in reader.seen
        whole.encode("utf-8")


def test_signs_that_turn_or_hide_text_are_spelled_out() -> None:
    assert printable("a\u202eb\x00") == "a\\u202eb\\x00"
    assert printable("\ud800") == "\\ud800"
    assert part("{{ a }}{{ b }}{{ c }}", a="a\u202eb<", b=None, c=3.5) == "a\\u202eb&lt;3.5"


def test_a_name_that_a_template_is_not_given_is_an_error() -> None:
    with pytest.raises(UndefinedError):
        part("{{ nothing }}")


REPLAY = "page.html.j2"
"""The page of a replay runs scripts, those of which its policy holds the hashes: tests/app/test_replay.py."""
TEMPLATES = sorted(file for file in Path(lampyris.__file__).parent.rglob("*.j2") if file.name != REPLAY)


@pytest.mark.parametrize("file", TEMPLATES, ids=lambda file: file.name)
def test_no_template_runs_or_loads_anything_or_takes_text_as_html(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert not re.search(
        r"<(script|iframe|form|object|link)|\son[a-z]+=|javascript:|https?://(?!www.w3.org/2000/svg)", text
    )
    assert not re.search(r"autoescape", text)
    # Only drawings of ours are HTML already.
    assert set(re.findall(r"([\w.]+)\s*\|\s*safe", text)) <= {"one.drawing", "printed", "ours"}
    for found in re.findall(r'(?:src|href)="([^"]*)"', text):
        assert found.startswith("#") or "|data_uri(" in found or file.name == "open.html.j2", found


def test_a_table_has_its_title_heads_rows_and_note() -> None:
    rows = (("<x>", 1.5, "12.3 [11.9, 12.8] n 4"), ("y", None, "z" * 60))
    tab = Tab("t", "Title", ("", "a", "b"), rows, "Note.")
    drawn = part("{{ table(tab, total=true) }}", tab=tab)
    reader = read(page("p", "{{ table(tab) }}", tab=tab))
    assert "".join(reader.words).count("Title") == 1
    assert "<caption><span>Title</span></caption>" in drawn
    assert '<th scope="row">&lt;x&gt;</th>' in drawn
    assert "12.3 <small>[11.9, 12.8] n 4</small>" in drawn
    assert '<td class="long">' in drawn
    assert drawn.count('<tr class="total">') == 1
    assert '<td class="right">-</td>' in drawn
    assert '<p class="note">Note.</p>' in drawn
    assert 'id="tab-t"' in drawn


def test_pictures_are_held_in_the_page() -> None:
    drawn = part("{{ image(data, 'image/webp', alt) }}", data=b"\x00\x01", alt='a "film"')
    assert drawn == '<img src="data:image/webp;base64,AAE=" alt="a &#34;film&#34;">'


FIGURES = "{% for one in drawn %}{{ figure(one) }}{% endfor %}"


def charts(names: list[str]) -> list[str]:
    """One of each kind of figure."""
    n = len(names)
    rng = np.random.default_rng(n)
    lines = [ErrorBar(v, v - 1, v + 1) for v in rng.uniform(5, 90, n)]
    gone = [ErrorBar(NAN, NAN, NAN) for _ in names]
    alone = [ErrorBar(3.0, NAN, NAN) for _ in names]
    values = [rng.uniform(1, 9, 6).tolist() for _ in names]
    values[0][0] = NAN
    steps = [Steps((1.0, 1.5, 3.0), (0.2, 0.5, 0.9)) for _ in names]
    steps[-1] = Steps((), ())
    both = list(zip(names, values, strict=True))
    few = both[:3]
    return [
        study_charts.bars("bars", ["(0, 0) to (1, 1)"] * 6, few, "y", "x"),
        study_charts.dots("dots", names, [("no obstacles", lines), (names[0], gone), ("c", alone)], "x"),
        study_charts.dots("share", names, [("a", lines)], "x", share=True),
        study_charts.density("density", [0.0, 5.0], [(w, lines[:1] * 2) for w in names], "y"),
        study_charts.profiles("profiles", list(zip(names, steps, strict=True)), "x"),
        study_charts.scatter("scatter", [(w, v, v[::-1]) for w, v in both], "x", "y"),
        pair_charts.strips("strips", [(k, w, values[k][1:], lines[k]) for k, w in enumerate(names)], "x"),
        pair_charts.critical("critical", names, list(range(1, n + 1)), 1.5, [(0, min(1, n - 1))]),
    ]  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("n", some([3, 1, 24]))
def test_figures_are_sound_small_and_the_same_bytes(n: int) -> None:
    names = [f"planner {k}" for k in range(n)]
    first, again = charts(names), charts(names)
    assert first == again
    reader = read(page("p", FIGURES, drawn=[PageFigure(drawn, "what it shows") for drawn in first]))
    assert reader.seen.count("svg") == len(first)
    told = " ".join(reader.words)
    assert all(told.count(name) >= 6 for name in names)
    assert sum(map(len, first)) < 60_000 + 25_000 * n
    assert not re.search(r"\bnan\b|\binf\b", told)


def test_figures_take_the_colours_and_the_font_of_the_page() -> None:
    for drawn in charts(["a", "b"]):
        assert "var(--ink" in drawn
        assert "sans-serif" in drawn
        assert "20242c" not in drawn.replace("var(--ink, #20242c)", "")
        assert "<svg" in drawn
        assert "max-width" in drawn.partition(">")[0]


def test_a_planner_has_its_colour_in_every_panel_of_shares() -> None:
    names, colours = ["a", "b"], COLOURS
    panels = [(crowd, [ErrorBar(40.0, 30.0, 50.0)] * 2) for crowd in ("none", "some", "many")]
    drawn = study_charts.dots("share", names, panels, "x", share=True)
    assert [c in drawn for c in colours] == [True, True, *[False] * (len(colours) - 2)]


@pytest.mark.nightly
@pytest.mark.parametrize("words", some(HOSTILE, 2))
def test_figures_show_any_name(words: str) -> None:
    drawn = charts([words, "b"])
    read(page("p", FIGURES, drawn=[PageFigure(one, words) for one in drawn]))
    if words.startswith("$"):
        assert words in "".join(drawn)
        assert "\\$" not in "".join(drawn)


def test_names_are_cut_where_there_is_no_room() -> None:
    assert clean("abcdef", 6) == "abcdef"
    assert clean("abcdefg", 6) == "abc..."
    assert clean("a\nb", 9) == "a\\nb"


def test_figures_of_many_queries_are_thinned() -> None:
    many = np.random.default_rng(1).normal(size=5000).tolist()
    steps = Steps(tuple(np.linspace(1, 9, 5000)), tuple(np.linspace(0, 1, 5000)))
    drawn = (
        pair_charts.strips("a", [(0, "x", many, ErrorBar(0.0, -1.0, 1.0))], "x"),
        study_charts.scatter("b", [("x", many, many)], "x", "y"),
        study_charts.profiles("c", [("x", steps)], "x"),
    )
    assert all(len(one) < 40_000 for one in drawn)
    assert thinned([1, 2, 3], 3) == [1, 2, 3]
    assert thinned(list(range(100)), 3) == [0, 49, 99]


def test_twenty_four_lines_can_be_told_apart() -> None:
    looks = {(colour, str(dash)) for colour, dash, _ in map(look, range(24))}
    marks = {(colour, mark) for colour, _, mark in map(look, range(24))}
    assert len(looks) == len(marks) == 24


def test_figures_of_nothing_are_drawn() -> None:
    nothing = ErrorBar(NAN, NAN, NAN)
    drawn = (
        study_charts.dots("a", ["x"], [("p", [nothing])], "y"),
        study_charts.profiles("b", [("x", Steps((), ()))], "y"),
        study_charts.scatter("c", [("x", [NAN], [1.0])], "x", "y"),
        pair_charts.strips("d", [(0, "x", [], nothing)], "x"),
        study_charts.bars("e", ["g"], [("x", [NAN])], "y", "x"),
        pair_charts.critical("f", ["x", "y"], [1.5, 1.5], NAN, []),
    )
    read(page("p", FIGURES, drawn=[PageFigure(one, "") for one in drawn]))
