"""What each verb does. Results go to stdout, progress and remarks to stderr."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from lampyris.cli.request import Request, TrafficRequest
from lampyris.errors import FileError, UsageError

NO_ANSWER = 4


def plan(
    request: Request,
    explain: bool,
    as_json: bool,
    picture: Path | None,
    layer: str,
    csv: Path | None,
    force: bool,
) -> int:
    """``lampyris plan``. Returns the exit code."""
    from lampyris import api
    from lampyris.report.plain import plan_record

    check_outputs(force, picture, csv)
    if layer not in ("luciferin", "cost", "none"):
        raise UsageError("LAYER", f"{layer!r}", where="--layer", allowed="luciferin, cost or none")
    document = request.load()
    remarks(document.notes)
    scene = request.scene(document)
    remarks(request.about(scene))
    _, law = request.preset_of()
    settings = request.planner_settings()
    with _working(f"planning on {scene.grid.name or request.map_}", quiet=as_json):
        found = api.plan(
            scene, request.planner, request.seed, record=explain or picture is not None, **settings
        )
        profile = api.profile(found, scene, law) if found else None
    if picture is not None:
        from lampyris.field.solve import solve_field
        from lampyris.report.picture import draw_plan

        with _working("drawing", quiet=as_json):
            # The field that the planner walked on, not the default one.
            shares = {k: settings[k] for k in ("rho", "gamma") if k in settings}
            gates = "close" if settings.get("gates") == "close" else "ignore"
            field = solve_field(scene, gates=gates, **shares) if layer != "none" else None
            draw_plan(scene.grid, found, field=field, profile=profile, scene=scene, layer=layer, out=picture)
    if csv is not None:
        if found.path is None or profile is None:
            remarks(("no path, so no CSV was written",))
        else:
            from lampyris.report.csv_out import write_plan_csv

            write_plan_csv(csv, found, profile, scene.grid)
    if as_json:
        if not explain:
            # Whether a picture was drawn must not change the answer.
            found = replace(found, jumps=())
        print_json(plan_record(found, scene, profile, seed=request.seed))
    else:
        from lampyris.cli import show

        show.plan(found, scene, profile, explain=explain)
        show.written(picture, csv)
    return 0 if found else NO_ANSWER


def simulate(
    request: Request,
    traffic: TrafficRequest,
    ticks: int | None,
    patience: int | None,
    as_json: bool,
    film: Path | None,
    csv: Path | None,
    force: bool,
) -> int:
    """``lampyris simulate``. Returns the exit code."""
    from lampyris import api
    from lampyris.report.plain import trace_record

    check_outputs(force, film, csv)
    document = request.load()
    remarks(document.notes)
    scene = request.scene(document)
    remarks(request.about(scene))
    _, law = request.preset_of()
    settings = request.planner_settings()
    with _counting("simulating", "ticks", quiet=as_json) as tick:
        trace = api.simulate(
            scene,
            request.planner,
            traffic.traffic(scene.grid, request.seed),
            request.seed,
            ticks=ticks,
            law=law,
            patience=patience,
            progress=tick,
            **settings,
        )
    if film is not None:
        from lampyris.report.animate import film as make_film

        with _counting("filming", "frames", quiet=as_json) as frame:
            make_film(trace, film, progress=frame)
    if csv is not None:
        from lampyris.report.csv_out import write_trace_csv

        write_trace_csv(csv, trace)
    if as_json:
        print_json(trace_record(trace))
    else:
        from lampyris.cli import show

        show.trace(trace)
        show.written(film, csv)
    return 0 if trace.arrived else NO_ANSWER


def maps(name: str | None, as_json: bool) -> int:
    """``lampyris maps``. Returns the exit code."""
    from lampyris.maps import library

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


def planners(as_json: bool) -> int:
    """``lampyris planners``. Returns the exit code."""
    from lampyris.planners.registry import table

    rows = list(table().values())
    if as_json:
        print_json(
            {
                "planners": [
                    {
                        "name": r.name,
                        "summary": r.summary,
                        "source": r.source,
                        "traits": asdict(r.traits),
                        "settings": dict(r.settings),
                    }
                    for r in rows
                ]
            }
        )
    else:
        from lampyris.cli import show

        show.planners(rows)
    return 0


def print_json(record: Any) -> None:
    """One line of JSON on stdout."""
    sys.stdout.write(json.dumps(record, allow_nan=False, separators=(",", ":")) + "\n")
    sys.stdout.flush()


def remarks(notes: tuple[str, ...]) -> None:
    """Sentences for a person, on stderr."""
    for note in notes:
        print(f"note: {note}", file=sys.stderr)


def check_outputs(force: bool, *paths: Path | None) -> None:
    """Refuse at once what could not be written at the end."""
    given = [path.resolve() for path in paths if path is not None]
    if len(set(given)) < len(given):
        raise UsageError("OPTIONS", f"two outputs to {given[0]}", allowed="a file of its own for each")
    for path in paths:
        if path is None:
            continue
        if path.exists() and not force:
            raise UsageError(
                "EXISTS", "the file exists", where=str(path), todo="give --force to overwrite it"
            )
        folder = path.parent if str(path.parent) else Path(".")
        if not folder.is_dir() or not os.access(folder, os.W_OK):
            raise FileError(
                "FILE_WRITE", "cannot write there", where=str(path), allowed="a folder you may write in"
            )


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
