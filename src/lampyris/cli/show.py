"""Plans, runs, maps and planners for people."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from lampyris.cli import text
from lampyris.cli.outputs import STDOUT
from lampyris.io.maps.library import MapInfo
from lampyris.io.maps.recipes.recipe import Recipe
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.planning.registry import PlannerInfo
from lampyris.report.data.adgso_tables import COLUMNS, jump_tables
from lampyris.report.data.metrics import path_metrics
from lampyris.report.data.serialize import STEP_WORDS, corners_record


def plan(found: Plan, scene: Scene, profile: Profile | None, *, explain: bool, name: str = "") -> None:
    """A plan: the verdict first, then the numbers, then (on request) every iteration."""
    grid = scene.grid
    style = "green" if found else "red"
    text.line(found.sentence, style=f"bold {style}")
    rows = [("scenario", name)] if name else []
    rows += [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("from, to", f"{scene.start} to {scene.goal}"),
        ("planner", f"{found.planner}, {scene.moves.name} moves"),
    ]
    if found.path is not None and found.steps is not None:
        counts = ", ".join(f"{n} {w}" for n, w in zip(found.steps, STEP_WORDS, strict=False))
        m = path_metrics(found.path, grid)
        gap = found.gap or 0.0
        rows += [
            ("cost", f"{found.cost:.6g} cells ({counts}); best {found.optimal_cost:.6g}, gap {gap:.2%}"),
            ("length", f"{m['length_m']:.4g} m, {m['turns']} turns, {len(found.path.cells)} cells"),
            ("sum of cost-to-go", f"{found.sum_cost_to_go:.6g}"),
        ]
    rows += [("note", note) for note in found.notes]
    waiting = ""
    if found.schedule is not None:
        ticks = found.schedule.tolist()
        waits = ticks[-1] - ticks[0] - len(ticks) + 1
        rows.append(("schedule", f"on the goal at tick {ticks[-1]}, {waits} ticks of waiting on the way"))
        waiting = ", without the waiting" if waits else ""
    if found.any_angle_length is not None and found.waypoints is not None:
        told = f"{found.any_angle_length:.6g} cells in {len(found.waypoints) - 1} straight lines"
        rows.append(("any angle", told))
    rows.append(("iterations", f"{found.iterations}; {found.expansions} expansions"))
    on_path = text.some([g.cell for g in found.gates_on_path]) or "none"
    rows.append(("gates", f"on the way: {on_path}; in the map: {len(found.gates_in_map)}"))
    if found.gates_met:
        rows.append(("replanned at", text.some(found.gates_met)))
    if profile is not None:
        mean = f"mean {profile.mean:.4g} {profile.units} ({profile.law} law)"
        rows.append(("speed", f"{mean}; {_duration(profile)} in all{waiting}"))
        corners = corners_record(found, scene, profile)
        if corners is not None:
            rounded = corners["turns"] - corners["stops"]
            told = f"{rounded} rounded within half a step, {corners['stops']} stops to turn"
            rows.append(("corners", told))
        rows.append(("held by", _causes(profile.cause)))
    seconds = found.timing.get("total_s")
    if seconds is not None:
        loaded = found.timing.get("loading_s", 0.0)
        once = f", loading compiled code {1000 * loaded:.1f} ms" if loaded >= 1e-4 else ""
        planning = f"planning {1000 * found.timing['plan_s']:.1f} ms"
        rows.append(("time", f"{1000 * seconds:.1f} ms, of which {planning}{once}"))
    text.facts("", rows)
    if explain:
        _explain(found, profile)


def _duration(profile: Profile) -> str:
    return f"{profile.duration:.4g} {'s' if profile.metric else 'transfers'}"


def _causes(causes: Sequence[str]) -> str:
    counts: dict[str, int] = {}
    for cause in causes:
        counts[cause] = counts.get(cause, 0) + 1
    return ", ".join(f"{c} x{n}" for c, n in sorted(counts.items(), key=lambda e: (-e[1], e[0])))


def _explain(found: Plan, profile: Profile | None) -> None:
    for jump in jump_tables(found):
        text.line(jump.title, style="bold")
        right = [COLUMNS[k] for k in (0, 2, 3)]
        text.table("", COLUMNS, jump.rows, right=right, bold=jump.chosen, boxed=True)
        text.line(jump.note)
    if profile is not None and found.path is not None:
        columns = ("node", "cell", "s", f"v ({profile.units})", "t", "held by")
        numbers = (profile.s, profile.v, profile.t)
        rows = [
            (str(k), f"({x}, {y})", *(f"{of[k]:.4g}" for of in numbers), profile.cause[k])
            for k, (x, y) in enumerate(found.path.cells)
        ]
        right = [name for name in columns if name not in ("cell", "held by")]
        text.table("speed at each node", columns, rows, right=right, boxed=True)


def trace(run: Trace, *, name: str = "") -> None:
    """A simulation."""
    text.line(run.sentence, style=f"bold {'green' if run.arrived else 'red'}")
    grid = run.scene.grid
    kinds = _causes([b.kind for b in run.bodies]) or "none"
    moving = run.speed[run.speed > 0]
    mean = f"{moving.mean():.4g}" if len(moving) else "0"
    told = f"{run.replans} replans, {run.waits} waits, {run.flips} changes of mind"
    rows = [("scenario", name)] if name else []
    rows += [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("from, to", f"{run.scene.start} to {run.scene.goal}"),
        ("planner", f"{run.planner}, {run.scene.moves.name} moves, seed {run.seed}"),
        ("obstacles", f"{len(run.bodies)} ({kinds})"),
        (
            "outcome",
            f"{run.outcome.value} after {run.ticks} ticks; collisions {run.collisions}, hits {run.hits}",
        ),
        ("cost", f"{run.cost:.6g} cells driven; {told}"),
        ("iterations", f"{run.iterations}; {run.expansions} expansions"),
        ("speed", f"mean {mean} {run.units} while moving ({run.law} law)"),
        ("held by", _causes(run.cause)),
    ]
    if run.edits:
        walls, freed = (sum(len(getattr(e, what)) for e in run.edits) for what in ("blocked", "freed"))
        times = f"{len(run.edits)} time" + "s" * (len(run.edits) > 1)
        rows.insert(-4, ("edits", f"{times}: {walls} cells turned into walls, {freed} free"))
    text.facts("", rows)


def maps(rows: Sequence[MapInfo]) -> None:
    """The bundled maps, a line each."""
    columns = ("name", "size", "free", "terrain", "gates", "what it is")
    cells = [
        (r.name, f"{r.width} x {r.height}", f"{r.free:.0%}", _terrain(r)[0], str(r.gates), r.title)
        for r in rows
    ]
    text.table("bundled maps", columns, cells, right=columns[1:-1], whole=columns[:-1])
    text.line("lampyris maps NAME says more of one; lampyris maps make RECIPE makes others.")


def _terrain(row: MapInfo) -> tuple[str, str]:
    """What there is to say of a map's terrain, shortly and in full: how much there is, what it costs."""
    if row.terrain is None:
        return "", ""
    share = row.terrain.cells / (row.width * row.height * row.free)
    low, high = (
        f"{(TERRAIN_UNIT + c) / TERRAIN_UNIT:.2g}" for c in (row.terrain.lowest, row.terrain.highest)
    )
    full = f"{share:.1%} of the free cells, {low} to {high} times as dear as plain ground"
    return f"{share:.0%}, {high}x", full


