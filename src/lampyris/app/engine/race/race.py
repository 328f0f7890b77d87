"""Raced: planners that explore the same map, with the order in which each expands cells."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from lampyris.app.engine.comparison import comparison
from lampyris.app.engine.frames import json_frame, order_frame
from lampyris.app.engine.layers import scene_at
from lampyris.errors import LampyrisError
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.race.race import Exploration, Race, Racer
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.races.race import check_racers, race, racer
from lampyris.scenarios import speed_law

Look = Callable[[], None]


def entrants(scenario: Scenario, question: Mapping[str, Any]) -> list[tuple[str, str, Mapping[str, Any]]]:
    """Label, name and settings of each planner of a question.

    Raises
    ------
    LampyrisError : what is wrong with them, with its JSON pointer; RACERS: too many.
    """
    found = comparison(scenario, {"planners": question.get("planners")}).study.planners
    check_racers(len(found))
    return [(one.called, one.name, one.settings) for one in found]


def raced(question: Mapping[str, Any], scenario: Scenario, look: Look) -> Iterator[bytes]:
    """For each planner ``H`` with its plan and ``O`` with the order in which it expands cells; then ``Z``.

    One that refuses the question has the outcome ``refused``, and the others go on.
    """
    scene, law = scene_at(scenario.scene, 0), speed_law(scenario.law, scenario.law_settings)
    for k, (label, name, settings) in enumerate(entrants(scenario, question)):
        look()
        head = {"k": k, "label": label, "planner": name}
        try:
            made, profile = racer(label, scene, registry.make(name, settings), law, scenario.seed, look=look)
        except LampyrisError as fault:
            if fault.exit_code == 6:
                raise
            yield json_frame(
                "H",
                {**head, "outcome": "refused", "sentence": str(fault), "kind": "none", "path": [], "t": []},
            )
            continue
        yield json_frame("H", {**head, **record(made), "units": "" if profile is None else profile.units})
        yield order_frame(k, *_order(made.exploration, scene))
    yield json_frame("Z", {})


def record(made: Racer) -> dict[str, Any]:
    """What a racer found as plain data; paths in cells, seconds."""
    plan, looked = made.plan, made.exploration
    straight = plan.any_angle_length is None and plan.pose_path is None
    return {
        "outcome": plan.status.value,
        "sentence": plan.sentence,
        "kind": looked.kind,
        "steps": looked.steps,
        "field": looked.field,
        "jumps": [[count, *cell] for count, cell in looked.jumps],
        "note": looked.note,
        "expansions": plan.expansions,
        "cost": made.length if plan.path is not None else None,
        "gap": plan.gap if straight else None,
        "any_angle": not straight,
        "ms": 1000 * made.plan_s,
        "path": np.round(made.nodes, 3).tolist(),
        "t": np.round(made.times, 4).tolist(),
        "yaw": np.round(made.headings, 3).tolist(),
    }


def _order(looked: Exploration, scene: Scene) -> tuple[np.ndarray[Any, Any], bool]:
    if looked.kind == "tree":
        return looked.lines, True
    return looked.cells[:, 1].astype(np.int64) * scene.grid.width + looked.cells[:, 0], False


def race_of(scenario: Scenario, question: Mapping[str, Any], look: Look) -> Race:
    """The race that a question asks for, for a film.

    Raises
    ------
    LampyrisError : as :func:`entrants` and :func:`lampyris.races.race.race`.
    """
    planners = [
        (label, registry.make(name, settings)) for label, name, settings in entrants(scenario, question)
    ]
    law: Any = speed_law(scenario.law, scenario.law_settings)
    return race(scene_at(scenario.scene, 0), planners, law, seed=scenario.seed, look=look)
