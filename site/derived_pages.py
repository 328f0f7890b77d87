"""The pages of the reference that are derived from the program: commands, planners, laws, settings, errors, Python."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import lampyris
from lampyris._core.settings import descriptions_of, settings_of
from lampyris.planning import registry

GROUPS: Mapping[str, tuple[str, ...]] = {
    "Maps and scenes": ("load_grid", "Grid", "Scene", "Robot", "Sensor", "MOVES", "Moves", "inflate", "inflation_costs"),
    "Plans": ("plan", "list_planners", "Plan", "Status", "Path", "MapModel", "Budget", "CancelToken", "Change"),
    "Fields": ("solve_field", "solve_fields", "Field", "Gate"),
    "Speeds and curves": (
        "speed_profile", "Profile", "smooth", "SampledPath", "Curve", "dissertation_speeds", "node_table",
        "fastest_time_settings",
    ),
    "Moving obstacles": ("RandomWalk", "Patrol", "Crossing", "Recorded", "Edit", "ObstacleStates", "Track"),
    "Simulation": ("simulate", "Trace", "Outcome", "drive", "Drive"),
    "Motion primitives": ("motion_primitives", "load_primitives", "save_primitives", "Motion", "MotionPrimitives"),
    "Fleets": (
        "Fleet", "Agent", "random_fleet", "load_fleet", "plan_fleet", "FleetPlan", "export_fleet", "simulate_fleet",
        "Delays", "FleetTrace", "lifelong_fleet", "load_tasks", "FleetTask", "LifelongTrace",
    ),
    "Swarms of robots": (
        "swarm_robots", "drawn_sources", "load_sources", "ThreePeaks", "InverseSquare", "Plume", "SwarmTrace",
    ),
    "Chains and photographs": ("Chain", "plan_chain", "ChainPlan", "draw_chain", "segment_photo", "SegmentedPhoto"),
    "Scenarios, studies, uncertainty": (
        "Scenario", "load_scenario", "save_scenario", "run", "FleetScenario", "Study", "load_study", "run_study",
        "propagate_uncertainty",
    ),
    "Errors": ("LampyrisError", "SettingError"),
}  # fmt: skip
"""The public names by topic; :func:`write_python` refuses to leave one out."""
MODULES = ("curves", "plot", "notebook", "uncertainty", "testing")
INTRODUCTIONS = {
    "python": "Every public name, with shapes, units and errors. How they work together: [Python](../docs/python.md).",
    "commands/index": "Exit codes: 0 done, 2 wrong arguments, 3 a bad file, 4 no path or not arrived, 5 limit, 6 internal fault, "
    "130 Ctrl-C.",
    "planners": "`--planner NAME` and `planner=` take these names; settings are given by `--set KEY=VALUE` or as keywords.",
    "laws": "`--law NAME` and `law=` take these names; settings are given by `--set-law KEY=VALUE`. What each computes: "
    "[speed laws](../docs/speed/README.md).",
    "settings": "Keys of robot files, scenario and study files, and keywords in Python; on the command line with dashes.",
    "errors": "Every message reads `error[CODE]: WHERE: what is wrong (value); allowed: what is; what to do`. Codes do not "
    "change between releases.",
}
"""The first paragraph of each page."""
TITLES = {"cells": "Planners on cells", "poses": "Planners of poses", "fleets": "Planners of fleets"}


def write_pages(folder: Path) -> None:
    """Write every derived page into a folder."""
    (folder / "commands").mkdir(parents=True)
    write_python(folder)
    write_commands(folder / "commands")
    write_planners(folder)
    write_laws(folder)
    write_settings(folder)
    write_errors(folder)


def write_python(folder: Path) -> None:
    """Write the list of public names, from which autosummary makes a page for each.

    Raises
    ------
    SystemExit : a public name has no topic in ``GROUPS``, or a topic names what is not public.
    """
    named = {name for names in GROUPS.values() for name in names}
    public = set(lampyris.__all__) - {"__version__", *MODULES}
    if named != public:
        raise SystemExit(f"site/derived_pages.py, GROUPS: {sorted(named ^ public)} stand on one side only")
    lines = ["# Python", "", INTRODUCTIONS["python"], ""]
    for topic, names in GROUPS.items():
        lines += [
            f"## {topic}",
            "",
            *_autosummary([f"lampyris.{name}" for name in names if name != "MOVES"]),
            "",
        ]
        if "MOVES" in names:
            sets = ", ".join(f"`{name}`" for name in lampyris.MOVES)
            lines += [f"`lampyris.MOVES` is a mapping from names to `Moves`: {sets}.", ""]
    lines += ["## Modules", "", *_autosummary([f"lampyris.{name}" for name in MODULES], "module"), ""]
    _write(folder / "python.md", lines)


def _autosummary(names: Sequence[str], template: str = "") -> list[str]:
    options = [":toctree: api", ":nosignatures:"] + (
        [f":template: autosummary/{template}.rst"] if template else []
    )
    return [
        "```{eval-rst}",
        ".. autosummary::",
        *(f"   {one}" for one in options),
        "",
        *(f"   {n}" for n in names),
        "```",
    ]


def write_commands(folder: Path) -> None:
    """Write a page for each verb with its options, and a table of all."""
    import typer.main

    from lampyris.cli.app import app

    group: Any = typer.main.get_command(app)
    lines = ["# Commands", "", INTRODUCTIONS["commands/index"], ""]
    rows = []
    for name in group.list_commands(None):
        verb = group.get_command(None, name)
        _write(folder / f"{name}.md", [f"# lampyris {name}", "", *_verb(f"lampyris {name}", verb, 2)])
        rows.append((f"[`{name}`]({name}.md)", _first(verb.help or "")))
    _write(folder / "index.md", [*lines, *_table(("command", "what it does"), rows)])


def _verb(called: str, verb: Any, level: int) -> list[str]:
    lines = [_plain(verb.help or ""), ""]
    if hasattr(verb, "commands"):
        for name, one in verb.commands.items():
            lines += [f"{'#' * level} {called} {name}", "", *_verb(f"{called} {name}", one, level + 1)]
        return lines
    from lampyris.cli.panels import PANELS, REST, panel_of

    context = type(verb).context_class(verb, info_name=called, terminal_width=10_000)
    usage = " ".join(verb.collect_usage_pieces(context))
    lines += ["```text", f"{called} {usage}", "```", ""]
    sections: dict[str, list[tuple[str, str]]] = {
        "Arguments": [],
        **{panel: [] for panel in PANELS},
        REST: [],
    }
    for parameter in verb.params:
        record = parameter.get_help_record(context)
        if record is not None:
            panel = panel_of(parameter) if parameter.param_type_name == "option" else "Arguments"
            sections[panel].append((f"`{record[0].strip()}`", _plain(record[1])))
    for panel, records in sections.items():
        if records:
            lines += [f"{'#' * level} {panel}", "", *_table(("", "meaning"), records), ""]
    return lines


def write_planners(folder: Path) -> None:
    """Write all planners with what they promise, their sources and settings."""
    lines = ["# Planners", "", INTRODUCTIONS["planners"], ""]
    for kind, title in TITLES.items():
        lines += [f"## {title}", ""]
        for name, row in registry.list_planners(kind).items():  # type: ignore[call-overload]
            traits = [
                word.replace("_", " ")
                for word in row.traits.__dataclass_fields__
                if getattr(row.traits, word) is True
            ]
            lines += [f"### {name}", "", row.summary, "", f"Source: {row.source}", ""]
            lines += [f"Traits: {', '.join(traits) or 'none'}.", "", *_settings(registry.any_class(name)), ""]
    _write(folder / "planners.md", lines)


def write_laws(folder: Path) -> None:
    """Write all speed laws with their settings."""
    from lampyris.motion.laws import registry as laws

    lines = ["# Speed laws", "", INTRODUCTIONS["laws"], ""]
    for row in laws.LAWS.values():
        rows = [(f"`{key}`", f"`{value}`") for key, value in laws.settings_of(row.name).items()]
        lines += [
            f"## {row.name}",
            "",
            row.summary,
            "",
            f"Source: {row.source}",
            "",
            *_table(("setting", "default"), rows),
            "",
        ]
    _write(folder / "laws.md", lines)


def write_settings(folder: Path) -> None:
    """Write the settings of robots, sensors, simulations and drives."""
    from lampyris.model.robot import Robot
    from lampyris.model.settings.drive import DriveSettings
    from lampyris.model.settings.sensor import Sensor
    from lampyris.model.settings.simulation import SimulationSettings

    lines = ["# Settings", "", INTRODUCTIONS["settings"], ""]
    for title, kind in (
        ("Robot", Robot),
        ("Sensor", Sensor),
        ("Simulation", SimulationSettings),
        ("Drive", DriveSettings),
    ):
        lines += [f"## {title}", "", *_settings(kind), ""]
    _write(folder / "settings.md", lines)


def _settings(kind: type) -> list[str]:
    meanings = descriptions_of(kind)
    rows = [
        (f"`{name}`", f"`{_default(kind, name)}`", setting.allowed, meanings[name])
        for name, setting in settings_of(kind).items()
    ]
    return _table(("setting", "default", "allowed", "meaning"), rows) if rows else ["No settings."]


def _default(kind: Any, name: str) -> object:
    return kind.__dataclass_fields__[name].default


ERRORS = (
    "UsageError",
    "BusyError",
    "InputError",
    "FileError",
    "SceneError",
    "SettingError",
    "UnknownSettingError",
    "LimitError",
)


def write_errors(folder: Path) -> None:
    """Write the tree of errors and every code, read from the places that raise them."""
    found: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    package = Path(lampyris.__file__).parent
    raises = re.compile(rf"(?:{'|'.join(ERRORS)})(?:\.of)?\(")
    texts = [file.read_text(encoding="utf-8") for file in sorted(package.rglob("*.py"))]
    for text in filter(raises.search, texts):
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and (kind := _error(node.func)) and node.args:
                code, what = node.args[0], node.args[1] if len(node.args) > 1 else None
                if isinstance(code, ast.Constant) and re.fullmatch(r"[A-Z][A-Z0-9_]+", str(code.value)):
                    found[str(code.value)][kind].add(_text(what))
    lines = ["# Errors", "", INTRODUCTIONS["errors"], "", "```text"]
    from lampyris import errors

    lines += [line[4:] for line in (errors.__doc__ or "").splitlines() if line.startswith("    ")]
    lines += ["```", ""]
    rows = [
        (
            f"`{code}`",
            ", ".join(sorted(kinds)),
            "; ".join(sorted({t for ts in kinds.values() for t in ts if t})[:2]),
        )
        for code, kinds in sorted(found.items())
    ]
    _write(folder / "errors.md", [*lines, *_table(("code", "class", "says, for example"), rows)])


def _error(called: ast.expr) -> str:
    if isinstance(called, ast.Attribute) and called.attr == "of":
        called = called.value
    name = (
        called.id
        if isinstance(called, ast.Name)
        else called.attr
        if isinstance(called, ast.Attribute)
        else ""
    )
    return name if name in ERRORS else ""


def _text(what: ast.expr | None) -> str:
    """The sentence of an error; values that are filled in stand as three dots."""
    if isinstance(what, ast.Constant):
        return str(what.value)
    if isinstance(what, ast.JoinedStr):
        return "".join(str(v.value) if isinstance(v, ast.Constant) else "..." for v in what.values)
    return ""


def _plain(text: str) -> str:
    return " ".join(text.split())


def _first(text: str) -> str:
    return _plain(text).partition(". ")[0].rstrip(".")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"

    return [line(head), "|" + "---|" * len(head), *(line(row) for row in rows)]


def _write(file: Path, lines: Sequence[str]) -> None:
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
