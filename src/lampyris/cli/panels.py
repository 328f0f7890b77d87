"""Panels of ``--help``: which options stand together, and in which order."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

PANELS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "Map": (
            "resolution", "values", "colour", "allow-outside", "strict", "max-cells", "zones", "keepout",
            "inflation-radius", "cost-scaling-factor",
        ),
        "Ends": ("start", "goal", "start-m", "goal-m", "goal-track", "via", "via-m", "via-order", "path", "units", "scen",
            "agents", "robots", "sources", "source-count"),
        "Robot": (
            "preset", "moves", "robot", "drive", "radius", "v-max", "a-max", "d-max", "a-lat-max", "turn-radius", "jerk-max",
            "yaw-rate-max", "sensor-range", "field-of-view", "unseen-cost",
            "tracking", "period", "command-period", "delay", "lag",
        ),
        "Planner and speed": (
            "planner", "planners", "set", "law", "laws", "all", "set-law", "smooth", "spacing", "v0", "seed", "seeds",
            "time-limit", "plan-limit", "patience", "seconds", "iterations", "method", "links", "samples",
            "vary", "of", "tolerance", "runs", "monte-carlo-runs", "held-out", "workers",
            "trials", "metric", "range", "held-out-share",
            "controller", "set-controller", "safety-filter", "margin", "goal-tolerance", "yaw-tolerance",
        ),
        "Obstacles": (
            "obstacles", "mobility", "rate", "obstacle-radius", "obstacle-rectangle", "obstacle-speed", "track", "tick",
            "obstacle-states", "obstacle-info", "noise", "max-age", "give-up", "on-hit",
            "ticks",
        ),
        "Node": (
            "transport", "name", "domain", "remap", "services", "stamped", "data-timeout", "obstacle-timeout",
        ),
        "Execution and tasks": (
            "execute", "policy", "delays", "delay-duration", "fault", "drive-limit", "lifelong", "window", "tasks",
        ),
        "Output": (
            "picture", "layer", "colour-by", "chart", "film", "replay", "csv", "export", "bag", "out", "save-scenario", "explain",
            "json", "no-timing", "force",
        ),
    }
)  # fmt: skip
"""Panel to its options, without the dashes. An option that is not here stands under "Options"."""

REST = "Options"
NODE = ("rate", "seconds")
"""Options that stand elsewhere in other verbs than ``ros``."""
_PANEL = {option: panel for panel, options in PANELS.items() for option in options}


def panel_of(parameter: Any, verb: str | None = None) -> str:
    """The panel of an option of click.

    Parameters
    ----------
    parameter : a ``click.Option`` (typer may have a click of its own).
    verb : whose option it is.
    """
    name = max(parameter.opts, key=len).removeprefix("--")
    return _PANEL.get(name, REST) if name not in NODE or verb != "ros" else "Node"


def write_panels(ctx: Any, formatter: Any, parameters: list[Any]) -> None:
    """Write help in plain text: arguments, then options panel by panel.

    Parameters
    ----------
    ctx : click's context.
    formatter : click's formatter.
    parameters : of the verb, in their order.
    """
    sections: dict[str, list[tuple[str, str]]] = {
        "Arguments": [],
        **{panel: [] for panel in PANELS},
        REST: [],
    }
    for parameter in parameters:
        record = parameter.get_help_record(ctx)
        if record is not None:
            option = parameter.param_type_name == "option"
            sections[panel_of(parameter, ctx.command.name) if option else "Arguments"].append(record)
    for panel, records in sections.items():
        if records:
            with formatter.section(panel):
                formatter.write_dl(records)
