"""The app as a person meets it: first frame, frames a second, painting, dragging, weight, memory.

    python -m benchmarks.bench_app [--quick] [--only PART] [--minutes N] [--json FILE]

A real ``lampyris app`` is started and its page opened in the distribution's Chromium, without a window and
drawn by software alone, 1280 x 720.

What is measured
----------------
* first frame: from the navigation until behind the frame that shows the map first; nothing is cached.
* walk: what somebody sees who was never here: from the navigation until the robot of the first scene brakes for a moving
  obstacle, and until three planners race; with the clicks that each takes.
* frames: how many a second the page draws, counted over half seconds: the middle of these and the worst
  twentieth. Browsers draw at most 60. Beside them the processor time a frame of the page's process and of the
  drawing one, which does not know that limit.
* fleet: the same of 1,000 robots on warehouse-200 with their trails and the lines of those that wait, and of 1,000 robots
  of a swarm on env-3.
* race: the same of six planners that search 512 x 512 side by side, and then drive.
* landscape: the same of the 3-D view of luciferin on hills-256 while the robot drives, drawn by software.
* painting: from when the browser got a pointer's event until the cell's pixel is read back from the screen's
  canvas. The screen itself shows it with the browser's next frame.
* dragging: from a move of the goal until a way to there, or to where a later move put it, is on the canvas.
* weight: what the browser was sent until the opening scene drives: files, their heads, answers; and of all files that
  buttons and panels load later.
* memory: of the page after garbage collection, of server and engines as the system counts it, while runs are
  played and made again, in a browser of its own whose network nobody watches (:mod:`benchmarks.app_pipe`).
  The
  slope leaves out the first fifth, in which caches fill.

On a machine that others use as well all of this is worse than it is; compare two versions by turns.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import platform
import random
import re
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from benchmarks import app_pipe
from benchmarks import app_stage as stage

Row = dict[str, Any]
SOON = 120_000
BURST_MS = 500.0
RACE = (("tab", "Compare"), ("button", "Race"))
"""What is clicked for a race, from the first scene."""
PARTS = (
    "first",
    "walk",
    "weight",
    "playing",
    "fleet",
    "race",
    "landscape",
    "painting",
    "looking",
    "dragging",
    "memory",
)


def share(values: list[float], part: float) -> float:
    """The value below which a part of them lies."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))]


def row(what: str, said: str, target: str = "", met: bool | None = None, **more: Any) -> Row:
    """A line of the table, printed as it is made."""
    verdict = {True: "met", False: "NOT MET", None: ""}[met]
    print(f"{what:<40} {said:<58} {target:<18} {verdict}", flush=True)
    return {"what": what, "said": said, "target": target, "met": met, **more}


def until(page: Any, holds: str) -> None:
    """Wait; Playwright's own waiting asks the page for `eval`, which its policy forbids."""
    end = time.monotonic() + SOON / 1000
    while not page.evaluate(holds):
        if time.monotonic() > end:
            raise TimeoutError(holds)
        page.wait_for_timeout(20)


def until_still(page: Any, sent: Callable[[], dict[str, float]]) -> None:
    """Wait until nothing more has been sent for a second."""
    before = -1.0
    while (now := sum(sent().values())) != before:
        before = now
        page.wait_for_timeout(1000)


