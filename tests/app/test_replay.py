"""Replays: one file that plays a run offline, asks nobody for anything, and shows the digest of the result."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_browser import needs_chromium
from page_person import moment, until
from PIL import Image

import in_process
from lampyris import Fleet, Grid, plan_fleet
from lampyris.app.engine import work
from lampyris.app.engine.frames import json_frame
from lampyris.app.replay import bundle
from lampyris.app.replay.page import replay_page
from lampyris.app.replay.streams import compact, fleet_digest, fleet_replay
from lampyris.errors import InternalFault
from lampyris.model.fleet.fleet import Agent
from lampyris.report.style import FREE

ROWS = ["S.......", "...##...", "...##...", ".......G"]
HOSTILE = "</script><script>alert(1)</script><img src=x> & \" '"
SCENARIO: dict[str, Any] = {
    "version": 1, "map": {"rows": ROWS, "name": HOSTILE}, "planner": "astar", "simulate": {"ticks": 40},
    "obstacles": [{"kind": "recorded", "track": [[7, 0], [6, 0], [5, 0], [5, 1]]}],
    "edits": [{"tick": 2, "blocked": [[0, 3]], "freed": []}],
}  # fmt: skip
MOST = 1_000_000


def exported(scenario: dict[str, Any], **settings: Any) -> str:
    """The file that the app exports."""
    question = {"verb": "export", "scenario": scenario, "what": "replay", "settings": settings}
    pieces = list(work.answer(question, lambda: None))
    data = b"".join(piece[5:] for piece in pieces if piece[4:5] == b"B")
    assert pieces[-1] == json_frame("Z", {"bytes": len(data)})
    return data.decode()


def printed(folder: Path, *words: str) -> tuple[str, str]:
    """A call of the command line that writes ``r.html``: the file, and SHA-256 of the JSON that it prints."""
    done = in_process.call(*words, "--replay", "r.html", "--json", "--no-timing", "--force", cwd=folder)
    assert done.returncode in (0, 4), done.stderr
    digest = hashlib.sha256(done.stdout.rstrip("\n").encode()).hexdigest()
    assert f"digest of the replay: {digest}" in done.stderr
    return (folder / "r.html").read_text("utf-8"), digest


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="run">(.*?)</script>', page, re.DOTALL)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


def test_the_file_holds_the_digest_of_what_is_printed_and_allows_its_own_scripts_alone(
    tmp_path: Path,
) -> None:
    (tmp_path / "s.json").write_text(json.dumps(SCENARIO))
    page, digest = printed(tmp_path, "run", "s.json")
    assert data_of(page)["digest"] == digest
    assert data_of(exported(SCENARIO, layer="cost"))["digest"] == digest, "the app's own is of the same run"
    assert len(page.encode()) < MOST / 3
    assert page == printed(tmp_path, "run", "s.json")[0], "the same bytes every time"

    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy
    rules = dict(one.strip().split(" ", 1) for one in policy[1].replace("&#39;", "'").split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["img-src"] == "data:"
    assert "unsafe" not in policy[1]
    for kind, tag in (("script-src", "script"), ("style-src", "style")):
        texts = re.findall(rf"<{tag}>(.*?)</{tag}>", page, re.DOTALL)
        hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in texts]
        assert rules[kind] == " ".join(f"'sha256-{one}'" for one in hashes)
    # Three scripts were written, and none by the map's name.
    assert len(re.findall(r"</?script", page)) == 6
    assert "<img" not in page
    assert not re.search(r'(?:src|href)="(?!data:)', page.partition("<style>")[0])


def test_a_module_that_cannot_be_put_into_one_script_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Folder(dict[str, str]):
        def joinpath(self, name: str) -> Any:
            return type("File", (), {"read_text": lambda *_: self[name]})()

    made = Folder(
        a='import { b as c } from "./b.js";\nexport const two = 2 * c;',
        **{"b.js": "export const b = 1; // one"},
    )
    monkeypatch.setattr(bundle, "folder", lambda _: made)
    # As they are sent, without comments and needless spaces, each in a function of its own.
    assert re.sub(r"\s", "", bundle.script.__wrapped__("a")) == (
        '"usestrict";const$replay$b=(()=>{constb=1;return{b};})();'
        "const$replay$a=(()=>{const{b:c}=$replay$b;consttwo=2*c;return{two};})();"
    )
    for wrong in (
        'import x from "./b.js";',
        "export default 1;",
        'const a = "</script>";',
        'import("./b.js");',
    ):
        made["wrong"] = wrong
        with pytest.raises(InternalFault):
            bundle.script.__wrapped__("wrong")
    # Two that import each other: what one calls of the other is looked up when it is called, and only functions are.
    made["a"] = 'import { b } from "./b.js";\nexport const a = () => b;'
    made["b.js"] = 'import { a } from "./a";\nexport const b = () => a();'
    assert "consta=(...given)=>$replay$a.a(...given);" in re.sub(r"\s", "", bundle.script.__wrapped__("a"))
    made["b.js"] = 'import { A } from "./a";'
    with pytest.raises(InternalFault, match="which imports the module"):
        bundle.script.__wrapped__("a")


def test_modules_of_one_name_in_two_folders_are_two(monkeypatch: pytest.MonkeyPatch) -> None:
    class Folder(dict[str, str]):
        def joinpath(self, name: str) -> Any:
            return type("File", (), {"read_text": lambda *_: self[name]})()

    made = {
        "replay": Folder(
            **{
                "a.js": 'import { own } from "./b.js";\nimport { other } from "../static/b.js";\nexport const sum = own + other;',
                "b.js": "export const own = 1;",
            }
        ),
        "static": Folder(**{"b.js": "export const other = 2;"}),
    }
    monkeypatch.setattr(bundle, "folder", made.__getitem__)
    text = bundle.script.__wrapped__("a.js")
    assert "const own = 1;" in text.replace("const own=1", "const own = 1")
    assert re.sub(r"\s", "", text).count("const{other}=$static$b;") == 1
    assert re.sub(r"\s", "", text).count("const{own}=$replay$b;") == 1


def test_other_frames_stay_as_they_are() -> None:
    sent = json_frame("H", {"a": 1})
    assert compact(sent) is sent


# ---- what the browser makes of it --------------------


@pytest.fixture
def offline(browser: Any, tmp_path: Path) -> Iterator[Any]:
    """A tab without a network; whatever it asks for besides the file, and whatever it complains of, fails the test."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, offline=True)
    tab = context.new_page()
    wrong: list[str] = []
    tab.on("pageerror", lambda fault: wrong.append(str(fault)))
    tab.on("console", lambda said: wrong.append(said.text))
    tab.on("dialog", lambda said: wrong.append(said.message))
    tab.on(
        "request", lambda asked: wrong.append(asked.url) if asked.url[:5] not in ("file:", "data:") else None
    )

    def shown(page: str, name: str = "replay.html") -> Any:
        (tmp_path / name).write_text(page, "utf-8")
        tab.goto((tmp_path / name).as_uri())
        return tab

    tab.shown = shown
    tab.wrong = wrong
    yield tab
    context.close()
    assert not wrong