def map_(row: MapInfo) -> None:
    """One bundled map and its stored queries."""
    rows = [
        ("size", f"{row.width} x {row.height} cells"),
        ("free", f"{row.free:.1%}"),
        ("gates", str(row.gates)),
        ("what it is", f"{row.title}. {row.description}"),
        ("hash", row.hash),
    ]
    if row.recipe:
        rows.insert(-1, ("recipe", row.recipe))
    if row.terrain is not None:
        rows.insert(2, ("terrain", _terrain(row)[1]))
    text.facts(row.name, rows)
    columns = ("start", "goal", "best cost, octile", "gates on every optimal way")
    cells = []
    for q in row.queries:
        cost = "-" if q.cost is None else f"{q.cost:.2f}"
        cells.append((str(q.start), str(q.goal), cost, "-" if q.gates is None else str(q.gates)))
    text.table("stored queries", columns, cells, boxed=True)


def recipes(rows: Sequence[Recipe]) -> None:
    """The recipes and their settings."""
    for r in rows:
        cells = [(s.name, "none" if s.default == () else f"{s.default:g}", s.range, s.what) for s in r.table]
        columns = ("setting", "default", "allowed", "what it is")
        text.table(f"{r.name}: {r.summary}", columns, cells, right=("default",))


def planners(rows: Sequence[PlannerInfo]) -> None:
    """The planners: a line or two each, and where it comes from."""
    columns = ("name", "traits", "what it does, and its source")
    cells = [(r.name, ", ".join(_traits(r)) or "-", (r.summary, r.source)) for r in rows]
    text.table("planners", columns, cells, whole=("name",))
    text.line("lampyris planners NAME says more of one: its settings, and what they mean.")


def planner(row: PlannerInfo, about: str) -> None:
    """One planner: traits, settings with their defaults, and its own description."""
    settings = ", ".join(f"{k}={v}" for k, v in row.settings.items())
    rows = [
        ("traits", ", ".join(_traits(row)) or "none"),
        ("settings", settings or "none"),
        ("source", row.source),
    ]
    text.facts(row.name, rows)
    # ":class:`lampyris.planning.spacetime.sipp.Sipp`" is for readers of the code: here the name is enough.
    plain = re.sub(
        r":(?:(?:class|func|meth|attr):`(?:[\w.]*\.)?|mod:`)([\w.]+)`", r"\1", about.replace("``", "`")
    )
    print(plain)


def _traits(row: PlannerInfo) -> list[str]:
    words = ("optimal", "incremental", "stochastic", "sees_traffic")
    return [word.replace("_", " ") for word in words if getattr(row.traits, word)]


def written(*paths: Path | None) -> None:
    """Which files were written."""
    for path in paths:
        if path is not None and path != STDOUT and path.exists():
            text.line(f"wrote {path}")