class Bench:
    """A browser before an app.

    Parameters
    ----------
    browser : Playwright's.
    address : of the app's page, with its token.
    server : the number of its process.
    """

    def __init__(self, browser: Any, address: str, server: int, quick: bool) -> None:
        self.browser, self.address, self.server, self.quick = browser, address, server, quick
        self.rounds = 2 if quick else 5
        self.seconds = 3.0 if quick else 8.0
        self.rng = random.Random(7)
        self.context = browser.new_context(viewport={"width": 1280, "height": 720})
        self.page = self.context.new_page()
        self.page.set_default_timeout(SOON)

    def open(self, size: int, obstacles: int) -> None:
        """A scenario in the page, planned."""
        self.page.goto("about:blank")
        self.page.goto(self.address + stage.link(stage.scenario(size, obstacles)))
        self.page.wait_for_selector("body.ready")
        self.page.wait_for_selector("#status >> text=found")
        self.page.evaluate(f"({stage.PROBE})()")

    def play(self) -> None:
        """Simulate to the end, so that all of it can be played."""
        self.page.evaluate("bench.page.simulate({tick: 0, play: true})")
        until(self.page, "bench.page.run && bench.page.run.done")

    def part(self, name: str, minutes: float) -> list[Row]:
        """One of the parts."""
        if name == "memory":
            return self.memory(minutes)
        act: Callable[[], list[Row]] = getattr(self, name)
        return act()

    # ---- figures --------------------

    def first(self) -> list[Row]:
        """Opened in browsers that were never here; the first time just behind the app's start."""
        found: list[float] = []
        for _ in range(1 + self.rounds):
            with self.browser.new_context(viewport={"width": 1280, "height": 720}) as context:
                context.add_init_script(stage.FIRST)
                page = context.new_page()
                page.goto(self.address + "&m=env-3")
                until(page, "window.firstFrame > 0")
                found.append(page.evaluate("window.firstFrame"))
                page.wait_for_selector("#status >> text=found", timeout=SOON)
        middle, worst = statistics.median(found[1:]), max(found[1:])
        said = f"{middle:.0f} ms, worst {worst:.0f}; right after the start {found[0]:.0f}"
        return [row("first frame, env-3", said, "< 1000 ms", max(found) < 1000, ms=found)]

    def walk(self) -> list[Row]:
        """The first minutes of somebody who was never here."""
        slowed: list[float] = []
        raced: list[float] = []
        clicks = 0
        for _ in range(self.rounds):
            with self.browser.new_context(viewport={"width": 1440, "height": 900}) as context:
                page = context.new_page()
                began = time.monotonic()
                page.goto(self.address.partition("&")[0])
                page.locator(".st-cause", has_text="moving obstacle").wait_for(timeout=SOON)
                slowed.append(time.monotonic() - began)
                ways = [page.get_by_role(role, name=name, exact=True) for role, name in RACE]
                began = time.monotonic()
                for one in ways:
                    one.click(timeout=SOON)
                page.locator("dialog.race figure").nth(2).wait_for(timeout=SOON)
                raced.append(time.monotonic() - began)
                clicks = len(ways)
        said = [f"{statistics.median(some):.2f} s, worst {max(some):.2f}" for some in (slowed, raced)]
        return [
            row(
                "a robot slows for an obstacle",
                f"{said[0]}; 0 clicks",
                "< 3 s, 0 clicks",
                max(slowed) < 3,
                s=slowed,
            ),
            row("a race of three is on", f"{said[1]}; {clicks} clicks", "<= 3 clicks", clicks <= 3, s=raced),
        ]

    def weight(self) -> list[Row]:
        """What a browser that was never here is sent, with the heads: until the opening scene drives, and of all files.

        Answers to the page's questions (the list of maps, the plan, the drive) count as well as its files.
        """
        asked: dict[str, str] = {}
        parts: dict[str, list[float]] = {}
        whole: dict[str, float] = {}

        def sent() -> dict[str, float]:
            """Bytes by name. The end of the icon, and of an answer that was read to its last frame, is not always told."""
            found: dict[str, float] = {}
            for id, url in asked.items():
                name = re.sub(r"^http://[^/]*|[#?].*", "", url)
                found[name] = found.get(name, 0.0) + whole.get(id, sum(parts.get(id, [])))
            return found

        with self.browser.new_context(viewport={"width": 1280, "height": 720}) as context:
            page = context.new_page()
            wire = context.new_cdp_session(page)
            wire.send("Network.enable")
            wire.on(
                "Network.requestWillBeSent", lambda it: asked.update({it["requestId"]: it["request"]["url"]})
            )
            wire.on(
                "Network.responseReceived",
                lambda it: parts.setdefault(it["requestId"], []).append(it["response"]["encodedDataLength"]),
            )
            wire.on(
                "Network.dataReceived",
                lambda it: parts.setdefault(it["requestId"], []).append(it["encodedDataLength"]),
            )
            wire.on(
                "Network.loadingFinished", lambda it: whole.update({it["requestId"]: it["encodedDataLength"]})
            )
            page.goto(self.address.partition("&")[0])
            page.wait_for_selector("body.ready", timeout=SOON)
            end = time.monotonic() + SOON / 1000
            while not any(
                url.endswith("/api/drive") and len(parts.get(id, [])) > 1 for id, url in asked.items()
            ):
                page.wait_for_timeout(100)
                if time.monotonic() > end:
                    raise TimeoutError("the answer to /api/drive")
            until_still(page, sent)
            first = sent()
            opened, answers = sum(first.values()), sum(v for k, v in first.items() if k.startswith("/api/"))
            names = {file.name for file in files("lampyris.app").joinpath("static").iterdir()}
            left = sorted(names - {name.removeprefix("/static/") for name in first} - {"index.html"})
            raw = page.evaluate(
                """async (names) => {
                  for (const name of names) await (await fetch(`/static/${name}`)).text();
                  return ["navigation", "resource"].flatMap((kind) => performance.getEntriesByType(kind))
                    .filter(({ name }) => !name.includes("/api/")).reduce((sum, one) => sum + one.decodedBodySize, 0);
                }""",
                left,
            )
            until_still(page, sent)
            files_ = sum(v for k, v in sent().items() if not k.startswith("/api/"))
        said = f"{opened / 1000:.0f} kB: files {(opened - answers) / 1000:.0f}, answers {answers / 1000:.0f}"
        every = f"{files_ / 1000:.0f} kB in {len(names)} files, unpacked {raw / 1000:.0f}"
        return [
            row("page at the opening, as sent", said, "< 200 kB", opened < 200_000, sent=opened),
            row("all files of the page, each loaded", every, sent=files_, unpacked=raw),
        ]

    def frames(self, what: str, least: float | None, begin: Callable[[], None]) -> Row:
        """How many frames a second while something goes on, over all rounds."""
        rates: list[float] = []
        gaps: list[float] = []
        spent: list[float] = []
        for _ in range(self.rounds):
            begin()
            self.page.wait_for_timeout(500)
            self.page.evaluate("bench.take()")
            before = stage.drawing()
            self.page.wait_for_timeout(1000 * self.seconds)
            times = self.page.evaluate("bench.take().times")
            used = sum(now - before.get(pid, 0.0) for pid, now in stage.drawing().items())
            spent.append(1000 * used / max(1, len(times)))
            gaps += [b - a for a, b in itertools.pairwise(times)]
            bursts = int((times[-1] - times[0]) // BURST_MS) if len(times) > 1 else 0
            counts = [0] * bursts
            for at in times:
                k = int((at - times[0]) // BURST_MS)
                if k < bursts:
                    counts[k] += 1
            rates += [1000 * count / BURST_MS for count in counts] or [0.0]
        self.page.evaluate("bench.still()")
        middle, low = statistics.median(rates), share(rates, 0.05)
        cost = statistics.median(spent)
        said = f"{middle:.0f} a second, p5 {low:.0f}; {cost:.1f} ms of processor each"
        target = "" if least is None else f">= {least:.0f}"
        met = None if least is None else min(middle, low) >= least
        return row(what, said, target, met, rates=rates, longest_ms=max(gaps, default=0.0), cpu_ms=spent)

    def playing(self) -> list[Row]:
        """512 x 512 among 200, played; the same with another layer in each frame."""
        self.open(512, 200)
        self.play()
        last = self.page.evaluate("bench.page.run.ticks")

        def somewhere(more: str = "") -> Callable[[], None]:
            def begin() -> None:
                tick = int(self.rng.random() * max(1, last - 120))
                self.page.evaluate(f"bench.page.play.seek({tick}); bench.page.play.start(); {more}")

            return begin

        name = "512 x 512, 200 obstacles, played"
        return [
            self.frames(name, 50, somewhere()),
            self.frames("the same, another heat map each frame", 45, somewhere("bench.heat()")),
        ]

    def fleet(self) -> list[Row]:
        """1,000 robots of a fleet, then of a swarm, played."""
        page = self.page
        page.goto("about:blank")
        page.goto(self.address + "&m=warehouse-200")
        page.wait_for_selector("body.ready")
        page.wait_for_selector("#status >> text=found")
        page.evaluate(f"({stage.PROBE})()")
        page.click("#tab-fleet")
        page.fill("#fleet-number", "1000")
        page.get_by_role("button", name="Plan", exact=True).click()
        until(page, "bench.page.fleet?.run?.n === 1000")
        rows = [self.frames("1,000 robots of a fleet, played", 50, self._somewhere(40))]
        page.select_option("#fleet-map", "env-3")
        page.get_by_role("button", name="Glowworms").click()
        page.fill("#fleet-number", "1000")
        page.get_by_role("button", name="Simulate", exact=True).click()
        until(page, "bench.page.fleet.swarm.last === 300")
        return [*rows, self.frames("1,000 robots of a swarm, played", 50, self._somewhere(150))]

    def _somewhere(self, most: int) -> Callable[[], None]:
        """Play the fleet from one of its first ticks."""

        def begin() -> None:
            tick = int(self.rng.random() * most)
            self.page.evaluate(f"bench.page.play.seek({tick}); bench.page.play.start()")

        return begin

    def race(self) -> list[Row]:
        """Six planners that search 512 x 512 side by side, and then drive."""
        page = self.page
        self.open(512, 0)
        page.click("#tab-compare")
        for name in ("theta-star", "dijkstra", "jps"):
            page.get_by_label("Add a planner").select_option(name)
            page.locator("#compare .adder").first.get_by_role("button", name="Add", exact=True).click()
        page.get_by_role("button", name="Race", exact=True).click()
        until(page, "document.querySelector('dialog.race .primary')?.textContent === 'Pause'")
        page.evaluate("void bench.page.on('race-frame', () => bench.times.push(performance.now()))")

        def begin(moment: int) -> Callable[[], None]:
            """Play from a moment, of 1,000."""
            code = (
                "(() => { const bar = document.querySelector('.race-bar'); const slider = bar.querySelector('input');"
                f" slider.value = {moment}; slider.dispatchEvent(new Event('input'));"
                " const play = bar.querySelector('.primary'); if (play.textContent === 'Play') play.click(); })()"
            )
            return lambda: page.evaluate(code)

        return [
            self.frames("six on 512 x 512, searching", 50, begin(0)),
            self.frames("six on 512 x 512, driving", 50, begin(460)),
        ]

    def landscape(self) -> list[Row]:
        """The layer of luciferin of a map of 256 x 256 in 3-D, while the robot drives and while it is turned."""
        page = self.page
        page.goto("about:blank")
        page.goto(self.address + "&m=hills-256")
        page.wait_for_selector("body.ready")
        page.wait_for_selector("#status >> text=found")
        page.evaluate(f"({stage.PROBE})()")
        page.get_by_label("Luciferin").first.check(force=True)
        page.get_by_role("button", name="In 3-D").click()
        page.wait_for_selector("dialog.deep canvas")
        page.evaluate("void bench.page.on('landscape-frame', () => bench.times.push(performance.now()))")
        play = (
            "(() => { const all = document.querySelector('dialog.deep'); const slider = all.querySelector('input');"
            " slider.value = 0; slider.dispatchEvent(new Event('input'));"
            " const play = all.querySelector('.primary'); if (play.textContent === 'Play') play.click(); })()"
        )
        return [self.frames("luciferin of 256 x 256 in 3-D, driving", 30, lambda: page.evaluate(play))]

    def looking(self) -> list[Row]:
        """Zoom by the wheel and pan of large maps with a way on them."""
        out = []
        for size in (1024, 2048):
            self.open(size, 0)
            least = 50.0 if size == 1024 else None
            for how, act in (("zoomed", "bench.wheel(560, 300)"), ("panned", "bench.pan()")):
                begin = partial(self.page.evaluate, act)
                out.append(self.frames(f"{size} x {size}, {how}", least, begin))
        return out

    def painting(self) -> list[Row]:
        """Strokes while the runs that earlier strokes asked for stream in."""
        page = self.page
        self.open(512, 200)
        page.evaluate("bench.page.map.look(256, 256, 6); bench.page.use('wall'); bench.painting = true")
        page.evaluate("void bench.page.simulate({tick: 0, play: true})")
        until(page, "bench.page.run && bench.page.run.ticks > 20")
        left, top, wide, high = page.evaluate(
            "(() => { const b = bench.page.map.canvas.getBoundingClientRect();"
            " return [b.left, b.top, b.width, b.height]; })()"
        )
        for _ in range(12 if self.quick else 60):
            x = left + wide * (0.25 + 0.4 * self.rng.random())
            y = top + high * (0.2 + 0.5 * self.rng.random())
            page.mouse.move(x, y)
            page.mouse.down()
            for _ in range(20):
                x, y = x + 8 * self.rng.random(), y + 8 * self.rng.random() - 4
                page.mouse.move(x, y)
                time.sleep(0.02 * self.rng.random())
            page.mouse.up()
            time.sleep(0.2)
        echoes, wrong = page.evaluate("[bench.echoes, bench.wrong]")
        p50, p95 = statistics.median(echoes), share(echoes, 0.95)
        said = f"p50 {p50:.1f} ms, p95 {p95:.1f} ({len(echoes)} events)"
        met = p95 < 15 and not wrong
        return [row("wall painted while frames stream", said, "p95 < 15 ms", met, ms=echoes, unseen=wrong)]

    def dragging(self) -> list[Row]:
        """The goal dragged over 512 x 512 at 60 moves a second."""
        page = self.page
        follows: list[float] = []
        seconds: list[float] = []
        for _ in range(self.rounds):
            self.open(512, 200)
            x, y = page.evaluate(
                "(() => { const b = bench.page.map.canvas.getBoundingClientRect();"
                " const [x, y] = bench.page.map.view.pixel(509, 509); return [b.left + x, b.top + y]; })()"
            )
            page.mouse.move(x, y)
            page.mouse.down()
            for _ in range(60 if self.quick else 120):
                x, y = x - 2.5 * self.rng.random(), y - 2.5 * self.rng.random()
                page.mouse.move(x, y)
                time.sleep(0.012)
            page.wait_for_timeout(1000)
            page.mouse.up()
            follows += page.evaluate("bench.follows")
            seconds += page.evaluate("bench.seconds")
        p50, p95 = statistics.median(follows), share(follows, 0.95)
        engine = 1000 * statistics.median(seconds)
        said = f"p50 {p50:.0f} ms, p95 {p95:.0f}; {engine:.0f} ms of it planning"
        return [row("goal dragged on 512 x 512, way follows", said, "p95 < 100 ms", p95 < 100, ms=follows)]

    # ---- memory --------------------

    def memory(self, minutes: float) -> list[Row]:
        """What page and server hold while runs are played, and now and then made again."""
        with app_pipe.browser() as page:
            samples, loops = self._played(page, minutes)
        print(f"memory over {minutes:g} minutes, {loops} plays, {len(samples)} samples:")
        return [
            self._slope(samples, name, key, unit, scale)
            for name, key, unit, scale in (
                ("page, JavaScript heap", "heap", "MB", 1e6),
                ("of which what the page made", "made", "MB", 1e6),
                ("page, DOM nodes", "nodes", "", 1.0),
                ("page, listeners", "listeners", "", 1.0),
                ("page's process", "renderer", "MB", 1e6),
                ("server", "server", "MB", 1e6),
                ("engines", "engines", "MB", 1e6),
            )
        ]

    def _played(self, page: app_pipe.Page, minutes: float) -> tuple[list[dict[str, float]], int]:
        """Samples, and how often a run was played."""
        page.goto(self.address + stage.link(stage.scenario(512, 200)))
        until(
            page,
            "document.body.matches('.ready') && /found/.test(document.querySelector('#status').textContent)",
        )
        page.call("Performance.enable")
        page.evaluate(f"({stage.PROBE})()")
        page.evaluate("void bench.page.simulate({tick: 0, play: true})")
        until(page, "!!bench.page.run && bench.page.run.done")
        page.evaluate("bench.page.play.rate(16); bench.page.play.seek(0); bench.page.play.start();")
        samples: list[dict[str, float]] = []
        began = time.monotonic()
        loops = 0
        while (at := time.monotonic() - began) < 60 * minutes or len(samples) < 5:
            page.wait_for_timeout(1000)
            if not page.evaluate("bench.take(), bench.page.play.playing"):
                loops += 1
                # Every other time another world is simulated; the same one is played again otherwise.
                page.evaluate(
                    "(k) => { const { page } = bench; if (k % 2) page.store.set({ seed: k % 5 }, 'seed');"
                    " page.tell('show-layer', k % 4 < 2 ? 'none' : 'reach');"
                    " if (k % 2) void page.simulate({ tick: 0, play: true }); else page.play.start(); }",
                    loops,
                )
            if at >= len(samples) * minutes * 60 / 40:
                samples.append({"minutes": at / 60, **self._held(page)})
                if len(samples) % 8 == 0:
                    samples[-1]["made"] = self._made(page)
        return samples, loops

    @staticmethod
    def _made(page: app_pipe.Page) -> int:
        """Bytes of the heap that the page's own program holds: without machine code and its feedback, which the browser
        makes for as long as it finds something to optimise, and without the browser's own records."""
        held = page.heap_by_kind()
        return sum(
            size
            for kind, size in held.items()
            if kind not in ("code", "hidden", "native", "synthetic", "object shape")
        )

    def _held(self, page: app_pipe.Page) -> dict[str, float]:
        page.call("HeapProfiler.collectGarbage")
        told = {one["name"]: one["value"] for one in page.call("Performance.getMetrics")["metrics"]}
        held = [(pid, stage.resident(pid)) for pid in stage.tree(self.server)]
        return {
            "heap": told["JSHeapUsedSize"],
            "nodes": told["Nodes"],
            "listeners": told["JSEventListeners"],
            "renderer": max((stage.resident(pid) for pid in stage.drawing("renderer")), default=0),
            "server": held[0][1],
            "engines": sum(size for _, size in held[1:]),
        }

    @staticmethod
    def _slope(samples: list[dict[str, float]], name: str, key: str, unit: str, scale: float) -> Row:
        """First and last, and what ten minutes would add after the first fifth: flat is less than a tenth."""
        samples = [s for s in samples if key in s]
        late = samples[len(samples) // 5 :]
        x, y = [s["minutes"] for s in late], [s[key] / scale for s in late]
        slope = statistics.linear_regression(x, y).slope
        first, last = samples[0][key] / scale, samples[-1][key] / scale
        told = f"{first:.4g} to {last:.4g} {unit}, {10 * slope:+.3g} {unit} in ten minutes"
        flat = 10 * slope < 0.1 * y[0]
        held = [s[key] for s in samples]
        return row("  " + name, told, "flat: under a tenth", flat, slope=slope, samples=held)


def main() -> int:
    """Run, print, judge. The exit code is 0 whatever the verdicts; 1: it could not measure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds, one minute of memory")
    parser.add_argument("--minutes", type=float, help="of memory (10; quick: 1; 0: none)")
    parser.add_argument("--only", action="append", choices=PARTS, help="this part; may be said again")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write everything there")
    args = parser.parse_args()
    minutes = args.minutes if args.minutes is not None else (1.0 if args.quick else 10.0)
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        print("playwright is not installed (make bench-app installs it)", file=sys.stderr)
        return 1
    if stage.CHROMIUM is None or not Path("/proc").is_dir():
        print("needs Chromium (tools/browser.sh) and a system with /proc", file=sys.stderr)
        return 1
    with stage.app() as (address, server), sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=stage.CHROMIUM, args=stage.FLAGS)
        about = {
            "cpu": stage.cpu(), "cores": os.cpu_count(), "load": round(os.getloadavg()[0], 1),
            "chromium": browser.version, "python": platform.python_version(), "lampyris": version("lampyris"),
        }  # fmt: skip
        print(", ".join(f"{k} {v}" for k, v in about.items()))
        bench = Bench(browser, address, server, args.quick)
        asked = args.only or [part for part in PARTS if part != "memory" or minutes > 0]
        rows = [one for part in asked for one in bench.part(part, minutes)]
        browser.close()
    short = [one["what"].strip() for one in rows if one["met"] is False]
    print(f"not met: {', '.join(short)}" if short else "all targets met")
    if args.json:
        args.json.write_text(json.dumps({"machine": about, "rows": rows}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
