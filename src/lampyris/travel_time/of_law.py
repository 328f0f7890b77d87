"""Which static caps a speed law has, as settings of the planner ``fastest-time``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lampyris.errors import UsageError
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.bounds import Optimum
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.travel_time.fastest_time import BLIND_SETTINGS


def fastest_time_settings(
    law: laws.SpeedLaw = "physical", law_settings: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Settings with which ``fastest-time`` minimises the travel time under the static caps of a law.

    Static caps depend on the map and the robot alone, place by place: clearance, zones, corners and blind
    areas. The laws ``physical``, ``blind``, ``three-speed``, ``cloud`` and ``optimum`` have no other caps without moving
    obstacles.

    Parameters
    ----------
    law : a law's name, or its settings.
    law_settings : of a law given by its name.

    Raises
    ------
    UsageError : ``LAW``: a law that has other caps, which depend on the whole path.
    SettingError : a setting that the law does not have, or out of its range.

    Examples
    --------
    >>> import lampyris
    >>> lampyris.fastest_time_settings("blind", {"creep": 0.2})["creep"]
    0.2
    """
    made = laws.with_settings(law, dict(law_settings or {})) if isinstance(law, str) else law
    if isinstance(made, Optimum):
        return {"clearance": False, "zones": False, "turns": True, "blind": False}
    if isinstance(made, PhysicalLaw) and made.uncertainty is None and made.approach is None:
        found: dict[str, Any] = {
            "clearance": made.clearance, "zones": made.zones, "turns": made.curvature, "creep": made.creep,
            "blind": made.blind is not None,
        }  # fmt: skip
        if made.blind is not None:
            found |= {ours: getattr(made.blind, theirs) for ours, theirs in BLIND_SETTINGS.items()}
        return found
    name = law if isinstance(law, str) else type(law).__name__
    rules = [rule for rule in ("uncertainty", "approach") if getattr(made, rule, None) is not None]
    why = f"the law {name} with {rules[0]}" if rules and name != rules[0] else f"the law {name}"
    raise UsageError(
        "LAW",
        f"{why}, of which not all caps are those of places: fastest-time cannot minimise its time",
        where="law",
        allowed="physical, blind, three-speed, cloud, optimum",
    )
