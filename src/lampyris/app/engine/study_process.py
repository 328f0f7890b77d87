"""Studying: a study of what is compared in the page, run in a process of its own.

``python -m lampyris.app.engine.study_process FOLDER`` reads one line of JSON (the question, as an engine gets it) from
its standard input, and writes lines of JSON: how far it is, and at last how it ended. The store and the
report are in the folder. When its input ends, nobody waits for it any more, and it ends too.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from lampyris._core.system import limit_memory, lower_priority
from lampyris.app.engine.frames import fault_of
from lampyris.errors import InputError, InternalFault, LampyrisError, LimitError
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, ObstacleSpec, Patrol, RandomWalk
from lampyris.planning import registry
from lampyris.report.data.serialize import robot_record
from lampyris.study.design.study import Study

REPORT: Final = "report.html"
MOST_QUERIES: Final = 500
MOST_SEEDS: Final = 1000
MOST_RUNS: Final = 200_000
MEMORY: Final = 4 * 2**30
"""Bytes of address space beyond what is mapped at first. Studies are meant to be long: no limit of time."""


def study_data(scenario: Scenario, request: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The study file of a comparison, and what a person should know of it.

    Parameters
    ----------
    request : ``planners`` and ``laws`` as for a comparison, ``seeds`` of each query and ``queries``, the
        scenario's own among them. With a planner of poses the study is one of drives in continuous time.

    Raises
    ------
    InputError : what no study can hold: recorded obstacles, edits while it runs.
    """
    scene = scenario.scene
    traffic, notes = _traffic(scene)
    own_planner = {"name": scenario.planner, "settings": dict(scenario.settings)}
    own_law = {"name": scenario.law, "settings": dict(scenario.law_settings)}
    seeds = _whole(request, "seeds", MOST_SEEDS)
    many = _whole(request, "queries", MOST_QUERIES)
    planners = request.get("planners") or [own_planner]
    names = {one if isinstance(one, str) else one.get("name") for one in planners}
    poses = bool(names & set(registry.pose_names()))
    place = {"rows": ["."], "name": (scene.grid.name or "map")[:64]}
    ends = {
        what: list(cell) if pose is None or not poses else {"pose": list(pose)}
        for what, cell, pose in (
            ("start", scene.start, scene.start_pose),
            ("goal", scene.goal, scene.goal_pose),
        )
    }
    maps: list[dict[str, Any]] = [{**place, "queries": [ends]}]
    if many > 1:
        least = max(scene.grid.width, scene.grid.height) / 4
        headings = {"headings": True} if poses else {}
        maps.append({**place, "queries": {"random": many - 1, "least": least, **headings}})
    in_ticks = {"ticks": scenario.ticks, "patience": scenario.patience}
    return {
        "version": 1,
        "name": scenario.name or f"{place['name']} compared"[:64],
        "about": "Sent from the app.",
        "kind": "drive" if poses else "simulate",
        "moves": scene.moves.name,
        "robot": _robot(scene),
        "maps": maps,
        "planners": planners,
        "laws": request.get("laws") or [own_law],
        "traffic": [traffic],
        "seeds": seeds,
        "seed": scenario.seed,
        **({"drive": dict(scenario.drive or {})} if poses else in_ticks),
    }, notes


def _robot(scene: Scene) -> dict[str, Any]:
    """The robot as a study file has it: with a footprint or a radius."""
    record: dict[str, Any] = {key: value for key, value in robot_record(scene).items() if value is not None}
    if scene.robot.footprint is not None:
        record["footprint"] = [list(vertex) for vertex in scene.robot.footprint]
        del record["radius"]
    return record


def _whole(request: Mapping[str, Any], key: str, most: int) -> int:
    value = request.get(key, 1)
    if type(value) is not int or not 1 <= value <= most:
        raise LimitError(key.upper(), f"{value!r:.40}", where=key, allowed=f"a whole number, 1 to {most:,}")
    return value


