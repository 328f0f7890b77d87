"""``lampyris tune``: settings of a planner or speed law, tuned on the queries of a study.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import INTERRUPTED, Interrupted
from lampyris.cli.options import Force, Json
from lampyris.cli.text import plural, print_json, print_notes

if TYPE_CHECKING:
    from lampyris.study.analysis.compare import Interval
    from lampyris.tuning.tune import Trial, Tuned


def tune(
    study: Annotated[
        str,
        typer.Argument(metavar="STUDY", help="A study file (.yaml, .json), or the name of a bundled study."),
    ],
    trials: Annotated[
        int, typer.Option("--trials", metavar="N", help="Trials, the settings of the study among them.")
    ] = 50,
    planner: Annotated[
        str | None,
        typer.Option(
            "--planner", metavar="NAME", help="Which of the study's planners (default: its only one)."
        ),
    ] = None,
    law: Annotated[
        str | None,
        typer.Option(
            "--law",
            metavar="NAME",
            help="Tune this speed law of the study; --planner selects the planner of the paths.",
        ),
    ] = None,
    metric: Annotated[
        str | None,
        typer.Option(
            "--metric",
            metavar="NAME",
            help="Measure to improve, such as cost or expansions (default: cost; of laws time_s).",
        ),
    ] = None,
    range_: Annotated[
        list[str] | None,
        typer.Option(
            "--range",
            metavar="NAME[=LOW:HIGH]",
            help="Vary this setting, within this range (default: all declared settings, around their values); "
            "NAME=WORD,WORD for words; repeatable.",
        ),
    ] = None,
    held_out_share: Annotated[
        float,
        typer.Option("--held-out-share", metavar="SHARE", help="Share of the queries kept for the report."),
    ] = 0.3,
    seed: Annotated[
        int,
        typer.Option(
            "--seed",
            metavar="N",
            help="Seed of the held-out queries and of the trials: same seed, same bytes.",
        ),
    ] = 0,
    store: Annotated[
        Path | None,
        typer.Option(
            "--store", metavar="FILE", help="Where runs are stored (default: NAME.PLANNER[.LAW].study.db)."
        ),
    ] = None,
    workers: Annotated[int, typer.Option("--workers", metavar="N", help="Number of worker processes.")] = 1,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="The study with the tuned settings (.yaml; default: STUDY-tuned.yaml).",
        ),
    ] = None,
    json_: Json = False,
    force: Force = False,
) -> None:
    """Tune a planner or a speed law on the queries of a study by Optuna, and report on queries that were held out."""
    from lampyris.study.design.study_file import load_study, plain_study
    from lampyris.tuning.objective import USUAL
    from lampyris.tuning.settings_file import demand_folder, write_settings
    from lampyris.tuning.tune import tune as search

    target = Path(f"{study.removesuffix('.yaml').removesuffix('.json')}-tuned.yaml") if out is None else out
    outputs.check_outputs(force, scenario=target)
    asked = load_study(study)
    demand_folder(study, plain_study(study), target)
    print_notes(asked.notes)
    called = planner if planner is not None else asked.planners[0].called
    parts = (asked.name, called) if law is None else (asked.name, called, law)
    name = re.sub(r"[^\w.-]+", "-", ".".join(parts)).strip("-.")
    place = Path(f"{name}.study.db") if store is None else store

    def show(trial: Trial, best: Trial) -> None:
        if not json_:
            end = (
                f"pruned after {plural(trial.queries, 'query')}"
                if trial.pruned
                else f"{metric or USUAL['planner' if law is None else 'law']} {trial.value:.5g}"
            )
            print(
                f"trial {trial.number + 1} of {trials}: {end} (best {best.value:.5g})",
                file=sys.stderr,
                flush=True,
            )

    try:
        found = search(
            asked, place, trials=trials, planner=planner, law=law, metric=metric, ranges=range_ or [],
            held_out_share=held_out_share, seed=seed, workers=workers, progress=show,
        )  # fmt: skip
    except KeyboardInterrupt:
        words = shlex.join(["lampyris", *sys.argv[1:]])
        print(f"interrupted: finished runs are kept in {place}; continue with: {words}", file=sys.stderr)
        raise Interrupted(INTERRUPTED) from None
    write_settings(study, found, target)
    if json_:
        print_json({**_record(found, seed), "store": str(place), "file": str(target)})
    else:
        _print(found, target)


def _record(found: Tuned, seed: int) -> dict[str, Any]:
    """The result as JSON holds it."""
    return {
        found.kind: found.chosen.name,
        **({} if found.planner is None else {"planner": found.planner.name}),
        "metric": found.measure.name,
        "better": found.measure.better,
        "seed": seed,
        "ranges": {one.name: one.plain for one in found.ranges},
        "settings": dict(found.chosen.settings),
        "best": found.best.number,
        "trials": [
            {"number": t.number, "settings": dict(t.settings), "value": t.value, "queries": t.queries, "pruned": t.pruned}
            for t in found.trials
        ],
        "tuning_queries": found.queries,
        "held_out": {
            "queries": found.default.n,
            **{
                name: {"mean": one.value, "low": _known(one.low), "high": _known(one.high)}
                for name, one in (("default", found.default), ("tuned", found.tuned), ("difference", found.gained))
            },
            **_collisions(found),
        },
    }  # fmt: skip


def _collisions(found: Tuned) -> dict[str, Any]:
    if found.collisions is None:
        return {}
    before, after = found.collisions
    return {"collisions": {"default": before, "tuned": after}}


def _known(value: float) -> float | None:
    return value if value == value else None


def _print(found: Tuned, target: Path) -> None:
    """The result for people."""
    pruned = [one.pruned for one in found.trials].count(True)
    varied = {one.name: found.chosen.settings.get(one.name) for one in found.ranges}
    touched = (
        []
        if found.collisions is None
        else [("collisions a run", "before {:.4g}, tuned {:.4g}".format(*found.collisions))]
    )
    held = f"{found.default.n} held-out queries"
    text.facts(
        f"{found.chosen.name}: {found.measure.title}, {found.measure.better} is better",
        [
            ("trials", f"{len(found.trials)}, {pruned} of them pruned, on {plural(found.queries, 'query')}"),
            (
                "best trial",
                f"{found.best.number + 1}"
                + (" (the settings of the study)" if not found.best.number else ""),
            ),
            ("settings", ", ".join(f"{k}={v}" for k, v in varied.items())),
            (held, "with 95 % intervals over queries (BCa bootstrap)"),
            ("before", _said(found.default)),
            ("tuned", _said(found.tuned)),
            ("difference", _said(found.gained)),
            *touched,
        ],
    )
    print(f"wrote {target}")


def _said(one: Interval) -> str:
    return f"{one.value:.5g} [{one.low:.5g}, {one.high:.5g}]"
