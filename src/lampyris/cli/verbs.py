"""What each verb does. Results go to stdout, progress and remarks to stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lampyris._core.limits import MAX_CELLS
from lampyris.cli import outputs
from lampyris.errors import LimitError, SettingError, UsageError

if TYPE_CHECKING:
    from lampyris.cli.request import Request, TrafficRequest
    from lampyris.io.scenario.scenario import Scenario
    from lampyris.model.plan import Plan
    from lampyris.model.profile import Profile
    from lampyris.model.trace import Trace
    from lampyris.planning.base import Budget

NO_ANSWER = 4
LAYERS = ("luciferin", "cost", "none")


@dataclass(frozen=True)
class Outputs:
    """What is to be printed and written."""

    json: bool = False
    timing: bool = True
    csv: Path | None = None
    save: Path | None = None
    force: bool = False
    explain: bool = False
    picture: Path | None = None
    layer: str | None = None
    film: Path | None = None
    chart: Path | None = None

    def check(self) -> None:
        """Refuse at once what could not be done at the end."""
        from lampyris.cli.request import known
        from lampyris.io.scenario.save import check_ending

        outputs.check_outputs(
            self.force, self.save, json=self.json, picture=self.picture, film=self.film, chart=self.chart,
            csv=self.csv,
        )  # fmt: skip
        known("LAYER", "--layer", self.layer or LAYERS[0], LAYERS)
        if self.save is not None:
            check_ending(self.save)


def plan(request: Request, out: Outputs, limit: float | None = None) -> int:
    """``lampyris plan``. Returns the exit code."""
    out.check()
    budget = budget_of("--time-limit", limit)
    return _plan(request.scenario(), out, budget)


def budget_of(option: str, seconds: float | None) -> Budget | None:
    """The budget of a call of the planner, as an option gives it.

    Raises
    ------
    SettingError : not a number of seconds.
    """
    if seconds is None:
        return None
    from lampyris.kernels import _jit, _machine
    from lampyris.planning.base import Budget

    try:
        made = Budget(seconds=seconds)
    except SettingError as fault:
        fault.where = option
        raise
    if not _jit.jit_disabled():
        _machine.load()  # the seconds are for planning
    return made


def simulate(
    request: Request,
    traffic: TrafficRequest,
    ticks: int | None,
    patience: int | None,
    out: Outputs,
    limit: float | None = None,
) -> int:
    """``lampyris simulate``. Returns the exit code."""
    out.check()
    budget = budget_of("--plan-limit", limit)
    scenario = request.scenario()
    bodies = traffic.traffic(scenario.scene, request.seed)
    scene = replace(scenario.scene, traffic=bodies)
    scenario = replace(scenario, scene=scene, simulated=True, ticks=ticks, patience=patience)
    return _simulate(scenario, out, budget)


def run(path: Path, allow_outside: bool, max_cells: int | None, out: Outputs) -> int:
    """``lampyris run``. Returns the exit code."""
    from lampyris.scenarios import load_scenario

    out.check()
    limit = MAX_CELLS if max_cells is None else max_cells
    scenario = load_scenario(path, allow_outside=allow_outside, max_cells=limit)
    kind = "drives" if scenario.drive is not None else "simulates" if scenario.simulated else "plans"
    only = {
        "--explain": (out.explain, "plans"), "--picture": (out.picture, "plans"),
        "--layer": (out.layer, "plans"), "--film": (out.film, "simulates drives"),
        "--chart": (out.chart, "drives"),
    }  # fmt: skip
    for option, (given, kinds) in only.items():
        if given and kind not in kinds:
            raise UsageError("OPTIONS", f"{option} with a scenario that {kind}", where=str(path))
    if kind == "drives":
        from lampyris.cli import drive_work

        return drive_work.run(scenario, out)
    return (_simulate if scenario.simulated else _plan)(scenario, out)


def schema() -> int:
    """``lampyris schema``. Returns the exit code."""
    from lampyris.io.scenario.schema import json_schema

    sys.stdout.write(json.dumps(json_schema(), indent=2) + "\n")
    return 0


def _plan(scenario: Scenario, out: Outputs, budget: Budget | None = None) -> int:
    from lampyris import scenarios
    from lampyris.cli.request import about
    from lampyris.model.plan import Status
    from lampyris.report.data.serialize import plan_record

    scene = scenario.scene
    remarks((*scenario.notes, *about(scene), *scenarios.without_effect(scenario)))
    with _working(f"planning on {scene.grid.name or 'the map'}", quiet=out.json):
        record = out.explain or out.picture is not None
        done: Any = scenarios.run(scenario, record=record, budget=budget)
    found: Plan = done.plan
    profile: Profile | None = done.profile
    if out.picture is not None:
        _draw(scenario, found, profile, out, out.picture)
    if out.csv is not None:
        if found.path is None or profile is None:
            remarks(("no path, so no CSV was written",))
        else:
            from lampyris.report.data.csv import write_plan_csv

            with outputs.place(out.csv) as place:
                write_plan_csv(place, found, profile, scene.grid)
    if out.save is not None:
        remarks(scenarios.save_scenario(scenario, out.save))
    if out.json:
        if not out.explain:
            # Whether a picture was drawn must not change the answer.
            found = replace(found, jumps=())
        print_json(_timed(plan_record(found, scene, profile, seed=scenario.seed), out))
    else:
        from lampyris.cli import show

        with outputs.text_beside(out.csv):
            show.plan(found, scene, profile, explain=out.explain, name=scenario.name)
            show.written(out.picture, out.csv, out.save)
    if found.status is Status.LIMIT:
        return LimitError.exit_code
    return 0 if found else NO_ANSWER


def _draw(scenario: Scenario, found: Plan, profile: Profile | None, out: Outputs, to: Path) -> None:
    from lampyris.planning.field.solve import solve_field
    from lampyris.report.pictures.plan_picture import draw_plan

    layer, settings, scene = out.layer or LAYERS[0], scenario.settings, scenario.scene
    with _working("drawing", quiet=out.json):
        # The field that the planner walked on, not the default one.
        shares = {k: settings[k] for k in ("rho", "gamma") if k in settings}
        gates = "close" if settings.get("gates") == "close" else "ignore"
        field = solve_field(scene, gates=gates, **shares) if layer != "none" else None
        draw_plan(scene.grid, found, field=field, profile=profile, scene=scene, layer=layer, out=to)


def _simulate(scenario: Scenario, out: Outputs, budget: Budget | None = None) -> int:
    from lampyris import scenarios
    from lampyris.cli.request import about
    from lampyris.report.data.serialize import trace_record

    remarks((*scenario.notes, *about(scenario.scene), *scenarios.without_effect(scenario)))
    with _counting("simulating", "ticks", quiet=out.json) as tick:
        done: Any = scenarios.run(scenario, progress=tick, budget=budget)
    trace: Trace = done
    remarks(trace.notes)
    if out.film is not None:
        from lampyris.report.film.simulation_film import film as make_film

        with _counting("filming", "frames", quiet=out.json) as frame:
            make_film(trace, out.film, progress=frame)
    if out.csv is not None:
        from lampyris.report.data.csv import write_trace_csv

        with outputs.place(out.csv) as place:
            write_trace_csv(place, trace)
    if out.save is not None:
        remarks(scenarios.save_scenario(scenarios.completed(scenario, trace), out.save))
    if out.json:
        print_json(_timed(trace_record(trace), out))
    else:
        from lampyris.cli import show

        with outputs.text_beside(out.csv):
            show.trace(trace, name=scenario.name)
            show.written(out.film, out.csv, out.save)
    return 0 if trace.arrived else NO_ANSWER


def _timed(record: dict[str, Any], out: Outputs) -> dict[str, Any]:
    """The record; without the seconds, if they are not wanted: then same call, same bytes."""
    return record if out.timing else {**record, "timing": {}}


def maps(name: str | None, as_json: bool) -> int:
    """``lampyris maps``. Returns the exit code."""
    from lampyris.io.maps import library

    if name is None:
        rows = [library.describe(n) for n in library.names()]
        if as_json:
            print_json({"maps": [asdict(r) for r in rows]})
        else:
            from lampyris.cli import show

            show.maps(rows)
        return 0
    row = library.describe(name)
    if as_json:
        print_json(asdict(row))
    else:
        from lampyris.cli import show

        show.map_(row)
    return 0


def _about(kind: type) -> str:
    """What a planner's class says of itself, and what those it shares settings with say of these."""
    import inspect

    parts = [inspect.cleandoc(kind.__doc__ or "")]
    for base in kind.__mro__[1:]:
        doc = inspect.cleandoc(base.__dict__.get("__doc__") or "")
        settings = doc.partition("\nParameters\n----------\n")[2]
        if settings:
            parts.append(settings)
    # What follows the heading of errors is for readers of the code.
    own, *shared = (part.partition("\n\nRaises\n")[0] for part in parts)
    if not shared:
        return own
    return "\n".join((own, "\nSettings shared with others\n---------------------------", *shared))


