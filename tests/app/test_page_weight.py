"""How heavy the page is, what of it comes when, and that nothing in it is dead."""

from __future__ import annotations

import gzip
import re
import socket
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from app_server import World, own, run
from page_browser import app, needs_chromium
from page_person import loaded

from lampyris.app.server.scripts import stripped_script, stripped_style

STATIC = files("lampyris.app").joinpath("static")
NOT_OURS = "uplot.js"
TYPES_ONLY = "types.js"
PARTS = re.compile(r'\["([a-z]+)", "[a-z]+"\]')
"""Modules that main.js and later.js load by name, each with the element it is mounted on."""
NAMED = re.compile(
    r'/static/([a-z.-]+)["`]|URL\("([a-z.-]+)", import\.meta|brought\((?:this\.)?page, "([a-z]+)"\)'
)
IMPORTED = re.compile(r'^(?:import|export) .*?from "\./([a-z]+\.js)";$', re.MULTILINE)
TYPED = re.compile(r'import\("\./([a-z]+\.js)"\)')

FIRST = 150_000
ALL = 200_000
"""Bytes as sent, with their heads: of the first look, and of everything there is."""
WINDOWS = {
    "race.js": {"race.js", "racetile.js", "race.css"},
    "landscape.js": {"landscape.js", "surface.js", "landscape.css"},
    "contours.js": {"contours.js"},
    "results.js": {"results.js", "results.css"},
    "ruler.js": {"ruler.js"},
    "palette.js": {"palette.js", "palette.css"},
    "overlay.js": {"overlay.js"},
    "optimal.js": {"optimal.js"},
    "video.js": {"video.js"},
    "posecompare.js": {"posecompare.js"},
    "fleetcompare.js": {"fleetcompare.js"},
    "hover.js": {"hover.js"},
    "rounds.js": {"rounds.js"},
    "unseen.js": {"unseen.js"},
}
"""What is loaded only when a race, the 3-D view, contour lines, the results page, the ruler, the palette of commands, what
lies over a layer, the optimal path, a video, a comparison of planners of poses or of fleets, the rounds of the planner pad,
or a run of a robot with a sensor are asked for, or when the pointer first moves over the map."""
WINDOW = 12_000
"""Bytes as sent of one of these."""


def sources() -> dict[str, str]:
    """Every file of the page."""
    return {file.name: file.read_text("utf-8") for file in STATIC.iterdir() if file.is_file()}


def asked_by(name: str, text: str, all_: dict[str, str]) -> set[str]:
    """The files that a file asks for when it runs."""
    found = {one for pair in NAMED.findall(text) for one in pair if one}
    found |= set(PARTS.findall(text)) if name in ("main.js", "later.js") else set()
    names = {one if "." in one else f"{one}.js" for one in found} | set(IMPORTED.findall(text))
    return names & all_.keys()


def reached(start: str, all_: dict[str, str], *, types: bool = False) -> set[str]:
    """The files that one leads to."""
    seen: set[str] = set()
    left = [start]
    while left:
        name = left.pop()
        if name not in seen:
            seen.add(name)
            left += asked_by(name, all_[name], all_) | (set(TYPED.findall(all_[name])) if types else set())
    return seen


# ---- what the files say --------------------


def test_every_file_is_reached_from_the_page_and_every_file_asked_for_is_there() -> None:
    all_ = sources()
    assert all_.keys() - reached("index.html", all_, types=True) == {TYPES_ONLY}
    for name, text in all_.items():
        for asked in [*IMPORTED.findall(text), *TYPED.findall(text)]:
            assert asked in all_, (name, asked)


IMPORTS = re.compile(r"import \{ ([^}]+) \} from [\"'](?:\.|/static)/([a-z]+\.js)[\"']")
UNPACKED = re.compile(r"const \{ ([^}]+) \} = await import\([\"']/static/([a-z]+\.js)[\"']\)")
TYPED_WORD = re.compile(r'import\("\./([a-z]+\.js)"\)\.(\w+)')
EXPORTED = re.compile(r"^export (?:async )?(?:const|class|function\*?) (\w+)", re.MULTILINE)


