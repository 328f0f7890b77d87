"""Speeds and drives for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lampyris.cli import text
from lampyris.cli.show import written
from lampyris.model.drive import Drive
from lampyris.model.profile import Profile
from lampyris.report.data.metrics import cause_shares, drive_shares, worth_telling
from lampyris.report.data.serialize import drive_corners

if TYPE_CHECKING:
    from lampyris.cli.speed_work import Answer

__all__ = ["answer", "drive", "laws", "no_way", "written"]


def no_way(sentence: str) -> None:
    """There is no way, and why."""
    text.line(sentence, style="bold red")


def answer(told: Answer, *, explain: bool, all_nodes: bool) -> None:
    """The laws side by side, then what holds the one that is looked at."""
    profile = told.entry.profile
    grid, course = told.scene.grid, told.course
    length = float(course.s[-1])
    text.line(f"{length:.4g} m in {profile.duration:.4g} s by the {told.entry.law} law", style="bold")
    stops = f"{int(course.stop.sum())} stops to turn"
    shape = f"{len(told.given)} points made {told.arcs} arcs and {stops}"
    corners = (
        [("corners", f"{told.arcs} rounded within half a step, {stops}")] if told.smooth == "none" else []
    )
    lengths = (
        f"{told.given_m:.6g} m; driven: {length:.6g} m ({told.smooth}), "
        f"at most {told.deviation_m:.3g} m from it"
    )
    text.facts(
        "",
        [
            ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
            ("way", f"from {told.source}: {shape}; {len(course)} nodes"),
            ("way given", lengths),
            *corners,
        ],
    )
    _laws_table(told)
    for law, why in told.refused.items():
        text.line(f"{law} does not let the robot drive: {why}", style="red")
    columns = ("cause", "of the way", "of the time")
    shares = [(share.cause, f"{share.way:.1%}", f"{share.time:.1%}") for share in cause_shares(profile)]
    text.table(f"what holds {told.entry.law}", columns, shares, right=columns[1:])
    if explain:
        _reasons(profile, all_nodes)


def _laws_table(told: Answer) -> None:
    columns = ("law", "time s", "mean m/s", "x optimum", "lateral m/s2", "breaks")
    rows = []
    for e in told.entries:
        numbers = (f"{e.duration_s:.2f}", f"{e.mean:.3f}", f"{e.ratio:.3f}", f"{e.peak_lateral:.3f}")
        rows.append((e.law, *numbers, ", ".join(e.broken) or "-"))
    text.table("laws on this way", columns, rows, right=columns[1:-1], bold=told.chosen, red="breaks")


def _reasons(profile: Profile, all_nodes: bool) -> None:
    """A row for each stretch that one thing holds, or for each node."""
    from lampyris.cli.speed_work import runs

    columns = ("node", "s (m)", "v (m/s)", "t (s)", "held by")
    rows = []
    for a, b in runs(profile, all_nodes):
        node = str(a) if a == b else f"{a}-{b}"
        numbers = (
            f"{x[a]:.3f}" if a == b else f"{x[a]:.3f} - {x[b]:.3f}" for x in (profile.s, profile.v, profile.t)
        )
        rows.append((node, *numbers, profile.why(a)))
    text.table("why", columns, rows, right=columns[:-1], whole=columns[:-1])


def drive(run: Drive, *, name: str = "") -> None:
    """A drive in continuous time."""
    grid = run.scene.grid
    text.line(run.sentence, style=f"bold {'green' if run.arrived else 'red'}")
    kinds: dict[str, int] = {}
    for body in run.bodies:
        kinds[body.kind] = kinds.get(body.kind, 0) + 1
    told = ", ".join(f"{kind} x{n}" for kind, n in kinds.items()) or "none"
    after = f"{run.outcome.value} after {run.duration:.2f} s"
    if run.optimum:
        after += f", {run.duration / run.optimum:.2f} times the optimum of the first way without obstacles"
    moments = [m.word for m in run.moments]
    hits = f"waits {moments.count('wait')}, hits {moments.count('hit')}, contacts {moments.count('contact')}"
    turns = drive_corners(run)
    moving = float(run.v.max(initial=0.0))
    rows = [("scenario", name)] if name else []
    rows += [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("from, to", f"{run.scene.start} to {run.scene.goal}"),
        ("planner", f"{run.planner}, {run.scene.moves.name} moves, seed {run.seed}; {run.replans} replans"),
        ("obstacles", f"{len(run.bodies)} ({told})"),
        ("outcome", after),
        ("corners", f"{turns['turns'] - turns['stops']} rounded, {turns['stops']} stops to turn"),
        ("met", hits),
        ("speed", f"{run.law} law, greatest {moving:.3g} m/s, a decision every {run.period:g} s"),
        ("held by", ", ".join(f"{c.cause} {c.time:.0%}" for c in worth_telling(drive_shares(run))) or "-"),
    ]
    if run.error > 0:
        rows.append(("off its way", f"at most {run.error:.3g} m from where it was commanded to be"))
    text.facts("", rows)


def _setting(row: dict[str, Any], key: str, value: object) -> str:
    """A setting and its value; a rule that is off with the names that turn it on."""
    rule = row["rules"].get(key)
    if rule is None or value is not None:
        return f"{key} = {value}"
    own = ", ".join(f"{name} = {default}" for name, default in rule.items())
    return f"{key} = off; on, or any of: {own}"


def laws(records: list[dict[str, Any]], *, alone: bool) -> None:
    """The speed laws; one alone with its settings."""
    if alone:
        row = records[0]
        told = [_setting(row, key, value) for key, value in row["settings"].items()]
        settings = "\n".join(told) or "none"
        facts = [("what it does", row["summary"]), ("source", row["source"]), ("units", row["units"])]
        text.facts(row["name"], [*facts, ("settings", settings)])
        return
    rows = [(row["name"], (row["summary"], row["source"])) for row in records]
    text.table("speed laws", ("name", "what it does, and its source"), rows, whole=("name",))
    text.line("lampyris laws NAME shows the settings of one; --set-law KEY=VALUE changes them.")