def planners(name: str | None, as_json: bool) -> int:
    """``lampyris planners``. Returns the exit code."""
    from lampyris.planning.registry import list_planners, planner_class, row_of

    rows = list(list_planners().values()) if name is None else [row_of(name)]
    if as_json:
        records = [
            {
                "name": r.name,
                "summary": r.summary,
                "source": r.source,
                "traits": asdict(r.traits),
                "settings": dict(r.settings),
            }
            for r in rows
        ]
        print_json({"planners": records} if name is None else records[0])
        return 0
    from lampyris.cli import show

    if name is None:
        show.planners(rows)
    else:
        show.planner(rows[0], _about(planner_class(name)))
    return 0


def print_json(record: Any) -> None:
    """One line of JSON on stdout."""
    sys.stdout.write(json.dumps(record, allow_nan=False, separators=(",", ":")) + "\n")
    sys.stdout.flush()


def remarks(notes: tuple[str, ...]) -> None:
    """Sentences for a person, on stderr."""
    for note in notes:
        print(f"note: {note}", file=sys.stderr)


@contextmanager
def _working(what: str, *, quiet: bool) -> Iterator[None]:
    """A spinner on stderr while something runs, for people at a terminal."""
    if quiet or not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{what} ..."):
        yield


@contextmanager
def _counting(what: str, unit: str, *, quiet: bool) -> Iterator[Callable[[int], None] | None]:
    """A running count on stderr, for people at a terminal."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{what} ...") as status:
        yield lambda n: status.update(f"{what} ... {n} {unit}")
