"""What ``lampyris drive`` does, and ``lampyris run`` with a scenario that says how to drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from lampyris import scenarios
from lampyris.cli import outputs, speed_show, verbs
from lampyris.cli.request import Request, TrafficRequest, about
from lampyris.cli.verbs import NO_ANSWER, Outputs
from lampyris.errors import SettingError, UsageError, did_you_mean
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.drive import Drive
from lampyris.planning.base import Budget
from lampyris.report.data.serialize import drive_record
from lampyris.sim.continuous.settings import Settings


def drive(
    request: Request, traffic: TrafficRequest, how: Mapping[str, Any], out: Outputs, limit: float | None
) -> int:
    """``lampyris drive``. Returns the exit code."""
    out.check()
    budget = verbs.budget_of("--plan-limit", limit)
    settings = _settings(how)
    scenario = request.scenario()
    bodies = traffic.traffic(scenario.scene, request.seed)
    scene = replace(scenario.scene, traffic=bodies)
    return run(replace(scenario, scene=scene, drive=asdict(settings)), out, budget)


def _settings(how: Mapping[str, Any]) -> Settings:
    """Settings of a drive from the words of a call.

    Raises
    ------
    UsageError : a word that an option does not know.
    SettingError : a number out of its range.
    """
    try:
        return Settings.of(how)
    except SettingError as fault:
        option = f"--{fault.where.replace('_', '-')}"
        word = how.get(fault.where)
        kind = UsageError if isinstance(word, str) else SettingError
        todo = did_you_mean(word, fault.allowed.split(", ")) if kind is UsageError else fault.todo
        raise kind(fault.code, fault.what, where=option, allowed=fault.allowed, todo=todo) from None


def run(scenario: Scenario, out: Outputs, budget: Budget | None = None) -> int:
    """Drive what a scenario says, and tell of it. Returns the exit code."""
    verbs.remarks((*scenario.notes, *about(scenario.scene), *scenarios.without_effect(scenario)))
    with verbs._counting("driving", "s", quiet=out.json) as second:
        done: Any = scenarios.run(scenario, progress=second, budget=budget)
    story: Drive = done
    verbs.remarks(story.notes)
    if story.curves:
        _write(story, out)
    elif out.film or out.chart or out.csv:
        verbs.remarks(("the robot never set off, so no film, chart or CSV was written",))
    if out.save is not None:
        verbs.remarks(scenarios.save_scenario(scenario, out.save))
    if out.json:
        record = drive_record(story)
        verbs.print_json(record if out.timing else {**record, "timing": {}})
    else:
        with outputs.text_beside(out.csv):
            speed_show.drive(story, name=scenario.name)
            speed_show.written(out.film, out.chart, out.csv, out.save)
    return 0 if story.arrived else NO_ANSWER


def _write(story: Drive, out: Outputs) -> None:
    """Film, chart and table."""
    if out.film is not None:
        from lampyris.report.film.drive_film import film_drive

        with verbs._counting("filming", "frames", quiet=out.json) as frame:
            film_drive(story, out.film, progress=frame)
    if out.chart is not None:
        from lampyris.report.charts.drive_chart import draw_drive

        with verbs._working("drawing", quiet=out.json):
            draw_drive(story, out.chart)
    if out.csv is not None:
        from lampyris.report.data.csv import write_drive_csv

        with outputs.place(out.csv) as place:
            write_drive_csv(place, story)
