"""Kept: what is shown, as a file."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from lampyris import api, scenarios
from lampyris.app.engine.cache import place_facts
from lampyris.app.engine.comparison import ComparisonResults, compare, comparison
from lampyris.app.engine.driving import driven, step_of
from lampyris.app.engine.frames import frame, json_frame
from lampyris.app.engine.layers import layer_of
from lampyris.app.engine.progress import Share, tell
from lampyris.app.engine.simulation import begin, finish
from lampyris.errors import UsageError
from lampyris.io.scenario.save import json_of, plain, yaml_of
from lampyris.io.scenario.scenario import Scenario
from lampyris.io.text.strict_yaml import MAX_BYTES, MAX_VALUES
from lampyris.model.drive import Drive
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.trace import Trace
from lampyris.motion.laws.node_table import nodes_of
from lampyris.planning import registry
from lampyris.planning.field.solve import solve_field
from lampyris.report.data.csv import write_drive_csv, write_plan_csv, write_trace_csv
from lampyris.report.data.measures import trace_metrics
from lampyris.report.film.drive_film import FPS as DRIVE_FPS
from lampyris.report.film.drive_film import DriveRenderer, film_drive
from lampyris.report.film.film_frames import Landscape, TraceRenderer
from lampyris.report.film.simulation_film import FPS, check, film, frames_of
from lampyris.report.html.render import render
from lampyris.report.html.table import Tab
from lampyris.report.pictures.plan_picture import LAYERS, draw_plan
from lampyris.scenarios import speed_law
from lampyris.study.analysis.measures import ALL
from lampyris.study.analysis.summary import summarise
from lampyris.study.page.page import page_of
from lampyris.typing import Floats

Look = Callable[[], None]
PIECE: Final = 2**18


def export(question: Mapping[str, Any], scenario: Scenario, look: Look) -> Iterator[bytes]:
    """A file as frames ``B``, and ``Z`` with its length. Meanwhile it tells how far it is.

    Parameters
    ----------
    question : ``what``: png, svg, webp, gif, csv, scenario or report. ``tick``, of a png: that moment of the
        simulation, or that sample of the drive, and not the plan. ``settings``: ``layer`` of a picture of the
        plan (luciferin, cost or none), or of a film or a moment of a simulation (none, or any of
        :func:`lampyris.app.engine.layers.layer_of`), ``fps`` and ``scale`` of a film; ``race``: the film is of a race
        of ``planners`` by a ``clock`` (steps or time); planners, laws and seeds
        of the report of a comparison.

    Raises
    ------
    UsageError : EXPORT.
    """
    make = _KINDS.get(str(question.get("what")))
    settings = question.get("settings") or {}
    if make is None or not isinstance(settings, Mapping):
        raise UsageError("EXPORT", f"{question.get('what')!r:.40}", where="what", allowed=", ".join(_KINDS))
    data = make({**settings, "tick": question.get("tick"), "what": question["what"]}, scenario, look)
    for at in range(0, len(data), PIECE):
        look()
        yield frame("B", data[at : at + PIECE])
    yield json_frame("Z", {"bytes": len(data)})


def _written(ending: str, write: Callable[[Path], object]) -> bytes:
    """What is written into a file of that ending."""
    with tempfile.TemporaryDirectory(prefix="lampyris-") as folder:
        path = Path(folder) / f"file.{ending}"
        write(path)
        return path.read_bytes()


def planned(scenario: Scenario) -> tuple[Plan, Profile | None]:
    """The scenario's plan and its speeds."""
    planner = registry.make(scenario.planner, scenario.settings)
    found = api.plan(scenario.scene, planner, seed=scenario.seed)
    law: Any = speed_law(scenario.law, scenario.law_settings)
    return found, api.speed_profile(scenario.scene, found, law) if found else None


def simulated(scenario: Scenario, look: Look) -> Trace:
    """The scenario's simulation."""
    run = begin(scenario)
    share = Share("running", run.state.last_tick)
    while run.outcome is None:
        run.tick()
        share(run.now)
        look()
    return finish(run)


def _picture(settings: Mapping[str, Any], scenario: Scenario, look: Look) -> bytes:
    tick = settings.get("tick")
    if tick is not None:
        return _moment(settings, scenario, look, tick)
    layer = settings.get("layer") or LAYERS[0]
    scene, own = scenario.scene, scenario.settings
    found, profile = planned(scenario)
    shares = {key: own[key] for key in ("rho", "gamma") if key in own}
    gates = "close" if own.get("gates") == "close" else "ignore"
    field = None if layer == "none" else solve_field(scene, gates=gates, **shares)
    return _written(
        settings["what"],
        lambda path: draw_plan(
            scene.grid, found, field=field, profile=profile, scene=scene, layer=layer, out=path
        ),
    )


