"""``lampyris swarm``: glowworm swarm optimisation by robots that never touch.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris._core import defaults
from lampyris._core.settings import default_of
from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.option_errors import check_choice
from lampyris.cli.options import (
    AllowOutside,
    Colour,
    Film,
    Force,
    Json,
    Map,
    MaxCells,
    NoTiming,
    Picture,
    Resolution,
    Seed,
    Values,
)
from lampyris.cli.outputs import print_written
from lampyris.cli.progress import counting, working
from lampyris.cli.text import print_json, print_notes
from lampyris.model.settings.swarm import METHODS, SwarmSettings

if TYPE_CHECKING:
    from lampyris.model.grid import Grid
    from lampyris.model.swarm.sources import AnySource
    from lampyris.model.swarm.swarm_trace import SwarmTrace
    from lampyris.typing import FloatGrid

_ITERATIONS: int = default_of(SwarmSettings, "iterations")


class _Settings:
    """The settings of a swarm as a table of one planner, for ``--set``."""

    @staticmethod
    def planner_class(name: str) -> type[SwarmSettings]:
        return SwarmSettings

    @staticmethod
    def make(name: str, given: dict[str, Any]) -> SwarmSettings:
        return SwarmSettings.of(given)


def swarm(
    map_: Map,
    robots: Annotated[int, typer.Option("--robots", metavar="N", help="Number of robots.")] = 100,
    sources: Annotated[
        str,
        typer.Option(
            "--sources", metavar="three-peaks|drawn|FILE",
            help="three-peaks: the function J1 stretched over the map; drawn: sources at random places; or a list of them.",
        ),
    ] = "three-peaks",
    source_count: Annotated[
        int | None,
        typer.Option("--source-count", metavar="N", help="Number of random sources (default: 3)."),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method", metavar="|".join(METHODS),
            help=f"gso: follow brighter neighbours; gradient: climb the measured gradient (default: {METHODS[0]}).",
        ),
    ] = None,
    iterations: Annotated[
        int | None,
        typer.Option(
            "--iterations", metavar="N",
            help=f"Number of iterations: measure, broadcast, choose a leader, drive (default: {_ITERATIONS}).",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A setting of the robots, such as noise=0.1; repeatable."),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--seconds", metavar="S", help="Time limit; the iterations done so far are reported.")
    ] = None,
    seed: Seed = 0,
    resolution: Resolution = None,
    values: Values = defaults.VALUES,
    colour: Colour = defaults.COLOUR,
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    picture: Picture = None,
    film: Film = None,
    json_: Json = False,
    no_timing: NoTiming = False,
    force: Force = False,
) -> None:  # fmt: skip
    """Simulate robots that search for sources of a signal (glowworm swarm optimisation).

    Robots are discs that measure the signal, broadcast their luciferin, follow brighter neighbours and never touch each other
    or a wall. A source is held if at least capture_robots robots (3) are within its capture radius. Exit code 4: not every
    source is held at the end.
    """
    from lampyris import swarms
    from lampyris.cli.option_groups import MapOptions
    from lampyris.cli.request import budget_of, load_document, parse_settings

    outputs.check_outputs(force, json=json_, picture=picture, film=film)
    if method is not None:
        check_choice("SWARM_SETTING", "--method", method, METHODS)
    given = _once(
        parse_settings("swarm", settings or [], _Settings), {"method": method, "iterations": iterations}
    )
    checked = SwarmSettings.of(given)
    budget = budget_of("--seconds", seconds)
    document = load_document(
        MapOptions(
            map_,
            resolution=resolution,
            values=values,
            colour=colour,
            allow_outside=allow_outside,
            max_cells=max_cells,
        )
    )
    looked_for = _sources(document.grid, sources, source_count, seed, checked)
    print_notes(document.notes)
    with counting(f"simulating {robots} robots", "iterations", quiet=json_) as tick:
        show = None if tick is None else (lambda done, _most: tick(done))
        trace = swarms.swarm_robots(
            document.grid, looked_for, robots, seed=seed, budget=budget, progress=show, swarm_settings=given
        )
    print_notes(trace.notes)
    _draw(trace, picture, film, quiet=json_)
    if json_:
        from lampyris.report.data.swarm_record import swarm_record

        record = swarm_record(trace)
        print_json({**record, "timing": {}} if no_timing else record)
    else:
        _print(trace)
        print_written(picture, film)
    raise typer.Exit(0 if trace else NO_ANSWER)


def _once(settings: dict[str, Any], options: dict[str, Any]) -> dict[str, Any]:
    """The settings of ``--set`` and of options of their own that were given, each at most once."""
    from lampyris.errors import UsageError

    typed = {key: value for key, value in options.items() if value is not None}
    for key in sorted(typed.keys() & settings.keys()):
        raise UsageError("OPTIONS", f"--{key} and --set {key} both given", allowed="one of them")
    return {**settings, **typed}


def _sources(
    grid: Grid, given: str, count: int | None, seed: int, settings: SwarmSettings
) -> str | tuple[AnySource, ...]:
    """The sources by name or of a file."""
    from lampyris import swarms
    from lampyris.errors import UsageError

    if count is not None and given != "drawn":
        raise UsageError("OPTIONS", f"--source-count with --sources {given}", allowed="--sources drawn")
    if given == "drawn":
        return swarms.drawn_sources(grid, 3 if count is None else count, seed=seed, radius=settings.radius)
    return given if given in swarms.SOURCES else swarms.load_sources(given)


def _draw(trace: SwarmTrace, picture: Path | None, film: Path | None, *, quiet: bool) -> None:
    if picture is not None:
        from lampyris.report.pictures.swarm_picture import draw_swarm

        with working("drawing", quiet=quiet):
            draw_swarm(trace, picture, signal=_layer(trace))
    if film is not None and not trace.iterations:
        print_notes(("no iteration, so no film was made",))
    elif film is not None:
        from lampyris.report.film.swarm_film import swarm_film

        with counting("filming", "frames", quiet=quiet) as frame:
            swarm_film(trace, film, signal=_layer(trace), progress=frame)


def _layer(trace: SwarmTrace) -> FloatGrid:
    """The signal at the end over the map, from 0 where it is least."""
    from lampyris.sim.swarm.signals import signal_on

    return signal_on(trace.grid, trace.sources, trace.duration)


def _print(trace: SwarmTrace) -> None:
    """Print a trace: the verdict first, then the sources."""
    from lampyris.report.data.swarm_record import nearest_robots

    text.line(trace.sentence, style=f"bold {'green' if trace else 'red'}")
    grid, s = trace.grid, trace.settings
    walls = "walls block broadcasts" if s.line_of_sight else "walls do not block broadcasts"
    heard = f"hear {s.sensor_range:g} m, {walls}" if s.method == "gso" else "each climbs by its own sensors"
    rows: list[Any] = [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        (
            "robots",
            f"{trace.robots} discs of radius {s.radius:g} m, {s.v_max:g} m/s, step {s.step:g} m, seed {trace.seed}",
        ),
        ("method", f"{s.method}: {heard}, noise {s.noise:g}"),
        ("time simulated", f"{trace.iterations} iterations of {s.period:.2f} s, {trace.duration:.0f} s"),
    ]
    for k, (x, y) in enumerate(trace.source_xy[-1].tolist()):
        since = trace.held_from[k]
        words = f"{trace.held[-1, k]} robots within {s.capture_radius:.2f} m, "
        words += (
            f"held from iteration {since}"
            if since is not None
            else f"not held: fewer than {s.capture_robots}"
        )
        near = nearest_robots(trace, k)
        rows.append(
            (f"source {k}", f"({x:.2f}, {y:.2f}) m, {words}; the {len(near)} nearest within {near[-1]:.2f} m")
        )
    rows.append(
        (
            "contacts",
            f"0 at any moment, as the referee measured; another robot was in the way {trace.encounters:,} times",
        )
    )
    if trace.iterations and s.method == "gso":
        sizes = trace.group_sizes(trace.iterations - 1)
        large = [str(size) for size in sizes if size >= s.capture_robots]
        rows.append(
            ("groups", f"{len(large)} at the end, of {', '.join(large[:12])}" if large else "none at the end")
        )
    seconds = trace.timing.get("total_s")
    if seconds is not None:
        loaded = trace.timing.get("loading_s", 0.0)
        once = f", loading compiled code {1000 * loaded:.1f} ms" if loaded >= 1e-4 else ""
        parts = f"simulating {1000 * trace.timing['simulate_s']:.1f} ms, referee {1000 * trace.timing['referee_s']:.1f} ms"
        rows.append(("time", f"{1000 * seconds:.1f} ms: {parts}{once}"))
    text.facts("", rows)
