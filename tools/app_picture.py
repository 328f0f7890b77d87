"""The app's page in the middle of a run, as a picture: docs/img/app.png, for the README; and of a car's drive:
docs/img/app-drive.png, for docs/app.md.

    python tools/app_picture.py [OUT]
    python tools/app_picture.py --drive [OUT]

Needs Chromium and the development tools (`make test` installs both).
"""

from __future__ import annotations

import base64
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zlib
from typing import Any

import numpy as np
from playwright.sync_api import sync_playwright

MAP, WALKERS, TICK = "env-3", 20, 24
SIZE = {"width": 1280, "height": 760}


CAR: dict[str, Any] = {
    "footprint": [[3.6, 0.9], [-0.9, 0.9], [-0.9, -0.9], [3.6, -0.9]], "drive": "ackermann", "turn_radius": 5.0,
    "v_max": 3.0, "a_max": 1.0, "d_max": 2.0,
}  # fmt: skip
PEDESTRIANS = 5
SHARE = 0.62
"""Of the drive that is over in its picture."""


def car_park() -> list[str]:
    """The rows of a car park of 0.25 m cells."""
    walls = np.zeros((100, 140), dtype=bool)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    walls[64:68, :100] = True
    for k in range(6):
        walls[2:30, 14 + 18 * k : 16 + 18 * k] = True
    return ["".join("#" if wall else "." for wall in row) for row in walls]


def scenario() -> dict[str, Any]:
    """A car that parks in reverse among pedestrians, driven by three controllers."""
    return {
        "version": 1, "map": {"rows": car_park(), "name": "car park", "resolution": 0.25},
        "start": {"cell": [16, 83], "yaw": 0.0}, "goal": {"cell": [60, 7], "yaw": -math.pi / 2}, "robot": CAR,
        "planner": {"name": "lattice", "settings": {"weight": 1.05}}, "preset": "robot", "seed": 5,
        "obstacles": [{"kind": "random-walk", "count": PEDESTRIANS, "radius": 0.3}], "edits": [],
        "drive": {"controller": "rpp", "obstacle_speed": 0.8},
        "controllers": [{"name": "exact", "settings": {}}, {"name": "pure-pursuit", "settings": {}}],
    }  # fmt: skip


def run_page(page: Any) -> None:
    """A run of env-3 in ticks, with the layer of luciferin."""
    page.get_by_text("A path was found.").first.wait_for()
    page.get_by_role("tab", name="Traffic").click()
    page.get_by_label("Random walkers").fill(str(WALKERS))
    page.keyboard.press("Tab")
    page.get_by_role("button", name="Play", exact=True).click()
    moment = page.get_by_role("slider", name="Moment")
    page.get_by_role("button", name="Play again").wait_for()
    moment.focus()
    page.keyboard.press("Home")
    for _ in range(TICK):
        page.keyboard.press("ArrowRight")
    page.get_by_label("Luciferin", exact=True).check()


def drive_page(page: Any) -> None:
    """A drive of a car by several controllers, in its middle."""
    page.get_by_role("tab", name="Planner").click()
    page.get_by_role("group", name="Drive", exact=True).scroll_into_view_if_needed()
    page.get_by_role("button", name="Drive", exact=True).click()
    page.locator(".st-results th[scope=col]").nth(2).wait_for(timeout=120_000)
    page.get_by_role("slider", name="Moment").focus()
    page.keyboard.press("Home")
    for _ in range(round(SHARE * 20)):
        page.keyboard.press("PageUp")


def main() -> None:
    """Draw it."""
    words = [word for word in sys.argv[1:] if word != "--drive"]
    drive = len(words) < len(sys.argv) - 1
    out = words[0] if words else f"docs/img/app{'-drive' if drive else ''}.png"
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("there is no Chromium: tools/browser.sh installs it")
    command = [sys.executable, "-m", "lampyris", "app", MAP, "--no-browser", "--port", "0"]
    with (
        tempfile.TemporaryDirectory() as home,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, env={**os.environ, "XDG_DATA_HOME": home}
        ) as server,
        sync_playwright() as driver,
    ):
        try:
            found = re.search(r"http://\S+", server.stdout.readline() if server.stdout else "")
            if found is None:
                raise SystemExit("the app did not start")
            address = found[0]
            if drive:
                packer = zlib.compressobj(wbits=-15)
                packed = packer.compress(json.dumps(scenario()).encode()) + packer.flush()
                said = base64.urlsafe_b64encode(packed).decode().rstrip("=")
                address = f"{address.partition('&m=')[0]}&s={said}"
            browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            page = browser.new_page(viewport=SIZE, color_scheme="light")
            page.on("console", lambda one: print(one.text) if one.type == "error" else None)
            page.on("pageerror", lambda fault: print(fault))
            page.goto(address)
            (drive_page if drive else run_page)(page)
            page.wait_for_timeout(6000)  # what was said above the map goes
            page.screenshot(path=out)
            browser.close()
        finally:
            server.terminate()


if __name__ == "__main__":
    main()
