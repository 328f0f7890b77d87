"""Fleets and swarms of the page as files: film, picture, numbers, scenario."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from lampyris import fleets, swarms
from lampyris.app.engine.fleets.fleet import MOST_ROBOTS, ground_of, robots_of
from lampyris.app.engine.parse import scenario_of_request
from lampyris.app.engine.progress import Share
from lampyris.app.replay.page import replay_page
from lampyris.app.replay.streams import fleet_replay
from lampyris.errors import SettingError, UsageError, shown
from lampyris.fleet_scenarios import completed_fleet
from lampyris.io.fleet_scenario.save import plain
from lampyris.io.fleet_scenario.scenario import MAX_ITERATIONS, FleetScenario
from lampyris.io.scenario.save import json_of, yaml_of
from lampyris.io.text.strict_yaml import MAX_BYTES
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.planning.base import Budget
from lampyris.report.data.csv import write_fleet_csv
from lampyris.report.data.fleets.record import fleet_record
from lampyris.report.data.swarm_record import swarm_record
from lampyris.report.film.fleet_film import fleet_film
from lampyris.report.film.swarm_film import swarm_film
from lampyris.report.pictures.fleet_picture import draw_fleet
from lampyris.sim.swarm.signals import signal_on

Look = Callable[[], None]
KINDS: Final = ("webp", "gif", "png", "csv", "json", "scenario", "replay")
SWARM_KINDS: Final = ("webp", "gif", "json")
_ASKED: Final = ("robots", "planner", "seed", "iterations", "sum_of_costs", "sources", "swarm")


def fleet_file(question: Mapping[str, Any], look: Look) -> bytes:
    """A file of a fleet, planned again as far as the page's plan was, or of a swarm.

    Parameters
    ----------
    question : ``scenario``: the map and the walls painted on it. ``what``: one of :data:`KINDS`. ``settings``: ``fleet`` with
        ``robots``, ``planner``, ``seed``, ``iterations`` and ``sum_of_costs`` of the plan; or with ``swarm`` (its settings),
        ``robots``, ``seed`` and ``sources``.

    Raises
    ------
    UsageError : ``EXPORT``: no such file. SettingError : a setting of another kind.
    LampyrisError : as :func:`lampyris.plan_fleet` and :func:`lampyris.swarm_robots`.
    """
    asked: Any = question["settings"]["fleet"]
    what = question["what"]
    if not isinstance(asked, Mapping) or set(asked) - set(_ASKED):
        raise SettingError("FLEET", shown(asked), where="fleet", allowed=", ".join(_ASKED))
    kinds = SWARM_KINDS if "swarm" in asked else KINDS
    if what not in kinds:
        raise UsageError("EXPORT", f"{what!r:.40} of a fleet", where="what", allowed=", ".join(kinds))
    if "swarm" in asked:
        return _swarm(question, asked, what, look)
    # What a plan is made of is checked by what makes it; these two only where they are used here.
    for name, most in (("iterations", MAX_ITERATIONS), ("sum_of_costs", 2**62)):
        value: Any = asked.get(name)
        if type(value) is not int or not 0 <= value <= most:
            raise SettingError("FLEET", shown(value), where=name, allowed=f"a whole number, 0 to {most:,}")
    grid = ground_of(question)
    fleet = fleets.random_fleet(grid, robots_of(asked, MOST_ROBOTS), seed=asked.get("seed", 0))
    plan = _planned(fleet, asked, look)
    if what == "scenario":
        return _scenario(question, fleet, plan)
    if what == "json":
        return _text({**fleet_record(plan, fleet), "timing": {}})
    if what == "replay":
        return replay_page(fleet_replay(plan, fleet)).encode()
    share = Share("drawing")

    def drawn(done: int) -> None:
        share(done)
        look()

    def write(path: Path) -> None:
        if what == "csv":
            write_fleet_csv(path, plan)
        elif what == "png":
            draw_fleet(plan, fleet, path)
        else:
            fleet_film(plan, fleet, path, progress=drawn)

    return _file(what, write)


def _planned(fleet: Fleet, asked: Mapping[str, Any], look: Look) -> FleetPlan:
    """The plan of the page: as many iterations again, instead of its seconds.

    Its time may have run out within an iteration, which was counted and had no effect.
    """
    share = Share("planning again")

    def progress(done: int, _cost: int | None) -> None:
        share(done)
        look()

    planner, seed = asked.get("planner", fleets.PLANNER), asked.get("seed", 0)
    whole = max(asked["iterations"], 1)
    for iterations in dict.fromkeys((whole, max(whole - 1, 1))):
        budget = Budget(expansions=iterations)
        plan = fleets.plan_fleet(fleet, planner, seed=seed, budget=budget, progress=progress)
        if plan.sum_of_costs == asked["sum_of_costs"]:
            return plan
    raise UsageError(
        "EXPORT", "planning again gave another plan", where="fleet", allowed="a plan that was found",
        todo="plan again, then keep it",
    )  # fmt: skip


def _scenario(question: Mapping[str, Any], fleet: Fleet, plan: FleetPlan) -> bytes:
    """The scenario's file, its robots listed, as ``lampyris fleet --save-scenario`` writes it; the iterations are the budget."""
    said = question["scenario"]
    ends = {"version": 1, **said, "start": [0, 0], "goal": [1, 1]}
    source = None if said.get("edits") else scenario_of_request({**question, "scenario": ends}).map
    made = FleetScenario(
        fleet, plan.planner, {}, seed=plan.seed, iterations=max(plan.iterations, 1), map=source
    )
    data = plain(completed_fleet(made), Path("."))
    text = yaml_of(data).encode()
    return text if len(text) <= MAX_BYTES else json_of(data).encode()


def _swarm(question: Mapping[str, Any], asked: Mapping[str, Any], what: str, look: Look) -> bytes:
    sources, settings = asked.get("sources", swarms.SOURCES[0]), asked["swarm"]
    if sources not in swarms.SOURCES or not isinstance(settings, Mapping):
        raise SettingError("SOURCES", shown(sources), where="sources", allowed=", ".join(swarms.SOURCES))
    grid = ground_of(question)
    robots, seed = robots_of(asked, MOST_ROBOTS), asked.get("seed", 0)
    trace = swarms.swarm_robots(
        grid, sources, robots, seed=seed, progress=lambda *_: look(), swarm_settings=settings
    )
    if what == "json":
        return _text({**swarm_record(trace), "timing": {}})
    share = Share("drawing")

    def drawn(done: int) -> None:
        share(done)
        look()

    signal = signal_on(grid, trace.sources, 0.0)
    return _file(what, lambda path: swarm_film(trace, path, signal=signal, progress=drawn))


def _text(record: Mapping[str, Any]) -> bytes:
    return json.dumps(record, allow_nan=False).encode()


def _file(ending: str, write: Callable[[Path], object]) -> bytes:
    """What is written into a file of that ending."""
    with tempfile.TemporaryDirectory(prefix="lampyris-") as folder:
        path = Path(folder) / f"file.{ending}"
        write(path)
        return path.read_bytes()
