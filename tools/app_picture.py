"""The app's page in the middle of a run, as a picture: docs/img/app.png, for the README.

    python tools/app_picture.py [OUT]

Needs Chromium and the development tools (`make test` installs both).
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile

from playwright.sync_api import sync_playwright

MAP, WALKERS, TICK = "env-3", 20, 24
SIZE = {"width": 1280, "height": 760}


def main() -> None:
    """Draw it."""
    out = sys.argv[1] if len(sys.argv) > 1 else "docs/img/app.png"
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
            address = re.search(r"http://\S+", server.stdout.readline() if server.stdout else "")
            if address is None:
                raise SystemExit("the app did not start")
            browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            page = browser.new_page(viewport=SIZE, color_scheme="light")
            page.goto(address[0])
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
            page.wait_for_timeout(6000)  # what was said above the map goes
            page.screenshot(path=out)
            browser.close()
        finally:
            server.terminate()


if __name__ == "__main__":
    main()
