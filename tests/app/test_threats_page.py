"""Threats in a browser: nobody else is ever asked (W9), and names are words that run nowhere (W10)."""

from __future__ import annotations

import re
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from page_browser import needs_chromium
from page_person import until
from payloads import PAYLOADS, in_html, in_svg

import lampyris.app
import sizes
from lampyris.app.engine import export as kept
from lampyris.app.engine.parse import scenario_of_request

HERE = Path(__file__).parent
ROWS = ["." * 12] * 8


MAKERS = (".googleapis.com", ".google.com", ".gvt1.com")


@pytest.fixture(scope="module")
def address(shared_library: str) -> str:
    """Of the app whose library is written to."""
    return shared_library


class Elsewhere:
    """A proxy for all that is not this machine: it writes down who was asked for and answers nobody."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        threading.Thread(target=self._take, daemon=True).start()

    def _take(self) -> None:
        while True:
            try:
                wire, _ = self._socket.accept()
            except OSError:
                return
            with wire:
                wire.settimeout(2)
                try:
                    self.asked.append(wire.recv(500).decode("latin-1").partition("\r\n")[0])
                except OSError:
                    self.asked.append("a connection")

    def close(self) -> None:
        """End."""
        self._socket.close()


@contextmanager
def watched(browser: Any) -> Iterator[tuple[Any, list[str]]]:
    """A browser that was never here, and everything in it that should not have been."""
    elsewhere = Elsewhere()
    context = browser.new_context(
        viewport={"width": 1280, "height": 720},
        proxy={"server": f"http://127.0.0.1:{elsewhere.port}", "bypass": "127.0.0.1"},
        accept_downloads=True,
    )
    context.add_init_script(path=HERE / "threat_page.js")
    wrong: list[str] = []

    def ask(request: Any) -> None:
        if not re.match(r"http://127\.0\.0\.1:\d+/|blob:http://127\.0\.0\.1|data:|file:///", request.url):
            wrong.append(f"request {request.url}")

    context.on("request", ask)
    context.on("page", lambda tab: tab.on("pageerror", lambda fault: wrong.append(f"error {fault}")))
    context.on("dialog", lambda dialog: (wrong.append(f"dialog {dialog.message}"), dialog.dismiss()))
    context.on("console", lambda said: wrong.append(said.text) if "Security Policy" in said.text else None)
    try:
        yield context, wrong
        for tab in context.pages:
            wrong += tab.evaluate("window.refused ?? []")
            if tab.evaluate("window.hit"):
                wrong.append(f"something ran in {tab.url}")
        # What a browser asks of its own maker, whatever page is shown, is not the page's doing.
        wrong += [one for one in elsewhere.asked if not one.split(":443")[0].endswith(MAKERS)]
    finally:
        context.close()
        elsewhere.close()


def arrive(context: Any, address: str) -> Any:
    """The page, once it has a plan."""
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")
    return tab


# ---- nobody else is asked (W9) --------------------


@pytest.mark.nightly
@needs_chromium
def test_the_watch_sees_what_it_should(browser: Any, address: str) -> None:
    """The other half of the tests below: they would pass as well if nothing were watched."""
    with watched(browser) as (context, wrong):
        tab = arrive(context, address)
        tab.evaluate(
            """async () => {
              const shot = document.createElement("img");
              shot.src = "http://evil.example/x.png";
              document.body.append(shot);
              const inline = document.createElement("script");
              inline.textContent = "window.hit = 1";
              document.body.append(inline);
              await fetch("http://evil.example/").catch(() => {});
            }"""
        )
        until(tab, lambda: len(tab.evaluate("window.couldRun()")) > 1)
        until(tab, lambda: len({one.split()[0] for one in tab.evaluate("window.refused")}) > 2)
        until(tab, lambda: any("Security Policy" in one for one in wrong))
        assert tab.evaluate("window.couldRun()") == ["img src=http://evil.example/x.png", "script"]
        seen = tab.evaluate("window.refused")
        assert sorted({one.split()[0] for one in seen}) == ["connect-src", "img-src", "script-src-elem"]
        assert any("Security Policy" in one for one in wrong)
        other = context.new_page()
        other.goto("about:blank")
        other.evaluate("fetch('http://evil.example/', {mode: 'no-cors'}).catch(() => {})")
        until(other, lambda: any("evil.example" in one and "request" in one for one in wrong))
        other.wait_for_timeout(200)
        other.close()
        tab.close()
    assert any(one.startswith(("GET http://evil.example", "CONNECT")) for one in wrong), wrong


SPARED = ("Delete", "Stop", "Take", "Send to a study", "Open files")
"""Beginnings of what is not pressed here: a study has a test of its own, and a dialog of files has no end."""


def everything(tab: Any) -> list[str]:
    """Press all there is, panel by panel; what was pressed."""
    found = []
    for name in tab.locator("[role=tab]").evaluate_all("some => some.map((one) => one.id)"):
        if name == "tab-compare":
            # What comes now is made by the server: of a small world.
            small = {**valid("small again"), "obstacles": [{"kind": "random-walk", "count": 1}]}
            assert tab.evaluate("([one, seen]) => window.openLink(one, seen)", [small, "small again"])
        tab.evaluate("id => document.getElementById(id).click()", name)
        panel = tab.get_attribute(f"#{name}", "aria-controls")
        press = "([id, spared]) => window.pressAll(document.getElementById(id), spared)"
        found += [f"{panel} {words}" for words in tab.evaluate(press, [panel, SPARED])]
    for bar in ("acts", "tools", "zoom", "timeline", "charts"):
        press = "([id, spared]) => window.pressAll(document.getElementById(id), spared)"
        found += [f"{bar} {words}" for words in tab.evaluate(press, [bar, SPARED])]
    return found


@pytest.mark.nightly
@needs_chromium
def test_no_panel_and_no_action_asks_anybody_else(browser: Any, address: str, tmp_path: Path) -> None:
    with watched(browser) as (context, wrong):
        tab = arrive(context, address)
        tab.on("download", lambda file: file.cancel())
        box = tab.locator("#map").bounding_box()
        middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        for key in "rwe b0+-[],.<>tlmp ?":
            tab.mouse.move(*middle)
            tab.keyboard.press(key if key != " " else "Space")
            tab.keyboard.press("Escape")
            if key in "web":
                tab.mouse.down()
                tab.mouse.move(middle[0] + 40, middle[1] + 20, steps=3)
                tab.mouse.up()
        pressed = everything(tab)
        assert {word.split()[0] for word in pressed} >= {
            "library",
            "compare",
            "keep",
            "learn",
            "acts",
            "tools",
        }
        assert len(pressed) >= 35, pressed
        tab.keyboard.press("Escape")
        said = tab.evaluate("window.giveFiles(['hall.csv', '0,0,0\\n0,1,0\\n0,0,0\\n'])")
        assert "3 × 3" in said
        tab.reload()
        tab.wait_for_selector("body.ready")
        assert tab.evaluate("window.couldRun()") == []
        # Let what is late be late.
        tab.wait_for_timeout(300)
    assert wrong == []


@pytest.mark.nightly
@needs_chromium
def test_a_study_and_its_report_ask_nobody_else(browser: Any, address: str) -> None:
    with watched(browser) as (context, wrong):
        tab = arrive(context, address)
        scenario = {
            "version": 1, "name": PAYLOADS[0], "map": {"rows": ROWS, "name": PAYLOADS[3]}, "start": [0, 0],
            "goal": [11, 7], "planner": "astar",
        }  # fmt: skip
        assert tab.evaluate("([one, seen]) => window.openLink(one, seen)", [scenario, PAYLOADS[0]])
        tab.click("#tab-compare")
        tab.fill("#study-seeds", "1")
        tab.fill("#study-queries", "1")
        tab.get_by_role("button", name="Send to a study").click()
        tab.wait_for_selector("text=/Done: \\d+ runs/")
        with context.expect_page() as opened:
            tab.get_by_role("button", name="Open the report").click()
        report = opened.value
        report.wait_for_selector("h1")
        # A frame of its own and no script: the sandbox says nothing back, so its text is asked for.
        assert "lampyris" in report.content()
        assert in_html(report.content())[0] == []
        report.close()
    assert wrong == []


STATIC = Path(lampyris.app.__file__).parent / "static"
ADDRESS = re.compile(rb"(?:https?:)?//[a-z0-9-]+(?:\.[a-z0-9-]+)+", re.IGNORECASE)
SPACES = (b"//www.w3.org",)
"""Names of kinds of XML: not addresses."""
COMMENT = re.compile(rb"/\*[\s\S]*?\*/|^\s*//[^\n]*", re.MULTILINE)
SINKS = (
    b"innerHTML", b"outerHTML", b"insertAdjacentHTML", b"document.write", b"eval(", b"new Function",
    b"srcdoc", b"importScripts", b"new WebSocket", b"EventSource", b"sendBeacon", b"XMLHttpRequest",
    b"serviceWorker", b"document.domain", b"postMessage", b"createContextualFragment", b"DOMParser",
    b"setHTML",
)  # fmt: skip


def test_nothing_that_is_shipped_names_another_address() -> None:
    files = {file.name: file.read_bytes() for file in STATIC.iterdir()}
    assert len(files) > 30
    for name, data in files.items():
        if name.endswith(".txt"):
            continue
        text = COMMENT.sub(b"", data)
        found = [one for one in ADDRESS.findall(text) if not one.lower().endswith(SPACES)]
        assert found == [], (name, found)
        assert b"@import" not in text, name
        for url in re.findall(rb"url\(([^)]*)\)", text):
            assert url.strip(b"\"'").startswith((b"#", b"data:")), (name, url)
        for sink in SINKS:
            assert sink not in text, (name, sink)
        if name.endswith((".html", ".svg")):
            plain = text.decode()
            assert not re.search(r"<script(?![^>]*\ssrc=)", plain), name
            assert not re.search(r"\s(on[a-z]+|style)\s*=", plain), name
            assert "<style" not in plain
            leads = re.findall(r"\s(?:src|href)=\"([^\"]*)\"", plain)
            assert all(lead.startswith(("/static/", "#")) for lead in leads), name


# ---- names are words (W10) --------------------


def valid(payload: str) -> dict[str, Any]:
    """A scenario that is one, of strange names."""
    return {
        "version": 1, "name": payload, "map": {"rows": ROWS, "name": payload}, "start": [0, 0],
        "goal": [11, 7], "planner": "astar",
    }  # fmt: skip


def broken(payload: str) -> list[dict[str, Any]]:
    """Scenarios that are none: what is wrong with them is told in their own words."""
    one = valid("plain")
    return [
        {**one, "planner": payload},
        {**one, "law": payload},
        {**one, "obstacles": [{"kind": "random-walk", "count": 1, payload: "id"}]},
        {**one, "obstacles": [{"kind": payload}]},
        {**one, "planner": {"name": "ad-gso", "settings": {payload: 1}}},
        {**one, payload: payload},
        {**one, "map": payload},
    ]


def wrong_files(payload: str) -> list[tuple[str, str]]:
    """Files that are none."""
    inside = payload.replace("\\", "\\\\").replace('"', '\\"')
    return [
        (f"{payload}.csv", "0,0\n0,1\n"),
        ("cells.csv", f"0,0\n0,{payload}\n"),
        ("map.txt", f"..{payload}\n...\n"),
        ("place.yaml", f'version: 1\nmap: "{inside}\n"{inside}": 1\n'),
        ("place.json", f'{{"version": 1, "map": "{inside}", "{inside}": 1}}'),
    ]


MOST = [PAYLOADS[k : k + 11] for k in range(0, len(PAYLOADS), 11)]
FEW = PAYLOADS[:44:9]


@pytest.mark.nightly
@needs_chromium
@pytest.mark.parametrize(
    "some", sizes.some((one,) for one in [FEW, *MOST]), ids=["few", "first", "second", "third", "fourth"]
)
def test_strange_names_are_shown_as_words(browser: Any, address: str, some: tuple[str, ...]) -> None:
    """Each as a name; of mistakes and of files every kind of the first, and one in turn of every third."""
    show(browser, address, some, lambda k, kind: k == 0 or (k % 3 == 0 and kind == k % 7 % 5))


@needs_chromium
@pytest.mark.nightly
@pytest.mark.parametrize("some", MOST, ids=["first", "second", "third", "fourth"])
def test_strange_names_are_shown_as_words_everywhere(
    browser: Any, address: str, some: tuple[str, ...]
) -> None:
    show(browser, address, some, lambda k, kind: True)


def show(browser: Any, address: str, some: tuple[str, ...], wanted: Callable[[int, int], bool]) -> None:
    """Open and give the page all that holds these names; ``wanted``: the place of a name, the kind."""
    with watched(browser) as (context, wrong):
        tab = arrive(context, address)
        for k, payload in enumerate(some):
            assert tab.evaluate("([one, seen]) => window.openLink(one, seen)", [valid(payload), payload])
            for kind in filter(lambda kind, k=k: wanted(k, kind), range(len(broken(payload)))):
                # The number tells one message from another; what is long is cut, what is odd is escaped.
                one = broken(f"{kind}{k}{payload}")[kind]
                start = re.match(r"[^\\'\"]{0,3}", payload)
                seen = f"{kind}{k}{start[0] if start else ''}"
                # A map that is not there is told in a note; what else is wrong, where the plan would be.
                where = "body" if kind == 6 else "#status"
                open_ = "([one, seen, where]) => window.openLink(one, seen, where)"
                assert tab.evaluate(open_, [one, seen, where]), one
            for kind, (name, content) in enumerate(wrong_files(payload)):
                if wanted(k, kind):
                    assert tab.evaluate("one => window.giveFiles(one)", [name, content]), (name, content)
            assert tab.evaluate("window.couldRun()") == [], payload
        tab.reload()  # the draft
        tab.wait_for_selector("body.ready")
        assert tab.evaluate("window.couldRun()") == []
    assert wrong == []


def files_of(payload: str, *kinds: str) -> dict[str, str]:
    """What is kept of a scenario with strange names."""
    scenario = scenario_of_request({"scenario": valid(payload)})
    return {
        what: b"".join(
            piece[5:]
            for piece in kept.export({"what": what, "settings": {"layer": "none"}}, scenario, lambda: None)
            if piece[4:5] == b"B"
        ).decode()
        for what in kinds
    }


def check_kept(payload: str) -> None:
    """A drawing, numbers, a report: words are words, and there is nothing else."""
    made = files_of(payload, "svg", "csv", "report", "scenario")
    bad, _ = in_svg(made["svg"])
    assert bad == []
    bad, words = in_html(made["report"])
    assert bad == []
    assert payload in words
    assert "Content-Security-Policy" in made["report"]
    for line in made["csv"].splitlines()[1:]:
        for cell in line.split(","):
            assert not cell.startswith(("=", "+", "@", "\t")), line
            assert not cell.startswith("-") or float(cell) <= 0, line
    again = scenario_of_request({"scenario": _yaml(made["scenario"])})
    assert again.name == payload


def _yaml(text: str) -> Any:
    from lampyris.io.text.strict_yaml import read_yaml

    return read_yaml(text.encode(), "kept").data


@pytest.mark.nightly
@pytest.mark.parametrize("payload", sizes.some([PAYLOADS[29], PAYLOADS[40], *PAYLOADS[:44:9]], 2))
def test_strange_names_are_words_in_what_is_kept(payload: str) -> None:
    check_kept(payload)


@pytest.mark.nightly
@pytest.mark.parametrize("payload", PAYLOADS)
def test_all_strange_names_are_words_in_what_is_kept(payload: str) -> None:
    check_kept(payload)


@pytest.mark.nightly
@needs_chromium
def test_what_was_kept_runs_nothing_when_it_is_opened(browser: Any, tmp_path: Path) -> None:
    """From the disk, where no server's policy holds."""
    with watched(browser) as (context, wrong):
        for k, payload in enumerate((PAYLOADS[1], PAYLOADS[29], PAYLOADS[40])):
            for what, content in files_of(payload, "svg", "report").items():
                file = tmp_path / f"kept{k}.{'html' if what == 'report' else what}"
                file.write_text(content, encoding="utf-8")
                tab = context.new_page()
                tab.goto(file.as_uri())
                tab.wait_for_timeout(50)
                if what == "report":
                    assert payload in tab.locator("body").inner_text()
                assert not tab.evaluate("window.hit")
                tab.close()
    assert wrong == []