@needs_chromium
def test_a_replay_shades_what_a_robot_with_a_sensor_has_not_seen(offline: Any) -> None:
    sees = {"sensor_range": 2.0, "field_of_view": 120.0}
    tab = offline.shown(
        exported({**SCENARIO, "planner": "dstar-lite", "obstacles": [], "edits": [], "simulate": sees})
    )
    tab.wait_for_selector("body.ready")

    def free() -> int:
        """Pixels of the map that have the colour of free cells."""
        with Image.open(io.BytesIO(tab.locator("#map").screenshot())) as image:
            pixels = np.asarray(image.convert("RGB"))
        return int((pixels == FREE).all(axis=2).sum())

    tab.get_by_role("slider", name="Moment").focus()
    before = free()
    tab.keyboard.press("End")
    tab.wait_for_timeout(200)
    assert free() > 1.5 * before > 0
    assert "not yet seen" in tab.inner_text("#legend")


@needs_chromium
def test_a_replay_opens_offline_plays_and_scrubs(offline: Any, tmp_path: Path) -> None:
    (tmp_path / "s.json").write_text(json.dumps(SCENARIO))
    page, digest = printed(tmp_path, "run", "s.json")
    tab = offline.shown(page)
    tab.wait_for_selector("body.ready")
    assert tab.inner_text("#digest") == digest
    assert tab.inner_text("h1") == f"A* on {HOSTILE}"
    assert "A* (astar)" in tab.inner_text("#facts")
    assert moment(tab) == 0
    before = tab.locator("#map").screenshot()
    tab.get_by_role("button", name="Play").click()
    until(tab, lambda: moment(tab) > 0)
    tab.keyboard.press("End")
    last = moment(tab)
    assert last == data_last(page)
    assert tab.locator("#map").screenshot() != before
    track = tab.get_by_role("slider", name="Moment").bounding_box()
    tab.mouse.click(track["x"] + track["width"] / 2, track["y"] + track["height"] / 2)
    assert 0 < moment(tab) < last
    assert tab.locator("#charts canvas").count() == 2
    # Within a frame of another page, whose origin is another one.
    outer = (
        '<!doctype html><iframe src="replay.html" sandbox="allow-scripts" width="800" height="500"></iframe>'
    )
    framed = offline.shown(outer, "outer.html").frame_locator("iframe")
    framed.locator("body.ready").wait_for()
    framed.get_by_role("button", name="Play").click()
    framed.get_by_role("button", name="Pause").wait_for()