def test_nothing_is_exported_for_nobody() -> None:
    modules = {name: text for name, text in sources().items() if name.endswith(".js") and name != NOT_OURS}
    tests = [path.read_text("utf-8") for path in Path(__file__).parent.glob("test_*.py")]
    used = {
        (name, word)
        for text in [*modules.values(), *tests]
        for pattern in (IMPORTS, UNPACKED)
        for words, name in pattern.findall(text)
        for word in words.split(", ")
    }
    used |= {pair for text in modules.values() for pair in TYPED_WORD.findall(text)}
    # Every part has these; what is brought later is called by its name.
    called = {"mount", "begin", *re.findall(r"\b[a-z]+\.(ask[A-Z]\w+)\(", "".join(modules.values()))}
    assert [
        (name, word)
        for name, text in modules.items()
        for word in EXPORTED.findall(text)
        if word not in called and (name, word) not in used
    ] == []


def test_what_is_asked_for_early_is_what_the_first_look_needs() -> None:
    all_ = sources()
    early = set(re.findall(r'rel="modulepreload" href="/static/([a-z]+\.js)"', all_["index.html"]))
    assert len(early) == all_["index.html"].count("modulepreload")
    assert early == at_first(all_) - {"main.js"}


def at_first(all_: dict[str, str]) -> set[str]:
    """The modules of the first look: what main.js loads by name, and what that imports."""
    seen: set[str] = set()
    left = ["main.js", *(f"{name}.js" for name in PARTS.findall(all_["main.js"]))]
    while left:
        name = left.pop()
        if name not in seen:
            seen.add(name)
            left += IMPORTED.findall(all_[name])
    return seen


def test_scripts_and_styles_are_sent_without_comments_and_every_line_keeps_its_number() -> None:
    all_ = sources()
    for name in ("map.js", "fleet.js", "theme.css", "forms.css"):
        sent = run(World().ask("GET", f"/static/{name}", own())).body.decode().split("\n")
        there = all_[name].split("\n")
        assert len(sent) == len(there)
        assert sum(map(len, sent)) < 0.93 * sum(map(len, there)), name
        assert not any("/*" in line or line.startswith(("//", " ")) for line in sent), name
        for ours, line in zip(sent, there, strict=True):
            words = "".join(ours.split())
            rest = line.split()
            assert words in re.sub(r"/\*.*?\*/", "", "".join(rest)), line
            assert (
                words
                or not rest
                or name.endswith(".css")
                or rest[0].startswith(("//", "/*", "*"))
                or "*/" in line
            ), line
    untouched = run(World().ask("GET", f"/static/{NOT_OURS}", own())).body.decode()
    assert untouched == all_[NOT_OURS], "with its licence"


@pytest.mark.parametrize(
    ("script", "sent"),
    [
        ("const a = 1; // one\n  const b = a / 2;", "const a=1;\nconst b=a/2;"),
        ("f(/** @type {any} */ (x));", "f((x));"),
        ("/* one\n two */ let c;", "\nlet c;"),
        ('const u = "http://x/*no*/";', 'const u="http://x/*no*/";'),
        ("s.replace(/[/*]\\//g, '//');", "s.replace(/[/*]\\//g,'//');"),
        ("x = (a) / b / c; // over", "x=(a)/b/c;"),
        ("let/* one */a = b + +c - -d;", "let a=b+ +c- -d;"),
        ("return /x y/g in o; a = 1 .toFixed();", "return/x y/g in o;a=1 .toFixed();"),
        ("for (const [a, b] of await c) { d ( 'e  f' ) }", "for(const[a,b]of await c){d('e  f')}"),
        (
            "t = `a // ${f({ b: `/* ${c /* out */} */` })}  // b`;",
            "t=`a // ${f({b:`/* ${c} */`})}  // b`;",
        ),
    ],
)
def test_what_looks_like_a_comment_and_is_none_stays(script: str, sent: str) -> None:
    assert stripped_script(script) == sent