def _moment(settings: Mapping[str, Any], scenario: Scenario, look: Look, tick: Any) -> bytes:
    """A tick of a simulation or a sample of a drive, as its film shows it."""
    if settings["what"] != "png":
        raise UsageError(
            "EXPORT",
            "a moment of a run as SVG",
            where="what",
            allowed="png",
            todo="take PNG, or the entire path",
        )
    if type(tick) is not int or tick < 0:
        raise UsageError("TICK", f"{tick!r:.40}", where="tick", allowed="a whole number >= 0")
    from PIL import Image

    if scenario.drive is not None:
        made = _moving(scenario, look)
        shown = DriveRenderer(made, None, 1, DRIVE_FPS).frame(min(tick * step_of(made), made.duration))
    else:
        trace = simulated(scenario, look)
        stage = TraceRenderer(trace, None, landscape=_landscape(settings, scenario, trace))
        shown = stage.frame(float(min(tick, trace.ticks)))
    out = io.BytesIO()
    Image.fromarray(shown).save(out, format="PNG")
    return out.getvalue()


def _moving(scenario: Scenario, look: Look) -> Drive:
    """A drive in which the robot set off.

    Raises
    ------
    UsageError : EXPORT: it never did.
    """
    made = driven(scenario, look)
    if not made.curves:
        raise UsageError(
            "EXPORT", f"nothing to show: {made.sentence}", where="scenario", allowed="a robot that sets off"
        )
    return made


def _drive_film(settings: Mapping[str, Any], scenario: Scenario, look: Look) -> bytes:
    made = _moving(scenario, look)
    given = {key: settings[key] for key in ("fps", "scale") if settings.get(key) is not None}
    share = Share("drawing")

    def drawn(done: int) -> None:
        share(done)
        look()

    return _written(settings["what"], lambda path: film_drive(made, path, progress=drawn, **given))


def _race_film(settings: Mapping[str, Any], scenario: Scenario, look: Look) -> bytes:
    from lampyris.app.engine.race.race import race_of
    from lampyris.report.film.race_film import moments_of, race_film

    given = {key: settings[key] for key in ("clock", "fps") if settings.get(key) is not None}
    check(f"film.{settings['what']}", given.get("fps", FPS), None)
    race = race_of(scenario, settings, look)
    share = Share("drawing", len(moments_of(race, given.get("fps", FPS)).moments))

    def drawn(done: int) -> None:
        share(done)
        look()

    return _written(settings["what"], lambda path: race_film(race, path, progress=drawn, **given))


def _film(settings: Mapping[str, Any], scenario: Scenario, look: Look) -> bytes:
    if settings.get("race"):
        return _race_film(settings, scenario, look)
    if scenario.drive is not None:
        return _drive_film(settings, scenario, look)
    return _film_of(scenario, simulated(scenario, look), settings, look)


def _landscape(settings: Mapping[str, Any], scenario: Scenario, trace: Trace) -> Landscape | None:
    """The layer beneath the moments of a run.

    Raises
    ------
    UsageError : LAYER.
    """
    name = settings.get("layer")
    if name is None or name == "none":
        return None
    moves = name == "reach"

    def values(tick: int) -> Floats:
        return layer_of(str(name), scenario, tick, _obstacles(trace, tick) if moves else None)

    return Landscape(str(name), values, moves)


def _obstacles(trace: Trace, tick: int) -> list[list[int]]:
    """Cells of the obstacles that are there at a tick."""
    return [
        track[min(tick - came, len(track) - 1)].tolist()
        for track, came in zip(trace.tracks, trace.appears, strict=True)
        if came <= tick
    ]


def _film_of(scenario: Scenario, trace: Trace, settings: Mapping[str, Any], look: Look) -> bytes:
    given = {key: settings[key] for key in ("fps", "scale") if settings.get(key) is not None}
    check(f"film.{settings['what']}", given.get("fps", FPS), given.get("scale"))
    below = _landscape(settings, scenario, trace)
    frames = frames_of(trace, given.get("fps", FPS))
    share = Share("drawing", frames)

    def drawn(done: int) -> None:
        share(done)
        if done == frames:
            tell("writing")
        look()

    given |= {"progress": drawn, "landscape": below}
    return _written(settings["what"], lambda path: film(trace, path, **given))


