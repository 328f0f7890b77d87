"""Compared: several planners and speed laws in the same worlds, reported as in a study."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from lampyris._core.scalars import MAX_SEED
from lampyris.app.engine.cache import place_facts
from lampyris.app.engine.frames import json_frame
from lampyris.app.engine.simulation import begin, ending, finish, header, watch
from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.scenario.scenario import Scenario
from lampyris.kernels._jit import compiled_only
from lampyris.model.trace import Trace
from lampyris.report.data.measures import trace_metrics
from lampyris.report.data.serialize import robot_record
from lampyris.study.analysis.best import FEWEST, best
from lampyris.study.analysis.runs import Runs, entrants_of, runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.design.config import law_config, planner_config
from lampyris.study.design.study import Config, Study, StudyMap, StudyTraffic, World

MOST_CONFIGS: Final = 16
MOST_SEEDS: Final = 1000
_KEYS: Final = ("name", "settings", "label")


@dataclass(frozen=True, eq=False)
class Comparison:
    """Who meets in which world.

    Parameters
    ----------
    scenario : the world; its own planner and law count only where no others are named.
    study : the same as a study of one query.
    """

    scenario: Scenario
    study: Study

    @property
    def entrants(self) -> list[tuple[str, Config, Config]]:
        """Label, planner and law of each pair."""
        pairs = [(planner, law) for planner in self.study.planners for law in self.study.laws]
        return [(label, *pair) for label, pair in zip(entrants_of(self.study), pairs, strict=True)]


def comparison(scenario: Scenario, request: Mapping[str, Any]) -> Comparison:
    """Who meets, from plain data.

    Parameters
    ----------
    request : ``planners`` and ``laws``: lists of names or of {name, settings, label}; absent or empty: the
        scenario's own. ``seeds``: how many, from the scenario's own on, or a list; absent: 1.

    Raises
    ------
    LampyrisError : what is wrong with them, with its JSON pointer.
    """
    own_planner = Config(scenario.planner, scenario.settings)
    own_law = Config(scenario.law, scenario.law_settings)
    planners = _configs(request.get("planners"), "planners", own_planner, planner_config)
    laws = _configs(request.get("laws"), "laws", own_law, law_config)
    scene = scenario.scene
    place = StudyMap(scene.grid.name or "map", scene.grid, map_hash(scene.grid))
    study = Study(
        name=scenario.name or "comparison",
        kind="simulate",
        worlds=(World(place, scene.start, scene.goal),),
        planners=planners,
        laws=laws,
        traffic_cases=(StudyTraffic(),),
        seeds=_seeds(request.get("seeds"), scenario.seed),
        moves=scene.moves.name,
        robot=robot_record(scene),
        ticks=scenario.ticks,
        patience=scenario.patience,
        root=scenario.seed,
    )
    if len(set(entrants_of(study))) < len(entrants_of(study)):
        raise FileError("LABEL", "two of one label", where="planners", allowed="a label of its own for each")
    return Comparison(scenario, study)


def _configs(
    given: Any, key: str, own: Config, make: Callable[[str, Mapping[str, Any], str], Config]
) -> tuple[Config, ...]:
    if given is None or given == []:
        return (make(own.name, own.settings, ""),)
    if not isinstance(given, list):
        raise FileError("TYPE", f"{key}", where=key, allowed="a list")
    if len(given) > MOST_CONFIGS:
        raise LimitError("LIMIT", f"{len(given)} {key}", where=key, allowed=f"at most {MOST_CONFIGS}")
    made = []
    for k, one in enumerate(given):
        table = {"name": one} if isinstance(one, str) else one
        if not isinstance(table, dict) or set(table) - set(_KEYS):
            raise FileError("KEY", f"{one!r:.60}", where=f"{key}: /{k}", allowed=", ".join(_KEYS))
        name, settings, label = table.get("name"), table.get("settings") or {}, table.get("label") or ""
        if not (isinstance(name, str) and isinstance(settings, dict) and isinstance(label, str)):
            raise FileError("TYPE", f"{one!r:.60}", where=f"{key}: /{k}", allowed="text, a table, text")
        if len(label) > 64 or not label.isprintable():
            raise FileError("TEXT", f"{label!r:.60}", where=f"{key}: /{k}/label", allowed="64 characters")
        try:
            made.append(make(name, settings, label))
        except LampyrisError as fault:
            fault.where = f"{key}: /{k}"
            raise
    return tuple(made)


def _seeds(given: Any, first: int) -> tuple[int, ...]:
    listed = given if isinstance(given, list) else None
    many = len(listed) if listed is not None else 1 if given is None else given
    if type(many) is not int or not 1 <= many <= MOST_SEEDS:
        raise LimitError("SEEDS", f"{given!r:.40}", where="seeds", allowed=f"1 to {MOST_SEEDS}, or a list")
    if listed is None:
        return tuple(range(first, first + many))
    if not all(type(seed) is int and 0 <= seed <= MAX_SEED for seed in listed) or len(set(listed)) < many:
        raise LimitError("SEEDS", f"{given!r:.40}", where="seeds", allowed="whole numbers, each once")
    return tuple(listed)


class ComparisonResults:
    """What came of the runs so far."""

    def __init__(self, compared: Comparison) -> None:
        self.compared = compared
        self._records: list[tuple[int, str, str, Mapping[str, Any]]] = []

    def add(self, seed: int, entrant: int, ending: str, code: str, numbers: Mapping[str, Any]) -> None:
        """One more."""
        many = len(self.compared.entrants)
        self._records.append((seed * many + entrant, ending, code, numbers))

    def __len__(self) -> int:
        """How many there are."""
        return len(self._records)

    def runs(self) -> Runs:
        """As a study has them."""
        return runs_of(self.compared.study, self._records)


def compare(
    compared: Comparison, look: Callable[[], None], job: Any, results: ComparisonResults
) -> Iterator[bytes]:
    """Of the first seed ``H T* E* Z`` for each entrant, of the others ``Z`` alone; then ``S``:
    a study's summary, with who is ``best`` by each measure.

    Before its first run each entrant plans once for nobody, and all run in compiled form, so that the times
    of a first comparison and of the next ones agree. What is loaded or compiled is in no time of planning.
    An entrant that refuses the question has the outcome ``refused``, and the others go on.
    """
    with compiled_only():
        for s, seed in enumerate(compared.study.seeds):
            for k, (label, planner, law) in enumerate(compared.entrants):
                head = {"job": job, "label": label, "planner": planner.name, "law": law.name, "seed": seed}
                yield from _one(compared.scenario, (planner, law), head, look, results, (s, k))
    runs = results.runs()
    tops = {name: one._asdict() for name, one in best(runs).items()}
    request = summarise(runs, timing=True).as_json()
    yield json_frame("S", {**request, "best": tops, "fewest": FEWEST})


def _one(
    world: Scenario,
    config_pair: tuple[Config, Config],
    head: Mapping[str, Any],
    look: Callable[[], None],
    results: ComparisonResults,
    at: tuple[int, int],
) -> Iterator[bytes]:
    planner, law = config_pair
    scenario = replace(
        world, planner=planner.name, settings=planner.settings, law=law.name, law_settings=law.settings,
        seed=head["seed"],
    )  # fmt: skip
    first = at[0] == 0
    begun = False
    try:
        if first:
            begin(scenario)
            look()
        run = begin(scenario)
        if first:
            begun = True
            yield json_frame("H", {**header(run, scenario), **head})
            yield from watch(run, look)
        while run.outcome is None:
            run.tick()
            look()
        trace = finish(run)
    except LampyrisError as fault:
        if fault.exit_code == 6:
            raise
        if first and not begun:
            yield json_frame("H", {**head, "units": "", "causes": [], "obstacle_specs": []})
        results.add(*at, "refused", fault.code, {})
        metrics = {"outcome": "refused", "found": False, "arrived": False}
        yield json_frame("Z", {**head, "outcome": "refused", "sentence": str(fault), "metrics": metrics})
        return
    numbers = {**_metrics(trace), "plan_s": trace.timing.get("planning_s")}
    results.add(*at, "done", "", numbers)
    end = ending(trace, head)
    if first:
        end["edits"] = [asdict(edit) for edit in trace.edits]
    yield json_frame("Z", end)


def _metrics(trace: Trace) -> dict[str, Any]:
    return trace_metrics(trace, place_facts(trace.scene))
