"""``lampyris plan``: a path and a speed for every cell of it.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import NO_ANSWER
from lampyris.cli.option_groups import (
    EndOptions,
    LawOptions,
    MapOptions,
    PlannerOptions,
    RobotOptions,
    RuleOptions,
    ViaOptions,
)
from lampyris.cli.options import Bag, Csv, Explain, Export, Force, Json, Layer, NoTiming, Picture, Save
from lampyris.cli.outputs import LAYERS, Outputs, print_written
from lampyris.cli.progress import working
from lampyris.cli.text import print_json, print_notes, word_counts
from lampyris.errors import LimitError

if TYPE_CHECKING:
    from lampyris.io.scenario.scenario import Scenario
    from lampyris.model.plan import MapModel, Plan
    from lampyris.model.profile import Profile
    from lampyris.model.scene import Scene
    from lampyris.planning.base import Budget


def plan(
    map_options: MapOptions,
    ends: EndOptions,
    via: ViaOptions,
    robot: RobotOptions,
    rules: RuleOptions,
    planning: PlannerOptions,
    law_options: LawOptions,
    explain: Explain = False,
    json_: Json = False,
    no_timing: NoTiming = False,
    picture: Picture = None,
    layer: Layer = "luciferin",
    csv: Csv = None,
    export: Export = None,
    bag: Bag = None,
    save: Save = None,
    force: Force = False,
    time_limit: Annotated[
        float | None,
        typer.Option(
            "--time-limit", metavar="S", help="Stop planning after this many seconds, with exit code 5."
        ),
    ] = None,
) -> None:
    """Plan a path with a speed at each cell.

    Corners are rounded within half a step, or are stops. The planners `lattice`, `hybrid-astar` and `pad` plan poses
    for a robot with a footprint and a heading (`--robot`, `--start-m X,Y,YAW`).
    """
    from lampyris.cli.request import Request, budget_of

    request = Request(map_options, ends, robot, rules, planning, law_options)
    out = Outputs(json_, not no_timing, csv, save, force, explain, picture, layer, export=export, bag=bag)
    out.check()
    budget = budget_of("--time-limit", time_limit)
    raise typer.Exit(plan_scenario(request.through(request.scenario(), via), out, budget))


def plan_scenario(scenario: Scenario, out: Outputs, budget: Budget | None = None) -> int:
    """Plan what a scenario says, write and print the result. Returns the exit code."""
    from lampyris import scenarios
    from lampyris.cli.request import scene_notes
    from lampyris.model.plan import Status
    from lampyris.motion.laws.node_table import nodes_of
    from lampyris.planning.registry import plans_poses
    from lampyris.report.data.serialize import plan_record

    scene = scenario.scene
    moved = () if plans_poses(scenario.planner) else scene_notes(scene)
    print_notes((*scenario.notes, *moved, *scenarios.without_effect(scenario)))
    with working(f"planning on {scene.grid.name or 'the map'}", quiet=out.json):
        record = out.explain or out.picture is not None
        done: Any = scenarios.run(scenario, record=record, budget=budget)
    found: Plan = done.plan
    profile: Profile | None = done.profile
    nodes = nodes_of(scene, found)
    if out.picture is not None:
        _draw(scenario, found, profile, out, out.picture)
    if out.csv is not None:
        if found.path is None or profile is None:
            print_notes(("no path, so no CSV was written",))
        else:
            from lampyris.report.data.csv import write_plan_csv

            with outputs.place(out.csv) as place:
                write_plan_csv(place, found, profile, scene.grid, nodes)
    out.write_ros(found, scene, profile)
    if out.save is not None:
        print_notes(scenarios.save_scenario(scenario, out.save))
    if out.json:
        if not out.explain:
            # Whether a picture was drawn must not change the answer.
            found = replace(found, jumps=())
        print_json(out.without_timing(plan_record(found, scene, profile, seed=scenario.seed, nodes=nodes)))
    else:
        with outputs.text_beside(out.csv):
            print_plan(found, scene, profile, explain=out.explain, name=scenario.name)
            print_written(out.picture, out.csv, out.export, out.bag, out.save)
    if found.status is Status.LIMIT:
        return LimitError.exit_code
    return 0 if found else NO_ANSWER


def _draw(scenario: Scenario, found: Plan, profile: Profile | None, out: Outputs, to: Path) -> None:
    from lampyris.planning.field.solve import solve_field
    from lampyris.report.pictures.plan_picture import draw_plan

    layer, settings, scene = out.layer or LAYERS[0], scenario.settings, scenario.scene
    if found.pose_path is not None:
        layer = "none"  # the field is that of a disc
    with working("drawing", quiet=out.json):
        # The field that the planner walked on, not the default one.
        shares = {k: settings[k] for k in ("rho", "gamma") if k in settings}
        gates = "close" if settings.get("gates") == "close" else "ignore"
        field = solve_field(scene, gates=gates, **shares) if layer != "none" else None
        draw_plan(scene.grid, found, field=field, profile=profile, scene=scene, layer=layer, out=to)


def print_plan(found: Plan, scene: Scene, profile: Profile | None, *, explain: bool, name: str = "") -> None:
    """Print a plan: the verdict first, then the numbers, then (on request) every iteration."""
    from lampyris.model.plan import Status
    from lampyris.planning.registry import plans_poses
    from lampyris.report.data.metrics import path_metrics
    from lampyris.report.data.serialize import STEP_WORDS, corners_record

    grid = scene.grid
    style = "green" if found else "red"
    text.line(found.sentence, style=f"bold {style}")
    rows = [("scenario", name)] if name else []
    rows += [
        ("map", f"{grid.name or '-'}, {grid.width} x {grid.height} cells of {grid.resolution:g} m"),
        ("from, to", f"{scene.start} to {scene.goal}"),
        ("planner", f"{found.planner}, {_motion(found, scene)}"),
    ]
    if found.pose_path is not None:
        poses = found.pose_path
        rows += [
            ("length", f"{poses.length_m:.4g} m, {poses.reversals} reversals, {len(poses.poses)} poses"),
            ("cost", f"{poses.cost_m:.6g} m; at most {poses.bound:.4g} times the lower bound"),
        ]
    elif found.path is not None and found.steps is not None:
        counts = ", ".join(f"{n} {w}" for n, w in zip(found.steps, STEP_WORDS, strict=False))
        m = path_metrics(found.path, grid)
        compared = "best not known, no time was left to find it"
        if found.optimal_cost is not None:
            compared = f"best {found.optimal_cost:.6g}, gap {found.gap or 0.0:.2%}"
        rows += [
            ("cost", f"{found.cost:.6g} cells ({counts}); {compared}"),
            ("length", f"{m['length_m']:.4g} m, {m['turns']} turns, {len(found.path.cells)} cells"),
        ]
        if found.sum_cost_to_go is not None:
            rows.append(("sum of cost-to-go", f"{found.sum_cost_to_go:.6g}"))
        if found.via:
            rows.append(("via", _via(found)))
    if found.time_lower_bound is not None:
        words = "no path of these moves is faster under the planner's caps"
        rows.append(("least time", f"{found.time_lower_bound:.6g} s: {words}"))
    rows += [("note", note) for note in found.notes]
    waiting = ""
    if found.schedule is not None:
        ticks = found.schedule.tolist()
        waits = ticks[-1] - ticks[0] - len(ticks) + 1
        rows.append(("schedule", f"on the goal at tick {ticks[-1]}, {waits} ticks of waiting"))
        waiting = ", without the waiting" if waits else ""
    if found.pose_path is not None and found.pose_path.times is not None:
        times = found.pose_path.times
        stands = float((times[:, 1] - times[:, 0]).sum())
        rows.append(("arrival", f"after {times[-1, 0]:.4g} s, of which the robot waits {stands:.4g} s"))
        waiting = " by the speed law alone, without waits"
    if found.any_angle_length is not None and found.waypoints is not None:
        words = f"{found.any_angle_length:.6g} cells in {len(found.waypoints) - 1} straight lines"
        rows.append(("any angle", words))
    if found.map_model is not None:
        rows.append(("map model", _model(found.map_model)))
    rows.append(("iterations", f"{found.iterations}; {found.expansions} expansions"))
    on_path = text.first_few([g.cell for g in found.gates_on_path]) or "none"
    unjudged = found.status is Status.LIMIT or (found.path is not None and found.optimal_cost is None)
    if not plans_poses(found.planner) and (found.gates_in_map or not unjudged):
        rows.append(("gates", f"on the path: {on_path}; in the map: {len(found.gates_in_map)}"))
    if found.gates_met:
        rows.append(("replanned at", text.first_few(found.gates_met)))
    if profile is not None:
        mean = f"mean {profile.mean:.4g} {profile.units} ({profile.law} law)"
        rows.append(("speed", f"{mean}; {_duration(profile)} in all{waiting}"))
        corners = corners_record(found, scene, profile)
        if corners is not None:
            rounded = corners["turns"] - corners["stops"]
            words = f"{rounded} rounded within half a step, {corners['stops']} stops to turn"
            rows.append(("corners", words))
        rows.append(("limited by", word_counts(profile.cause)))
    seconds = found.timing.get("total_s")
    if seconds is not None:
        loaded = found.timing.get("loading_s", 0.0)
        once = f", loading compiled code {1000 * loaded:.1f} ms" if loaded >= 1e-4 else ""
        planning = f"planning {1000 * found.timing['plan_s']:.1f} ms"
        rows.append(("time", f"{1000 * seconds:.1f} ms, of which {planning}{once}"))
    text.facts("", rows)
    if explain:
        _explain(found, scene, profile)


def _via(found: Plan) -> str:
    """Via points in order, and how good the order is."""
    words = text.first_few(found.via)
    if found.via_lower_bound is None:
        return f"{words}, as given"
    if found.optimal_cost is not None and found.optimal_cost <= found.via_lower_bound:
        return f"{words}, in the best order"
    return f"{words}; no order has a path below {found.via_lower_bound:.6g} cells"


def _motion(found: Plan, scene: Scene) -> str:
    """How the robot moves from state to state."""
    from lampyris.planning.registry import plans_poses

    return f"{scene.robot.drive} drive" if plans_poses(found.planner) else f"{scene.moves.name} moves"


def _explain(found: Plan, scene: Scene, profile: Profile | None) -> None:
    from lampyris.motion.laws.node_table import node_table
    from lampyris.report.data.adgso_tables import COLUMNS, jump_tables

    if found.rounds:
        _explain_rounds(found)
    for jump in jump_tables(found):
        text.line(jump.title, style="bold")
        right = [COLUMNS[k] for k in (0, 2, 3)]
        text.table("", COLUMNS, jump.rows, right=right, bold=jump.chosen, boxed=True)
        text.line(jump.note)
    if profile is not None and found.path is not None and found.pose_path is None:
        columns = (
            "node", "cell", "s", "ring 1", "ring 2", "obstacle velocity", "angle", "angle velocity",
            f"v ({profile.units})", "t", "limited by",
        )  # fmt: skip
        table = node_table(scene, found)
        numbers = (profile.s, *table, profile.v, profile.t)
        rows = [
            (str(k), f"({x}, {y})", *(_number(of[k]) for of in numbers), profile.cause[k])
            for k, (x, y) in enumerate(found.path.cells)
        ]
        right = [name for name in columns if name not in ("cell", "limited by")]
        text.table("speed at each node", columns, rows, right=right, boxed=True)


def _number(value: float) -> str:
    return f"{value:.4g}" if value == value else "-"


def _explain_rounds(found: Plan) -> None:
    """The rounds of planning with adaptive dimensionality, a row each."""
    columns = ("round", "spheres", "planned (m)", "tracked (m)", "at least (m)", "cells", "poses", "tracking")
    rows = [
        (
            str(k), str(len(one.spheres)), *(
                "-" if cost is None else f"{cost:.4g}" for cost in (one.planned_m, one.tracked_m, one.lower_bound_m)
            ),
            str(one.low_expansions), str(one.high_expansions), str(one.tracking_expansions),
        )
        for k, one in enumerate(found.rounds, 1)
    ]  # fmt: skip
    text.table("rounds, with the states that they expanded", columns, rows, right=columns, boxed=True)


def _duration(profile: Profile) -> str:
    return f"{profile.duration:.4g} {'s' if profile.metric else 'transfers'}"


def _model(model: MapModel) -> str:
    """What the model of the map proves, and how large it is."""
    words = [f"{name} {count:,}" for name, count in model.counts.items()]
    if model.bound is not None:
        words.insert(0, f"no lines are shorter than {model.bound:.6g} cells")
    if model.clearance is not None:
        words.insert(0, f"least clearance {model.clearance:.4g} cells, no path has more")
    if model.ridge_clearance is not None:
        words.insert(1, f"{model.ridge_clearance:.4g} between the branchings of ridges")
    return "; ".join(words)