def data_last(page: str) -> int:
    """The last tick of a run's file, of the first frame of ticks that it holds."""
    import struct
    import zlib

    stream = zlib.decompress(base64.b64decode(data_of(page)["stream"]), -15)
    at = ticks = 0
    while at < len(stream):
        size = struct.unpack_from("<I", stream, at)[0]
        if stream[at + 4 : at + 5] == b"T":
            ticks += struct.unpack_from("<IH", stream, at + 5)[1]
        at += 4 + size
    return ticks - 1


@pytest.mark.nightly
@needs_chromium
def test_a_drive_among_fifty_people_is_light_and_opens_within_a_second(offline: Any, tmp_path: Path) -> None:
    words = ["drive", "office-120", "--radius", "0.3", "--obstacles", "50", "--seed", "3"]
    page, digest = printed(tmp_path, *words)
    assert len(page.encode()) < MOST / 2
    tab = offline.shown(page)
    tab.wait_for_selector("body.ready")
    assert tab.evaluate("performance.getEntriesByType('navigation')[0].domComplete") < 1000
    assert tab.inner_text("#digest") == digest
    until(tab, lambda: re.search(r"of ([\d.]+) s", tab.inner_text("#status")))  # drawn with the next frame
    end = float(re.search(r"of ([\d.]+) s", tab.inner_text("#status"))[1])  # type: ignore[index]
    record = json.loads(in_process.call(*words, "--json", cwd=tmp_path).stdout)
    assert abs(end - record["duration"]) < 0.06
    tab.keyboard.press("End")
    until(tab, lambda: record["sentence"] in tab.inner_text("#status"))
    tab.keyboard.press("Home")
    assert moment(tab) == 0


@pytest.mark.nightly
@needs_chromium
def test_a_fleet_is_replayed_too(offline: Any) -> None:
    fleet = Fleet(Grid([[False] * 9] * 5), [Agent((0, y), (8, 4 - y)) for y in range(5)])
    plan = plan_fleet(fleet, "lacam")
    page = replay_page(fleet_replay(plan, fleet))
    tab = offline.shown(page)
    tab.wait_for_selector("body.ready")
    assert tab.inner_text("#digest") == fleet_digest(plan, fleet)
    tab.keyboard.press("End")
    tab.wait_for_selector("#fleet-now >> text=5 of 5")
    assert f"{plan.makespan} ticks" in tab.inner_text("#fleet-now")
    box = tab.locator("#map").bounding_box()
    tab.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    tab.locator("#fleet-robot").fill("2")
    tab.keyboard.press("Tab")
    tab.wait_for_selector("#fleet-now >> text=On its goal for good")