def _traffic(scene: Scene) -> tuple[Any, list[str]]:
    """The obstacles as a study draws them again for each query and seed."""
    if getattr(scene, "edits", ()):
        raise InputError(
            "EDITS", "walls that come and go during a run", where="scenario: /edits",
            allowed="none in a study", todo="take them out, or make them at tick 0",
        )  # fmt: skip
    some = [one for one in scene.traffic if getattr(one, "count", 1)]
    if not some:
        return "none", []
    if not all(isinstance(one, RandomWalk | Crossing | Patrol) for one in some):
        raise InputError(
            "TRAFFIC", "recorded obstacles", where="scenario: /obstacles",
            allowed="random walkers, patrols and crossing ones, which a study draws itself",
        )  # fmt: skip
    kinds = sorted({_kind(one) for one in some})
    rates = {one.rate for one in some if isinstance(one, RandomWalk)}
    radii = sorted({float(getattr(one, "radius", 0.0)) for one in some})
    traffic: dict[str, Any] = {
        "kind": kinds[0] if len(kinds) == 1 else "mixed",
        "count": sum(getattr(one, "count", 1) for one in some),
        "radius": radii[-1],
    }
    outlines = {getattr(one, "footprint", None) for one in some}
    if len(outlines) == 1 and None not in outlines:
        traffic["footprint"] = [list(vertex) for vertex in next(iter(outlines)) or ()]
        del traffic["radius"]
    if len(rates) == 1 and kinds[0] != "patrol" and traffic["kind"] in ("random-walk", "mixed"):
        traffic["rate"] = next(iter(rates))
    notes = []
    if len(kinds) > 1:
        notes.append("The study has as many obstacles, a third of each kind.")
    if len(radii) > 1:
        notes.append(f"All obstacles of the study have the largest radius, {radii[-1]:g} m.")
    if len(outlines) > 1:
        notes.append("The study has discs in place of the obstacles' different outlines.")
    if any(isinstance(one, RandomWalk) and one.starts for one in some):
        notes.append("The study draws where its walkers begin, also those that the map has drawn.")
    if "patrol" in kinds:
        notes.append("The study draws the waypoints of its patrols itself.")
    return traffic, notes


def _kind(one: ObstacleSpec) -> str:
    return {RandomWalk: "random-walk", Crossing: "crossing"}.get(type(one), "patrol")


def study_of_question(question: Mapping[str, Any]) -> tuple[Study, list[str]]:
    """The study of a question.

    Raises
    ------
    LampyrisError : what is wrong with it.
    """
    from lampyris.app.engine.parse import scenario_of_request
    from lampyris.study.design.study_file import study_from

    scenario = scenario_of_request(question)
    data, notes = study_data(scenario, question)
    made = study_from(data, MapDocument(scenario.scene.grid))
    if len(made) > MOST_RUNS:
        raise LimitError(
            "STUDY_SIZE", f"{len(made):,} runs", where="study", allowed=f"at most {MOST_RUNS:,}",
            todo="take fewer seeds or starts and goals, or use the command line",
        )  # fmt: skip
    return made, notes


# ---- the process itself --------------------


def main() -> None:
    """Run one study."""
    limit_memory(MEMORY)
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def tell(**record: Any) -> None:
        out.write(json.dumps(record, allow_nan=False) + "\n")
        out.flush()

    try:
        question = json.loads(sys.stdin.buffer.readline())
        threading.Thread(target=_until_nobody_waits, daemon=True).start()
        lower_priority(5)  # what the page asks for goes first
        _run(question, Path(sys.argv[1]), tell)
    except LampyrisError as fault:
        tell(state="failed", error=fault_of(fault))
    except MemoryError:
        tell(
            state="failed",
            error=fault_of(LimitError("MEMORY", "this study needs more memory than it may have")),
        )
    except Exception as fault:
        tell(state="failed", error=fault_of(InternalFault("STUDY", f"{type(fault).__name__}: {fault}"[:500])))


def _until_nobody_waits() -> None:
    while sys.stdin.buffer.read(4096):
        pass
    os._exit(0)


def _run(question: Mapping[str, Any], folder: Path, tell: Any) -> None:
    from lampyris.study.analysis.table import table_of
    from lampyris.study.design.row import Row
    from lampyris.study.execution import run as running
    from lampyris.study.page.page import write_page
    from lampyris.study.store.store import open_for

    study, notes = study_of_question(question)
    tell(state="running", done=0, total=len(study), notes=notes)
    store = open_for(folder / "study.db", study)
    try:

        def keep(rows: Sequence[Row]) -> None:
            store.add(rows)

        def progress(now: Any) -> None:
            tell(state="running", done=now.done, total=now.total, failed=now.failed, left_s=now.seconds_left)

        running.run(study, keep, done=store.keys(), progress=progress)
        tell(state="writing the report", done=len(store), total=len(study))
        table = table_of(study, store.scan())
        summary = write_page(folder / REPORT, study, table).as_json()
        tell(
            state="done",
            done=len(store),
            total=len(study),
            report=True,
            results=_results(summary, study, table),
        )
    finally:
        store.close()


def _results(summary: Mapping[str, Any], study: Study, table: Any) -> dict[str, Any]:
    """What the page shows of a study itself: the entrants' numbers over all places, and who is best."""
    from lampyris.study.analysis.best import best
    from lampyris.study.analysis.runs import runs_of

    entries = [
        {"entrant": one["entrant"], "own": one["own"]} for one in summary["entries"] if one["place"] == ""
    ]
    tops = best(runs_of(study, table.records()))
    return {"entries": entries, "best": {name: one._asdict() for name, one in tops.items()}}


if __name__ == "__main__":
    main()
