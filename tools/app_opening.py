"""Record the answers about the app's opening scene: `python tools/app_opening.py`, after any change that they depend on.

It opens the page as somebody does who starts the app for the first time, notes what the page asks about the scene, answers
that with this tree, and writes src/lampyris/app/recorded/opening.gz. `tests/app/test_page_opening.py` compares it with
what the page asks, `tests/app/test_app_opening.py` with fresh answers.

Needs Chromium and the development tools (`make test` installs both).
"""

from __future__ import annotations

import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from lampyris.app.engine import work
from lampyris.app.server.opening import RECORD, RecordedAnswer, packed_record, without_times

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT.joinpath("src", "lampyris", "app", *RECORD)
VERBS = ("layer", "plan", "drive")
"""What the page asks about the scene before anybody touches it."""


def questions() -> dict[str, dict[str, Any]]:
    """The bodies of the page's first requests by their verbs."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    code = "from lampyris.app.server.run import run_app; run_app(None, port=0, browser=False)"
    asked: dict[str, dict[str, Any]] = {}

    def note(request: Any) -> None:
        verb = request.url.rpartition("/api/")[2]
        if request.method == "POST" and verb in VERBS:
            # As the server takes it: null is the same as no such key.
            given = json.loads(request.post_data)
            asked.setdefault(verb, {key: value for key, value in given.items() if value is not None})

    with tempfile.TemporaryDirectory() as home, sync_playwright() as started:
        env = {**os.environ, "XDG_DATA_HOME": home}
        with subprocess.Popen(
            [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=env
        ) as app:
            try:
                assert app.stdout is not None
                found = re.search(r"http://\S+", app.stdout.readline())
                assert found is not None
                browser = started.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
                tab = browser.new_page()
                tab.on("request", note)
                tab.goto(found[0])
                tab.locator(".st-cause", has_text="moving obstacle").wait_for(timeout=60_000)
                browser.close()
            finally:
                app.terminate()  # else the end of this block waits for it
    return {verb: asked[verb] for verb in VERBS}


def fresh_answer(verb: str, question: dict[str, Any]) -> RecordedAnswer:
    """What an engine answers, as it is recorded."""
    frames = work.answer({**question, "verb": verb, "job": None}, lambda: None)
    return RecordedAnswer(question, tuple(without_times(piece) for piece in frames if piece[4:5] != b"P"))


if __name__ == "__main__":
    answers = {verb: fresh_answer(verb, question) for verb, question in questions().items()}
    FILE.write_bytes(gzip.compress(packed_record(answers), 9, mtime=0))
    print(f"{FILE.relative_to(ROOT)}: {FILE.stat().st_size:,} bytes, {', '.join(answers)}")