def test_a_style_sheet_keeps_the_spaces_that_mean_something() -> None:
    style = (
        'a :hover, b + .c { margin: calc(1px + 2px) 0; content: "a: { b"; } /* d */\n\n'
        "@media (min-width: 3px) and (e) {\n  f { g: h }\n}"
    )
    assert stripped_style(style) == (
        'a :hover,b + .c{margin:calc(1px + 2px) 0;content:"a: { b";}\n\n'
        "@media (min-width:3px) and (e){\nf{g:h}\n}"
    )


@pytest.mark.parametrize("path", ["/static/map.js", "/api/hello", "/api/maps"])
def test_only_what_is_the_same_for_everybody_is_compressed(path: str) -> None:
    """Beside a secret, or beside what a stranger chose, compressing tells of it."""
    plain = run(World().ask("GET", path, own()))
    packed = run(World().ask("GET", path, own(("Accept-Encoding", "gzip, br"))))
    encoded = [value for key, value in packed.headers if key == b"content-encoding"]
    if path == "/api/maps":
        assert (encoded, packed.body) == ([], plain.body)
    else:
        assert (encoded, gzip.decompress(packed.body)) == ([b"gzip"], plain.body)


# ---- what the browser asks for --------------------


class Scales:
    """The bytes of each file of the page, as sent."""

    def __init__(self, tab: Any) -> None:
        self.files: dict[str, float] = {}
        self.others = 0.0
        asked: dict[str, str] = {}
        wire = tab.context.new_cdp_session(tab)
        wire.send("Network.enable")
        wire.on("Network.requestWillBeSent", lambda it: asked.update({it["requestId"]: it["request"]["url"]}))
        wire.on(
            "Network.loadingFinished",
            lambda it: self.add(asked.get(it["requestId"], ""), it["encodedDataLength"]),
        )

    def add(self, url: str, size: float) -> None:
        path = re.sub(r"^http://[^/]*|[#?].*", "", url)
        if path == "/" or path.startswith("/static/"):
            name = path.removeprefix("/static/") if path != "/" else "index.html"
            self.files[name] = self.files.get(name, 0) + size
        else:
            self.others += size

    @property
    def sum(self) -> float:
        return sum(self.files.values())


