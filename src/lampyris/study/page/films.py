"""Page films: a few runs of a study shown again, chosen by rule and not by taste."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lampyris.errors import LampyrisError, UsageError
from lampyris.model.drive import Drive
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import LifelongTrace
from lampyris.model.trace import Trace
from lampyris.report.film.drive_film import film_drive
from lampyris.report.film.fleet_drive_film import fleet_drive_film, lifelong_film
from lampyris.report.film.fleet_film import fleet_film
from lampyris.report.film.simulation_film import film
from lampyris.study.analysis.findings import Summary
from lampyris.study.analysis.measures import ALL
from lampyris.study.analysis.runs import Runs
from lampyris.study.design.serialize import packed_fleet
from lampyris.study.design.study import Job, Study
from lampyris.study.design.traffic_labels import traffic_words
from lampyris.study.execution.worker import TimeUp, run_job

MOST = 3
MAX_BYTES = 1_500_000
"""Of all films of a page; one that would go over it is left out, and said to be."""
SIDE = 360
"""Pixels of a film's longer side, as far as whole pixels a cell allow."""
_OF_FLEETS = ("throughput", "lateness_mean_s", "sum_of_costs")
"""By what films of fleets are chosen: the first that a study has."""
MAX_CELLS = 512 * 512
"""Cells of a map up to which films are drawn."""


class Chosen(NamedTuple):
    """A world, and who is shown in it."""

    world: int
    traffic: int
    seed: int
    entrants: tuple[int, ...]
    why: str


def choose(summary: Summary, runs: Runs) -> Chosen | None:
    """The world to be shown: in the last traffic case, where the reference and another differ most.

    Most is: one came to the goal and the other did not; else the greatest difference in time, ticks or cost.
    The first of equals. Film are the reference, that other, and the next in order; None in a study of plans of
    one robot. Of fleets throughput, lateness or the sum of costs are compared.
    """
    if summary.kind == "plan" or not runs.known:
        return None
    base, traffic = runs.entrants.index(summary.reference), len(runs.study.traffic_cases) - 1
    name = next((n for n in (*_OF_FLEETS, "time_s", "ticks", "cost") if runs.has(n)), None)
    best: tuple[float, int, int, int] | None = None
    solved = runs.solved[:, traffic]
    known = runs.ending[:, traffic] == "done"
    for w, s, e in np.ndindex(solved.shape):
        if e == base or not (known[w, s, e] and known[w, s, base]):
            continue
        size = 0.0
        if solved[w, s, e] != solved[w, s, base]:
            size = math.inf
        elif name is not None and solved[w, s, e]:
            size = abs(float(runs.values[name][w, traffic, s, e] - runs.values[name][w, traffic, s, base]))
        if best is None or size > best[0]:
            best = (size, w, s, e)
    if best is None:
        alone = np.argwhere(known[:, :, base])
        return (
            Chosen(int(alone[0, 0]), traffic, int(alone[0, 1]), (base,), "the first") if len(alone) else None
        )
    size, w, s, other = best
    rest = [e for e in range(len(runs.entrants)) if e not in (base, other) and known[w, s, e]]
    what = ALL[name].title if name in _OF_FLEETS else name
    why = "one arrives, the other does not" if size == math.inf else f"the greatest difference in {what}"
    return Chosen(w, traffic, s, (base, other, *rest[: MOST - 2]), why)


class Film(NamedTuple):
    """One run; without data where it would be too large or failed."""

    entrant: str
    outcome: str
    alt: str
    data: bytes | None


class Films(NamedTuple):
    """The films of a page, and which world they show."""

    words: str
    shown: list[Film]


def films(summary: Summary, runs: Runs) -> Films | None:
    """The films of a page with what they show; None where there is none."""
    chosen = choose(summary, runs)
    if chosen is None:
        return None
    study = runs.study
    world = study.worlds[chosen.world]
    if world.ground.grid.blocked.size > MAX_CELLS:
        return None
    shown, left = [], MAX_BYTES
    for entrant, job in zip(chosen.entrants, _jobs(runs, chosen), strict=True):
        data = _film(job, runs)
        if data is not None and len(data) > left:
            data = None
        left -= len(data or b"")
        name = runs.entrants[entrant]
        outcome = runs.outcome[chosen.world, chosen.traffic, chosen.seed, entrant]
        shown.append(Film(name, str(outcome), f"{name} on {world.ground.name}, {world.query}", data))
    where, seed = f"{world.ground.name}, {world.query}", f"seed {study.seeds[chosen.seed]}"
    if len(chosen.entrants) == 1:
        return Films(f"{where}, {seed}. Run again for this page.", shown)
    words = (
        f"{where}, {traffic_words(study.traffic_cases[chosen.traffic].label)}, {seed}. Of all worlds with this traffic: "
        f"{chosen.why}, {summary.reference} beside another. Run again for this page."
    )
    return Films(words, shown)


def _jobs(runs: Runs, chosen: Chosen) -> list[Job]:
    """The jobs of some entrants in one world, in their order."""
    shape = runs.ending.shape
    wanted = [
        int(np.ravel_multi_index((chosen.world, chosen.traffic, chosen.seed, e), shape))
        for e in chosen.entrants
    ]
    found = {job.index: job for job in runs.study.jobs() if job.index in wanted}
    return [found[k] for k in wanted]


def _film(job: Job, runs: Runs) -> bytes | None:
    """A run as a WebP; None if it cannot be run or drawn any more."""
    ground = runs.study.grounds[job.plain["map"]]
    try:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "film.webp"
            draw_run(job, runs.study, out, scale=max(1, min(64, SIDE // max(ground.grid.blocked.shape))))
            return out.read_bytes()
    except (LampyrisError, TimeUp):
        return None


def draw_run(job: Job, study: Study, out: Path, *, scale: int | None = None) -> None:
    """Do a run again and draw it as a film, WebP or GIF by the file's suffix.

    Parameters
    ----------
    job : of the study.
    scale : pixels a cell, of films that have such a setting; None: theirs.

    Raises
    ------
    UsageError : ``FILM``: nothing moves in it, such as a plan of one robot.
    TimeUp, LampyrisError : the run does not come to a result, or cannot be drawn.
    """
    fleets = {hash_: packed_fleet(one) for hash_, one in study.fleets.items()}
    ran = run_job(job.plain, study.grounds[job.plain["map"]].grid, fleets)
    noun = ran.noun
    if isinstance(noun, Trace):
        film(noun, out, scale=scale)
    elif isinstance(noun, Drive) and noun.curves:
        film_drive(noun, out, scale=scale)
    elif isinstance(noun, FleetPlan) and noun.paths and ran.fleet is not None:
        fleet_film(noun, ran.fleet, out, scale=scale)
    elif isinstance(noun, FleetTrace):
        fleet_drive_film(noun, out)
    elif isinstance(noun, LifelongTrace):
        lifelong_film(noun, out)
    else:
        raise UsageError(
            "FILM", "nothing moves in this run", allowed="runs of simulations, drives and fleets"
        )
