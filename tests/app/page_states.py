"""Named states of the page, for tests that look at each: tabs, runs, layers, windows, tours, poses, a sensor, a study."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Iterator
from typing import Any

TABS = ("library", "settings", "traffic", "compare", "keep", "learn", "now")


def turn(page: Any, tab: str) -> None:
    """To a tab, whose contents may come a moment later."""
    page.click(f"#tab-{tab}")
    page.locator(f"#{tab}:not([aria-busy=true]) h2:visible").first.wait_for()


def link(address: str, scenario: dict[str, Any]) -> str:
    """The address of a page that shows a scenario."""
    packer = zlib.compressobj(wbits=-15)
    packed = packer.compress(json.dumps({"version": 1, "edits": [], **scenario}).encode()) + packer.flush()
    said = base64.urlsafe_b64encode(packed).decode().rstrip("=")
    return f"{address.split('&')[0]}&s={said}"


def states(page: Any) -> Iterator[str]:
    """Go through the page: each tab with all that unfolds, a run, a layer, a comparison, the tour, help."""
    yield "first"
    for tab in TABS:
        turn(page, tab)
        page.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
        yield tab
    page.click("#tab-traffic")
    page.get_by_label("Random walkers").fill("5")
    page.keyboard.press("Tab")
    yield "traffic with walkers"
    page.click("#tab-now")
    page.get_by_role("button", name="Play", exact=True).click()
    page.wait_for_selector(".st-speed:not([hidden])")
    page.get_by_role("button", name="Pause").click()
    page.locator("input[value=cost]").check(force=True)
    page.wait_for_selector(".ly-legend:not([hidden])")
    yield "run"
    turn(page, "fleet")
    page.fill("#fleet-number", "30")
    page.get_by_role("button", name="Plan", exact=True).click()
    page.locator("#fleet-now dt:text-is('Makespan')").wait_for(state="attached")
    page.get_by_role("button", name="Pause").click()
    page.locator("#fleet-robot").evaluate("one => { one.value = 3; one.dispatchEvent(new Event('change')); }")
    yield "fleet"
    page.click("#tab-now")
    yield "fleet, its numbers"
    page.click("#tab-fleet")
    page.get_by_role("button", name="Glowworms").click()
    page.get_by_role("button", name="Simulate", exact=True).click()
    page.get_by_role("button", name="Pause").click()
    yield "swarm"
    page.click("#tab-now")
    yield "swarm, its numbers"
    page.click("#tab-compare")
    page.get_by_label("seeds", exact=True).fill("2")
    page.get_by_role("button", name="Compare", exact=True).click()
    page.wait_for_selector("#compare table.measures")
    yield "compared"
    page.get_by_role("button", name="Results page").click()
    page.wait_for_selector("#results[open] .rs-coordinates")
    yield "results"
    page.get_by_role("button", name="Close the results").click()
    page.get_by_role("button", name="Leave", exact=True).click()
    page.get_by_role("button", name="Race", exact=True).click()
    page.get_by_role("button", name="Pause").click()
    yield "race"
    page.keyboard.press("Escape")
    page.click("#tab-now")
    page.get_by_role("button", name="In 3-D").click()
    page.get_by_role("button", name="Pause").click()
    yield "landscape"
    page.keyboard.press("Escape")
    page.click("#tab-learn")
    page.get_by_role("button", name="Begin the tour").click()
    for step in range(12):
        page.wait_for_selector(f"#learn >> text=Step {step + 1} of 12")
        yield f"tour {step + 1}"
        if step < 11:
            page.get_by_role("button", name="Next").click()
    page.get_by_role("button", name="Leave the tour").click()
    page.get_by_role("button", name="Show its steps").click()
    page.get_by_label("Pace").wait_for()
    yield "steps"
    page.get_by_role("button", name="Keys and help").click()
    yield "help"


# ---- scenes of their own, each of a page that is opened on it ----

HALL = ["." * 24 for _ in range(9)] + ["#" * 15 + "." * 9] + ["." * 24 for _ in range(8)]
YARD: dict[str, Any] = {
    "map": {"rows": HALL, "name": "yard", "resolution": 0.25}, "start": [3, 4], "goal": [4, 14], "preset": "robot",
    "seed": 4, "obstacles": [{"kind": "random-walk", "count": 3}],
}  # fmt: skip
CAR = {"rectangle": [0.9, 0.5], "drive": "ackermann", "turn_radius": 0.8}


def opened(page: Any, address: str) -> None:
    """Another address in the same tab, as if it were opened anew."""
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_selector("body.ready")


def scenes(page: Any, address: str) -> Iterator[str]:
    """The first scene with its tour, and scenes that :func:`states` has not: each after its page was opened anew."""
    # A browser that was never here: no draft, no welcome that was closed.
    page.goto(re.sub("(//[^/]+/).*", r"\1static/icon.svg", address))
    page.evaluate("localStorage.clear(), sessionStorage.clear()")
    opened(page, address.partition("&m=")[0])
    page.locator(".st-cause").first.wait_for()
    page.wait_for_timeout(1500)
    yield "opening"
    page.get_by_role("button", name="Take the tour").click()
    for step in range(1, 6):
        page.locator("#first-steps").get_by_text(f"Step {step} of 5").wait_for()
        yield f"first steps {step}"
        page.locator("#first-steps .btn.primary").click()
    page.keyboard.press("Control+k")
    page.locator("dialog.palette[open]").wait_for()
    yield "commands"
    page.keyboard.press("Escape")
    opened(page, link(address, {**YARD, "planner": "astar", "robot": {"radius": 0.4}}))
    page.wait_for_selector("#status >> text=found")
    page.get_by_text("Inflation", exact=False).first.click()
    page.locator("#legend li").get_by_text("too close to a wall").wait_for(state="attached")
    yield "inflation"
    page.locator("input[value=clearance]").check(force=True)
    page.wait_for_selector(".ly-legend:not([hidden])")
    page.get_by_text("Contour lines").click()
    page.wait_for_timeout(300)
    yield "inflation, clearance, contours"
    walled = [*HALL[:9], "#" * 24, *HALL[10:]]
    opened(page, link(address, {**YARD, "map": {**YARD["map"], "rows": walled}, "planner": "astar"}))
    page.locator("#legend li").get_by_text("reachable from", exact=False).first.wait_for(state="attached")
    yield "no path"
    seen = {"sensor_range": 1.5, "field_of_view": 90.0}
    opened(page, link(address, {**YARD, "planner": "dstar-lite", "simulate": seen}))
    page.get_by_role("button", name="Play", exact=True).click()
    page.wait_for_selector(".st-speed:not([hidden])")
    page.get_by_role("button", name="Pause").click()
    yield "sensor"
    opened(page, link(address, {**YARD, "planner": "lattice", "robot": CAR}))
    page.wait_for_selector("#status >> text=Length")
    turn(page, "settings")
    page.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
    yield "poses"
    page.get_by_role("group", name="Drive", exact=True).get_by_label("rpp", exact=True).check()
    page.get_by_role("button", name="Play", exact=True).click()
    page.locator(".st-results th[scope=col]").nth(1).wait_for(state="attached")
    page.get_by_role("button", name="Pause").click()
    page.click("#tab-now")
    yield "drive"
    page.click("#tab-keep")
    yield "drive, export"
    opened(page, link(address, {**YARD, "planner": "astar"}))
    turn(page, "compare")
    page.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
    page.get_by_label("seeds of each", exact=True).fill("2")
    page.get_by_label("starts and goals", exact=True).fill("2")
    page.get_by_role("button", name="Send to a study").click()
    page.get_by_role("button", name="Open the report").wait_for()
    yield "study"