@pytest.fixture
def tab(browser: Any) -> Iterator[Any]:
    """A tab of a browser that was never here."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    made = context.new_page()
    yield made
    context.close()


def arrive(tab: Any, address: str) -> None:
    """Open the page and wait until it has a plan, and what follows a plan."""
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    tab.wait_for_selector("#status >> text=found")
    tab.wait_for_selector(".ch-plot canvas")
    loaded(tab)


@needs_chromium
def test_the_first_look_is_light_and_everything_is_under_200_kb(tab: Any, address: str) -> None:
    all_ = sources()
    scales = Scales(tab)
    arrive(tab, address)
    modules = {name for name in scales.files if name.endswith(".js")}
    assert modules == at_first(all_) | {NOT_OURS}
    assert scales.sum < FIRST, scales.files
    assert scales.sum + scales.others < ALL, "with the map, the library and what there is to choose from"

    tab.get_by_role("button", name="Take the tour").click()
    tab.get_by_role("button", name="Close the tour").click()
    tab.get_by_role("button", name="Make a map").click()
    tab.wait_for_selector("#make-map")
    for panel in ("settings", "traffic", "fleet", "compare", "keep", "learn"):
        tab.click(f"#tab-{panel}")
        tab.wait_for_selector(f"#{panel} h2")
    tab.get_by_role("button", name="Begin the tour").click()
    tab.wait_for_selector("text=Step 1 of 12")
    runs = reached("index.html", all_) - {"uplot-licence.txt"} - set().union(*WINDOWS.values())
    assert scales.files.keys() == runs, "everything was opened, and nothing else is there"
    assert scales.sum < ALL, scales.files


@needs_chromium
def test_windows_are_loaded_when_they_are_asked_for_and_are_light(tab: Any, address: str) -> None:
    scales = Scales(tab)
    arrive(tab, address)
    tab.locator("#map").hover()
    tab.click("#tab-compare")
    tab.get_by_role("button", name="Race", exact=True).click()
    tab.wait_for_selector("dialog.race figure")
    tab.keyboard.press("Escape")
    tab.get_by_role("button", name="Results page").click()
    tab.get_by_role("button", name="Close the results").click()
    tab.get_by_role("button", name="Measure a distance").click()
    tab.wait_for_selector("#ruler-said")
    tab.keyboard.press("Escape")
    tab.click("#tab-now")
    tab.get_by_label("Luciferin").first.check(force=True)
    tab.get_by_label("Contour lines").check()
    tab.get_by_label("Inflation").check()
    tab.get_by_role("button", name="Show the optimal path").click()
    tab.get_by_role("button", name="In 3-D").click()
    tab.wait_for_selector("dialog.deep canvas")
    tab.keyboard.press("Escape")
    tab.get_by_role("button", name="Commands").click()
    tab.wait_for_selector("dialog.palette[open]")
    tab.keyboard.press("Escape")
    tab.click("#tab-keep")
    with tab.expect_download():
        tab.get_by_role("button", name="WebM", exact=True).click()
    tab.click("#tab-traffic")
    tab.get_by_label("Sensor range").fill("6")
    tab.get_by_label("Sensor range").press("Tab")
    tab.get_by_role("button", name="Play", exact=True).click()
    tab.locator("#legend li").get_by_text("not yet seen").wait_for(state="attached")
    tab.get_by_label("Sensor range").fill("")
    tab.get_by_label("Sensor range").press("Tab")
    tab.click("#tab-compare")
    tab.get_by_label("Add a planner").select_option("lattice")
    tab.locator("#compare .adder").first.get_by_role("button", name="Add", exact=True).click()
    tab.get_by_role("button", name="Compare", exact=True).click()
    tab.wait_for_selector("#compare table.controllers")
    tab.get_by_role("tab", name="Planner").click()
    tab.locator("select[aria-label=Planner]").select_option("pad")
    tab.get_by_label("Rounds of pad").wait_for(state="attached")
    tab.click("#tab-fleet")
    tab.get_by_role("button", name="Compare planners").click()
    tab.wait_for_selector("dialog[open] table")
    loaded(tab)
    for name, files_ in WINDOWS.items():
        assert files_ <= scales.files.keys(), name
        assert sum(scales.files[one] for one in files_) < WINDOW, name


@pytest.mark.nightly
@needs_chromium
def test_a_panel_that_cannot_be_loaded_says_so_and_comes_when_the_server_is_back(
    tab: Any, tmp_path: Path
) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with app(tmp_path, "env-3", port=port) as address:
        arrive(tab, address)
    tab.click("#tab-keep")
    tab.wait_for_selector("#keep >> text=The server does not answer")
    assert tab.locator("#gone").is_visible()
    tab.click("#tab-settings")
    tab.wait_for_selector("#settings >> text=The server does not answer")
    tab.click("#tab-library")
    tab.get_by_role("button", name="Make a map").click()
    tab.wait_for_selector(".note.bad >> text=The server does not answer")
    with app(tmp_path, "env-3", port=port) as address:
        tab.goto(address)
        tab.wait_for_selector("#gone", state="hidden")
        tab.wait_for_selector("#keep >> text=SVG")
        assert "does not answer" not in tab.inner_text("#keep")
        tab.click("#tab-settings")
        tab.wait_for_selector("#settings select")
        assert "does not answer" not in tab.inner_text("#left")
