"""``lampyris chain``: configurations of a planar chain from start to goal.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris.cli import text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.option_errors import check_choice
from lampyris.cli.options import Force, Json, Picture, Seed
from lampyris.cli.outputs import check_outputs, print_written
from lampyris.cli.progress import working
from lampyris.cli.text import print_json
from lampyris.errors import LimitError

if TYPE_CHECKING:
    from lampyris.model.chain.chain_plan import ChainPlan

PLANNERS = ("rrt-adaptive", "rrt", "rrt-connect")
"""Those of :mod:`lampyris.planning.chain.rrt`, which is imported when it is needed."""


def chain(
    scene: Annotated[
        str, typer.Argument(metavar="SCENE", help="A scene file (YAML), or open, tip, post or gap.")
    ],
    links: Annotated[
        int | None,
        typer.Option(
            "--links", metavar="N", help="Links of equal length of a bundled chain of 4 m (default: 4)."
        ),
    ] = None,
    planner: Annotated[
        str, typer.Option("--planner", metavar="|".join(PLANNERS), help="Which joints are sampled, and how.")
    ] = PLANNERS[0],
    samples: Annotated[
        int, typer.Option("--samples", metavar="N", min=1, max=1_000_000, help="Samples at most.")
    ] = 20_000,
    seconds: Annotated[
        float | None, typer.Option("--time-limit", metavar="S", help="Stop after so many seconds.")
    ] = None,
    seed: Seed = 0,
    json_: Json = False,
    picture: Picture = None,
    force: Force = False,
) -> None:
    """Plan the joints of a planar chain of links, such as a robot arm seen from above, among obstacles."""
    check_choice("PLANNER", "--planner", planner, PLANNERS)
    check_outputs(force, json=json_, picture=picture)
    from lampyris.chains import draw_chain, plan_chain
    from lampyris.cli.request import budget_of
    from lampyris.cli.verbs.chain.scenes import scene_of
    from lampyris.model.plan import Status
    from lampyris.planning.base import Budget

    limit = budget_of("--time-limit", seconds)
    asked = scene_of(scene, links)
    with working("planning", quiet=json_):
        plan = plan_chain(
            asked.grid, asked.chain, asked.start, asked.goal, planner, seed=seed,
            budget=Budget(expansions=samples, seconds=None if limit is None else limit.seconds),
        )  # fmt: skip
    if picture is not None:
        with working("drawing", quiet=json_):
            draw_chain(plan, picture)
    if json_:
        print_json(record_of(plan))
    else:
        print_plan(plan)
        print_written(picture)
    if plan.status is Status.LIMIT:
        raise typer.Exit(LimitError.exit_code)
    raise typer.Exit(0 if plan else NO_ANSWER)


def record_of(plan: ChainPlan) -> dict[str, Any]:
    """The plan as plain data, as docs/output.md has it."""
    from lampyris.report.data.serialize import grid_record

    arm = plan.chain
    rows = plan.configurations
    return {
        "map": grid_record(plan.grid),
        "status": plan.status.value,
        "sentence": plan.status.sentence,
        "planner": plan.planner,
        "seed": plan.seed,
        "chain": {
            "base": list(arm.base),
            "links": list(arm.links),
            "widths": list(arm.widths),
            "joint_limits": [list(one) for one in arm.joint_limits],
        },
        "start": plan.start.tolist(),
        "goal": plan.goal.tolist(),
        "configurations": None if rows is None else rows.tolist(),
        "turned": plan.turned,
        "released": list(plan.released),
        "samples": plan.samples,
        "checks": plan.checks,
        "nodes": plan.nodes,
        "timing": dict(plan.timing),
    }


def print_plan(plan: ChainPlan) -> None:
    """Print what was found."""
    text.line(plan.status.sentence, style="bold" if plan else "bold red")
    joints = f"{len(plan.released)} of {plan.chain.joints}"
    if plan.released and plan.planner == "rrt-adaptive":
        joints += f": {', '.join(str(k + 1) for k in plan.released)}"
    rows = [("planner", plan.planner), ("joints sampled", joints), ("samples", f"{plan.samples:,}")]
    rows += [("collision checks", f"{plan.checks:,}"), ("nodes of the trees", f"{plan.nodes:,}")]
    if plan.configurations is not None:
        rows.insert(0, ("configurations", f"{len(plan.configurations)}, {plan.turned:.4g} rad turned in all"))
    text.facts("", rows)
