"""Every panel and window of the page against WCAG 2.2 AA by axe-core.

axe-core (MPL 2.0) is no part of this project: ``make check-nightly`` and ``tools/browser.sh axe`` fetch it by npm into
build/axe, and the variable LAMPYRIS_AXE names another ``axe.min.js``; without it this is skipped.
"""

from __future__ import annotations

import itertools
import os
from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium
from page_states import scenes, states

FETCHED = Path(__file__).parents[2] / "build" / "axe" / "node_modules" / "axe-core" / "axe.min.js"
AXE = Path(os.environ.get("LAMPYRIS_AXE") or FETCHED)
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
RUN = """async (rules) => (await axe.run(document, { runOnly: rules, resultTypes: ["violations"] })).violations
  .map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map(({ target }) => target.join(" ")).join(", ")}`)"""
SIZES = {"desk": (1440, 900), "small desk": (1280, 720), "tablet": (834, 1112), "telephone": (390, 844)}

pytestmark = [
    needs_chromium,
    pytest.mark.nightly,
    pytest.mark.skipif(
        not AXE.is_file(), reason="axe-core is not there: tools/browser.sh axe fetches it by npm"
    ),
]


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES)
def test_no_panel_and_no_window_violates_wcag(browser: Any, address: str, size: str, theme: str) -> None:
    width, height = SIZES[size]
    # The page's own policy lets no script in that it has not brought.
    context = browser.new_context(
        viewport={"width": width, "height": height},
        color_scheme=theme,
        has_touch=width < 900,
        bypass_csp=True,
    )
    page = context.new_page()
    page.goto(address)
    page.wait_for_selector("body.ready")
    page.wait_for_selector("#status >> text=found")
    wrong: list[str] = []
    many = 0
    for state in itertools.chain(states(page), scenes(page, address)):
        many += 1
        # A page that was opened anew has not got it.
        if not page.evaluate("'axe' in window"):
            page.evaluate(AXE.read_text(encoding="utf-8"))
        wrong += [f"{state}: {one}" for one in page.evaluate(RUN, RULES)]
    print(f"{size}, {theme}: {many} states, {len(wrong)} violations")
    context.close()
    assert many > 40
    assert not wrong, "\n".join(wrong)