def _csv(settings: Mapping[str, Any], scenario: Scenario, look: Look) -> bytes:
    if scenario.drive is not None:
        made = _moving(scenario, look)
        return _written("csv", lambda path: write_drive_csv(path, made))
    if scenario.simulated:
        trace = simulated(scenario, look)
        return _written("csv", lambda path: write_trace_csv(path, trace))
    found, profile = planned(scenario)
    if profile is None:
        raise UsageError("CSV", "there is no path", where="scenario", allowed="a plan that found one")
    scene = scenario.scene
    return _written(
        "csv", lambda path: write_plan_csv(path, found, profile, scene.grid, nodes_of(scene, found))
    )


def _scenario(settings: Mapping[str, Any], scenario: Scenario, look: Look) -> bytes:
    """The scenario's file with everything decided, as ``lampyris ... --save`` writes it: YAML, or JSON where
    that would be more YAML than is read again (a map drawn by hand, say)."""
    data = plain(scenarios.completed(scenario), Path("."))
    text = yaml_of(data).encode()
    return text if len(text) <= MAX_BYTES and _values(data) < MAX_VALUES else json_of(data).encode()


def _values(data: Any) -> int:
    """How many values some plain data has, keys among them."""
    if isinstance(data, Mapping):
        return 1 + sum(1 + _values(one) for one in data.values())
    return 1 + (sum(map(_values, data)) if isinstance(data, list | tuple) else 0)


def _report(settings: Mapping[str, Any], scenario: Scenario, look: Look) -> bytes:
    if settings.get("planners"):
        compared = comparison(scenario, settings)
        results = ComparisonResults(compared)
        share = Share("comparing", len(compared.entrants) * len(compared.study.seeds))
        for _ in compare(compared, look, None, results):
            share(len(results))
            look()
        runs = results.runs()
        return page_of(runs, summarise(runs), films=False).encode()
    if scenario.drive is not None:
        raise UsageError(
            "EXPORT", "a report of a drive", where="what", allowed="png, svg, webp, gif, csv, scenario",
            todo="take the film and the CSV, or simulate in ticks",
        )  # fmt: skip
    return run_page(scenario, look).encode()


def run_page(scenario: Scenario, look: Look) -> str:
    """One page about one run: what was asked and what came of it, plan, film, measures and events."""
    trace = simulated(scenario, look)
    found, profile = planned(scenario)
    scene = scenario.scene
    picture = _picture({"what": "png", "layer": None}, scenario, look)
    moving = _film_of(scenario, trace, {"what": "webp"}, look)
    metrics = trace_metrics(trace, place_facts(trace.scene))
    measures = tuple(
        (measure.title, measure.scale * value, measure.about)
        for measure in ALL.values()
        if isinstance(value := metrics.get(measure.name), int | float) and not isinstance(value, bool)
    )
    events = tuple((e.tick, e.word, f"({e.cell[0]}, {e.cell[1]})", e.sentence) for e in trace.events[:500])
    who = f"{scenario.planner} on {scene.grid.name or 'a map'}"
    mean = "" if profile is None else f", planned mean speed {profile.mean:.3g} {profile.units}"
    return render(
        "app/engine/run_page.html.j2",
        title=scenario.name or who,
        trace=trace,
        plan=found,
        notes=dict.fromkeys((*found.notes, *trace.notes)),
        asked=(
            ("planner", scenario.planner),
            ("speed law", scenario.law),
            ("map", f"{scene.grid.name}, {scene.grid.width} x {scene.grid.height} cells"),
            ("from, to", f"{scene.start} to {scene.goal}"),
            ("obstacles", len(trace.obstacle_specs)),
            ("seed", scenario.seed),
        ),
        picture=picture,
        moving=moving,
        measures=Tab("numbers", "What the run measures", ("measure", "value", "what it is"), measures),
        events=Tab("events", "What happened", ("tick", "event", "cell", "what"), events),
        foot=f"{who}, seed {scenario.seed}{mean}",
    )


_KINDS: Final[Mapping[str, Callable[[Mapping[str, Any], Scenario, Look], bytes]]] = {
    "png": _picture,
    "svg": _picture,
    "webp": _film,
    "gif": _film,
    "csv": _csv,
    "scenario": _scenario,
    "report": _report,
}
