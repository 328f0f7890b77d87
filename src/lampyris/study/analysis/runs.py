"""Runs: the results of a study as arrays, one place for each job: the same worlds stand side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.study.analysis.measures import AT_GOAL, SHARES, cost_of
from lampyris.study.design.study import Study

Cube: TypeAlias = NDArray[np.float64]
"""float64, (worlds, traffic cases, seeds, entrants); NaN where a run has no value."""
Words: TypeAlias = NDArray[np.object_]
"""Words, in the same places."""


@dataclass(frozen=True, slots=True, eq=False)
class Runs:
    """All runs of a study.

    Parameters
    ----------
    study : which.
    entrants : what a table calls each pair of planner and law, in the study's order.
    ending : of each run; empty where it has none yet.
    outcome : the word of the run's own ending, or the code of its error.
    notes : what was done otherwise than asked; empty where nothing was, and in stores of before they had it.
    improvements, cost_by_s : of plans of fleets, how the cost fell with the iterations and with CPU seconds; empty elsewhere.
    values : every metric that some run has a number of. ``found`` and ``arrived`` are 0 for runs that failed;
        what tells of a whole path is there for runs that came to the goal only.
    """

    study: Study
    entrants: tuple[str, ...]
    ending: Words
    outcome: Words
    notes: Words
    values: Mapping[str, Cube]
    improvements: Words
    cost_by_s: Words

    def has(self, name: str) -> bool:
        """Whether some run has a number of that name."""
        return name in self.values

    @property
    def of_poses(self) -> bool:
        """Whether some run is a plan of poses."""
        return self.has("cost_m")

    @property
    def cost(self) -> str:
        """The measure that is compared as the cost."""
        return cost_of(self.study.kind, self.of_poses)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Which runs came to the goal; in a study of plans, found a path."""
        name = "arrived" if self.has("arrived") else "found"
        none = np.zeros(self.ending.shape, dtype=np.bool_)
        return self.values[name] == 1.0 if self.has(name) else none

    def of_solved(self, name: str) -> Cube:
        """A metric of the runs that came to the goal; NaN elsewhere."""
        out: Cube = np.where(self.solved, self.values[name], np.nan)
        return out

    @property
    def asked(self) -> int:
        """Jobs of the study."""
        return int(self.ending.size)

    @property
    def known(self) -> int:
        """Jobs that have a result, of whatever ending."""
        return int(np.count_nonzero(self.ending != ""))


def runs_of(study: Study, records: Iterable[tuple[int, str, str, Mapping[str, Any]]]) -> Runs:
    """The runs of a study.

    Parameters
    ----------
    records : index of the job, ending, code of the error, and the metrics and timing by name. Each job at
        most once, in any order.
    """
    shape = (
        len(study.worlds), len(study.traffic_cases), len(study.seeds), len(study.planners) * len(study.laws),
    )  # fmt: skip
    size = len(study)
    ending, outcome, notes, improvements, cost_by_s = (np.full(size, "", dtype=object) for _ in range(5))
    values: dict[str, Cube] = {}
    for index, end, code, numbers in records:
        ending[index] = end
        outcome[index] = str(numbers.get("outcome") or code or end)
        notes[index] = str(numbers.get("notes") or "")
        improvements[index] = str(numbers.get("improvements") or "")
        cost_by_s[index] = str(numbers.get("cost_by_s") or "")
        for name, value in numbers.items():
            if isinstance(value, int | float) and np.isfinite(value):
                if name not in values:
                    values[name] = np.full(size, np.nan)
                values[name][index] = value
    for name in SHARES:
        if name in values:
            known = (ending != "") & np.isnan(values[name])
            values[name][known] = 0.0
    cubes = {name: values[name].reshape(shape) for name in sorted(values)}
    words = (ending, outcome, notes, improvements, cost_by_s)
    ends, outs, said, fell, fell_by_s = (some.reshape(shape) for some in words)
    runs = Runs(study, entrants_of(study), ends, outs, said, cubes, fell, fell_by_s)
    cubes.update({name: runs.of_solved(name) for name in cubes if name in AT_GOAL})
    return runs


def entrants_of(study: Study) -> tuple[str, ...]:
    """What tables call each pair of planner and law: by what there are several of."""
    many_planners, many_laws = len(study.planners) > 1, len(study.laws) > 1
    return tuple(
        f"{p.called}, {law.called}" if many_planners and many_laws else law.called if many_laws else p.called
        for p in study.planners
        for law in study.laws
    )
