"""Several controllers one after the other in the same scene: a table, a picture, JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.outputs import Outputs, print_written
from lampyris.cli.progress import counting, working
from lampyris.cli.tables import print_tab
from lampyris.cli.text import print_json, print_notes
from lampyris.errors import UsageError

if TYPE_CHECKING:
    from lampyris.io.scenario.scenario import Scenario
    from lampyris.model.drive import Drive
    from lampyris.planning.base import Budget

COLUMNS = (
    ("cross_track_max", "off path, max (m)", 3), ("cross_track_mean", "mean (m)", 3), ("yaw_error_max", "yaw, max (rad)", 2),
    ("jerk_mean", "jerk (m/s3)", 2), ("yaw_acceleration_mean", "yaw (rad/s2)", 2), ("stops", "stops", None),
    ("contacts", "contacts", None),
)  # fmt: skip
"""Name of a measure of :func:`lampyris.report.data.following.following`, heading and digits of each column."""


def compare_controllers(
    scenario: Scenario,
    controllers: Mapping[str, Mapping[str, Any]],
    out: Outputs,
    budget: Budget | None = None,
) -> int:
    """Drive a scenario by each controller, write and print the results. Returns the exit code."""
    from lampyris import scenarios
    from lampyris.cli.request import drive_notes
    from lampyris.report.data.serialize import drive_record

    one_only = {
        "--film": out.film,
        "--replay": out.replay,
        "--chart": out.chart,
        "--csv": out.csv,
        "--export": out.export,
        "--bag": out.bag,
        "--save-scenario": out.save,
    }
    for option, path in one_only.items():
        if path is not None:
            raise UsageError(
                "OPTIONS", f"{option} with several controllers", allowed="--picture, or one controller"
            )
    print_notes(drive_notes(scenario))
    made: dict[str, Drive] = {}
    for name, given in controllers.items():
        settings = {**(scenario.drive or {}), "controller": name, "controller_settings": dict(given)}
        with counting(f"driving with {name}", "s", quiet=out.json) as second:
            done: Any = scenarios.run(replace(scenario, drive=settings), progress=second, budget=budget)
        made[name] = done
    print_notes(tuple(dict.fromkeys(note for one in made.values() for note in one.notes)))
    driven = {name: one for name, one in made.items() if one.curves}
    if out.picture is not None and not driven:
        print_notes(("the robot never set off, so no picture was written",))
    elif out.picture is not None:
        from lampyris.report.pictures.trails_picture import draw_trails

        with working("drawing", quiet=out.json):
            draw_trails(driven, out.picture)
    if out.json:
        print_json(
            {"controllers": {name: out.without_timing(drive_record(one)) for name, one in made.items()}}
        )
    else:
        print_tab(_tab(made))
        print_written(out.picture if driven else None)
    return 0 if all(one.arrived for one in made.values()) else NO_ANSWER


def _tab(made: Mapping[str, Drive]) -> Any:
    from lampyris.report.data.following import following
    from lampyris.report.html.table import Tab

    rows = []
    for name, one in made.items():
        found = following(one)
        rows.append((name, one.outcome.value, one.duration, *(found[key] for key, _, _ in COLUMNS)))
    first = next(iter(made.values()))
    rule = "filtered by the braking rule" if _filtered(made) else "not filtered"
    return Tab(
        "controllers",
        f"Controllers on the path of {first.planner}, {first.scene.robot.drive} drive",
        ("controller", "outcome", "time (s)", *(heading for _, heading, _ in COLUMNS)),
        tuple(rows),
        note=f"{len(first.tracks)} obstacles, seed {first.seed}; commands of controllers that steer are {rule}",
        digits=(None, None, 1, *(digits for _, _, digits in COLUMNS)),
    )


def _filtered(made: Mapping[str, Drive]) -> bool:
    return all(one.safety_filter == "braking" for one in made.values())
