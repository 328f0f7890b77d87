"""Studies of robots with a shape and a heading: queries, runs, measures, pages."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_samples import planner, rows_of, study_of
from pose_samples import CAR, GOAL, NONE, OUTLINE, PLANNERS, START, hall, posed

import lampyris
from lampyris.errors import LampyrisError
from lampyris.model.drive import Drive
from lampyris.model.path import PosePath
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning.lattice.standing import Standing
from lampyris.referee.geometry.footprint import overlapped, placed
from lampyris.report.data.pose_measures import pose_measures
from lampyris.study.analysis.export import write_csv
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.design.serialize import study_of as from_plain
from lampyris.study.design.serialize import study_plain
from lampyris.study.design.study import Study, StudyTraffic
from lampyris.study.execution.worker import run_job
from lampyris.study.front import run_study
from lampyris.study.page.page import page_of
from lampyris.study.store.store import Store

ROBOT = "robot: {rectangle: [0.9, 0.5], drive: differential}\n"
MAP = "maps: [{bundled: guide, resolution: 0.5, queries: %s}]\n"


def load(tmp_path: Path, text: str) -> Study:
    file = tmp_path / "s.yaml"
    file.write_text(f"version: 1\n{text}")
    return lampyris.load_study(file)


def drawn(tmp_path: Path, many: int, planners: str = "[lattice]", more: str = ", headings: true") -> Study:
    queries = f"{{random: {many}, least: 5{more}}}"
    return load(tmp_path, ROBOT + MAP % queries + f"planners: {planners}\n")


# ---- queries --------------------


def test_headings_are_drawn_where_the_footprint_stands(tmp_path: Path) -> None:
    study = drawn(tmp_path, 40)
    robot = lampyris.Robot(**study.robot)
    outline, narrow = np.array(robot.footprint), 0
    for world in study.worlds:
        grid = world.ground.grid
        for pose, cell in ((world.start_pose, world.start), (world.goal_pose, world.goal)):
            assert pose is not None
            assert grid.to_cell(*pose[:2]) == cell
            assert pose[:2] == tuple(grid.to_metres(cell).tolist())
            eighth = pose[2] / (math.pi / 4)
            assert abs(eighth - round(eighth)) < 1e-12
            x, y = cell
            assert overlapped(placed(outline / grid.resolution, x, y, pose[2]), grid.blocked) is None
            narrow += not Standing(grid, replace(robot, footprint=None, radius=robot.radius)).at(pose)
    assert narrow  # some where the circle around the robot does not fit
    assert len({w.start_pose[2] for w in study.worlds if w.start_pose}) == 8


def test_draws_are_stable(tmp_path: Path) -> None:
    few, many = drawn(tmp_path, 5), drawn(tmp_path, 40)
    assert [w.query for w in few.worlds] == [w.query for w in many.worlds[:5]]
    both = drawn(tmp_path, 5, "[astar, hybrid-astar]")
    assert [w.query for w in both.worlds] == [w.query for w in few.worlds]
    # Without headings whoever plans is asked the same.
    cells = drawn(tmp_path, 9, "[astar]", "")
    poses = drawn(tmp_path, 9, "[astar, lattice]", "")
    assert [w.query for w in cells.worlds] == [w.query for w in poses.worlds]
    assert all(not w.poses for w in poses.worlds)


def test_ends_of_files_keep_their_headings(tmp_path: Path) -> None:
    queries = "[{start: {pose: [4.25, 5.25, 7.0]}, goal: {cell: [40, 40], yaw: -3.0}}, {start: [8, 8], goal: {m: [20.1, 4.6]}}]"
    first, second = load(
        tmp_path, ROBOT + (MAP % queries).replace("guide", "env-3") + "planners: [lattice]\n"
    ).worlds
    assert first.start_pose == (4.25, 5.25, pytest.approx(7.0 - 2 * math.pi))
    assert first.goal_pose == (*first.ground.grid.to_metres((40, 40)).tolist(), -3.0)
    assert (second.start_pose, second.goal_pose) == (None, None)
    assert first.query == "(4.25 m, 5.25 m, 41.07 deg) to (20.25 m, 4.75 m, -171.9 deg)"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("kind: simulate\nplanners: [astar, lattice]\n", ("PLANNER", "5:19", "kind simulate", "kind: drive")),
        ("planners: [pad]\ntraffic: [{kind: patrol, count: 1}]\n", ("PLANNER", "kind: plan", "kind: drive")),
        ("planners: [{name: lattice, settings: {primitives: a.json}}]\n", ("SETTING", "primitives", "content of files")),
    ],
)  # fmt: skip
def test_what_a_study_of_poses_cannot_do(tmp_path: Path, text: str, words: tuple[str, ...]) -> None:
    with pytest.raises(LampyrisError) as caught:
        load(tmp_path, ROBOT + MAP % "{random: 1}" + text)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_headings_need_a_planner_of_poses_and_room(tmp_path: Path) -> None:
    with pytest.raises(LampyrisError, match="without a planner of poses"):
        drawn(tmp_path, 2, "[astar]")
    grid = hall()
    rows = ["".join(".#"[int(b)] for b in row) for row in grid.blocked]
    beside = (
        f"maps: [{{rows: {json.dumps(rows)}, name: h, resolution: 0.25, queries: %s}}]\nplanners: [lattice]\n"
    )
    along = beside % "[{start: {cell: [12, 4], yaw: 1.5708}, goal: [20, 20]}]"
    across = beside % "[{start: {cell: [12, 4], yaw: 0.0}, goal: [20, 20]}]"
    assert len(load(tmp_path, ROBOT + along).worlds) == 1
    with pytest.raises(LampyrisError, match=r"START_OCCUPIED.*footprint touches no wall"):
        load(tmp_path, ROBOT + across)


def test_standing_agrees_with_the_referee() -> None:
    rng, grid = np.random.default_rng(4), hall()
    robot = lampyris.Robot(footprint=OUTLINE)
    standing, seen = Standing(grid, robot), [0, 0]
    for _ in range(400):
        x, y, yaw = (rng.random(3) * (27, 23, 7)).tolist()
        px, py = grid.frame.to_metres(np.array([[x, y]]))[0].tolist()
        free = overlapped(placed(np.array(OUTLINE) / 0.25, x, y, yaw), grid.blocked) is None
        assert standing.at((px, py, yaw)) == free
        seen[free] += 1
    assert min(seen) > 20


# ---- jobs --------------------


def test_keys_of_cells_are_what_they_were() -> None:
    """Poses are in the plain form where they are given, and nowhere else."""
    cells, poses = study_of("plan"), posed()
    (job,), (other,) = cells.jobs(), poses.jobs()
    assert not {"start_pose", "goal_pose"} & set(job.plain)
    assert not {"start_pose", "goal_pose"} & set(study_plain(cells)["worlds"][0])
    told = [other.plain[name] for name in ("start_pose", "goal_pose", "origin")]
    assert told == [list(START), list(GOAL), [0.0, 0.0, 0.0]]
    turned = posed(start=(*START[:2], 0.0))
    assert next(turned.jobs()).key != other.key
    assert next(turned.jobs()).plain["seed"] != other.plain["seed"]


def test_a_study_made_plain_is_the_same() -> None:
    study = posed(planners=PLANNERS)
    plain = json.loads(json.dumps(study_plain(study)))
    grids = {name: ground.grid for name, ground in study.grounds.items()}
    assert [job.key for job in from_plain(plain, grids).jobs()] == [job.key for job in study.jobs()]
    moved = {name: replace(grid, origin=(1.0, 0.0, 0.0)) for name, grid in grids.items()}
    with pytest.raises(LampyrisError, match="STUDY_PLAIN"):
        from_plain(plain, moved)
    for wrong in ([1.0, 1.0], [0.0, 9e9, 0.0], [*START[:2], 9.0], "x", [True, 1.0, 0.0]):
        plain["worlds"][0]["start_pose"] = wrong
        with pytest.raises(LampyrisError, match="STUDY_PLAIN"):
            from_plain(plain, grids)


# ---- runs --------------------


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    "robot", [CAR, {**CAR, "drive": "differential"}, {**CAR, "drive": "omnidirectional"}]
)
def test_rows_say_what_plan_says(robot: Any) -> None:
    study = posed(planners=PLANNERS, robot=robot)
    scene = Scene(hall(), start_pose=START, goal_pose=GOAL, robot=lampyris.Robot(**robot))
    for row, name in zip(rows_of(study), PLANNERS, strict=True):
        assert row.ending == "done", row.error
        plan = lampyris.plan(scene, name)
        path, profile = plan.pose_path, lampyris.speed_profile(scene, plan)
        assert path is not None
        told = row.metrics
        assert (told["outcome"], told["found"], told["arrived"]) == ("found", True, True)
        assert [told[n] for n in ("length_m", "cost_m", "lower_bound_m", "bound", "reversals", "time_s")] == [
            path.length_m, path.cost_m, path.lower_bound_m, path.bound, path.reversals, profile.duration,
        ]  # fmt: skip
        assert [told[n] for n in ("cost", "optimal", "gap", "cost_to_go", "ticks", "reference_ok")] == [
            None
        ] * 6
        assert 0 < told["clearance_least_m"] < told["clearance_mean_m"]
        assert told["clearance_least_m"] == pytest.approx(clearance(path, scene), abs=1e-9)


def clearance(path: PosePath, scene: Scene) -> float:
    """Least distance of the outline to a wall, by points every millimetre on its edges."""
    grid, outline = scene.grid, np.array(scene.robot.footprint)
    y, x = np.nonzero(grid.blocked)
    low = grid.frame.to_metres(np.column_stack((x, y)).astype(float)) - grid.resolution / 2
    least = math.inf
    for px, py, yaw in path.poses.tolist():
        turn = np.array(((math.cos(yaw), -math.sin(yaw)), (math.sin(yaw), math.cos(yaw))))
        corners = outline @ turn.T + (px, py)
        # Outline and squares are convex here: the nearest pair has a corner of one of them.
        d = np.maximum(
            np.maximum(low[None] - corners[:, None], corners[:, None] - low[None] - grid.resolution), 0.0
        )
        least = min(least, float(np.hypot(d[..., 0], d[..., 1]).min()))
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
            at = low + grid.resolution * np.array((i, j))
            for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
                share = np.clip(((at - a) @ (b - a)) / ((b - a) @ (b - a)), 0.0, 1.0)
                least = min(least, float(np.hypot(*(at - a - share[:, None] * (b - a)).T).min()))
    return least


def test_measures_of_a_path_by_hand() -> None:
    """A metre ahead, a quarter turn in place, half a metre back, and a quarter of a circle ahead."""
    ahead = [(0.1 * k, 0.0, 0.0) for k in range(11)]
    turned = [(1.0, 0.0, math.pi / 20 * k) for k in range(1, 11)]
    back = [(1.0, -0.1 * k, math.pi / 2) for k in range(1, 6)]
    arc = [
        (1.0 - (1 - math.cos(a)), -0.5 + math.sin(a), math.pi / 2 + a)
        for a in (math.pi / 20 * k for k in range(1, 11))
    ]
    poses = np.array([*ahead, *turned, *back, *arc])
    gears = np.array([1] * 10 + [0] * 10 + [-1] * 5 + [1] * 10)
    out: dict[str, Any] = {}
    pose_measures(out, PosePath(poses, gears, 5.0, 4.0), 0.5)
    length = 1.5 + math.pi / 2
    assert out["length_m"] == pytest.approx(length)
    assert out["turn_deg"] == pytest.approx(180.0)
    assert (out["turns"], out["reversals"], out["bound"]) == (2, 2, 1.25)
    assert out["smoothness"] == pytest.approx(1 / (1 + math.pi / (length / 0.5)))


def test_a_robot_that_fits_only_with_its_heading() -> None:
    """Planners on cells plan for the circle around it, and say that the end is occupied; planners of poses plan."""
    start = (*hall().to_metres((12, 4)).tolist(), math.pi / 2)
    study = posed(planners=("astar", *PLANNERS), start=start)
    told = [(row.ending, row.metrics["outcome"]) for row in rows_of(study)]
    assert told == [("done", "start-occupied"), *[("done", "found")] * 3]


def test_walls_and_occupied_ends_are_results() -> None:
    grid = hall()
    shut = replace(grid, blocked=grid.blocked | (np.arange(28) == 14)[None, :])
    assert [row.metrics["outcome"] for row in rows_of(posed(planners=PLANNERS, grid=shut))] == ["no-path"] * 3
    across = (*grid.to_metres((13, 4)).tolist(), 0.0)
    for kind in ("plan", "drive"):
        study = posed(kind, planners=PLANNERS, start=across)
        assert [(r.ending, r.metrics["outcome"]) for r in rows_of(study)] == [("done", "start-occupied")] * 3


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["plan", "drive"])
def test_two_workers_give_the_same_bytes_as_one(kind: str, tmp_path: Path) -> None:
    traffic = NONE if kind == "plan" else StudyTraffic("random-walk", 2)
    study = posed(kind, ("astar", *PLANNERS, planner("lattice", weight=1.0)), traffic)
    texts = []
    for workers in (1, 2):
        table = run_study(study, workers=workers)
        assert set(table["ending"]) == {"done"}
        assert set(table["arrived"]) == {True} or kind == "drive"
        write_csv(tmp_path / f"{workers}.csv", table)
        texts.append((tmp_path / f"{workers}.csv").read_bytes())
    assert texts[0] == texts[1]


def test_a_store_resumes(tmp_path: Path) -> None:
    study = posed(planners=PLANNERS)
    whole = run_study(study, tmp_path / "a.db")
    with Store.create(tmp_path / "b.db", study) as store:
        kept = rows_of(study)[:2]
        store.add(kept)
    asked: list[int] = []
    resumed = run_study(study, tmp_path / "b.db", progress=lambda p: asked.append(p.done))
    assert asked[0] >= 2
    names = whole.names()
    assert [whole[n] for n in names] == [resumed[n] for n in names]


@pytest.mark.commit(1)
@pytest.mark.parametrize("controller", ["exact", "rpp"])
def test_drives_of_poses(controller: str) -> None:
    from dataclasses import asdict

    from lampyris.model.settings.drive import DriveSettings

    settings = asdict(DriveSettings(controller=controller))
    study = posed("drive", ("lattice",), drive=settings)
    (row,), (job,) = rows_of(study), study.jobs()
    assert (row.ending, row.metrics["outcome"]) == ("done", "arrived"), row.error
    made = run_job(job.plain, hall()).noun
    assert isinstance(made, Drive)
    assert made.controller == controller
    assert row.metrics["time_s"] == made.duration
    assert row.metrics["reversals"] is not None
    assert row.metrics["clearance_least_m"] > 0
    assert row.metrics["optimal"] is None


@pytest.mark.nightly
def test_the_page_of_a_study_of_poses(tmp_path: Path) -> None:
    for kind in ("plan", "drive"):
        study = posed(kind, ("astar", "lattice", "hybrid-astar"))
        runs = runs_of(study, run_study(study).records())
        summary = summarise(runs)
        page = page_of(runs, summary)
        assert ("bound" in page and "reversals" in page) or kind == "drive"
        assert "(1.125 m, 1.125 m, 90 deg)" in page or kind == "plan"
        measures = {pair.measure for pair in summary.pairs}
        assert ("length_m" in measures) == (kind == "plan")
        assert "cost" not in measures


def test_plans_of_poses_are_of_the_plan_kind() -> None:
    (job,) = posed().jobs()
    ran = run_job(job.plain, hall())
    assert isinstance(ran.noun, Plan)
    assert ran.noun.pose_path is not None
    assert ran.profile is not None


def test_times_are_planned_by_the_tracks_that_are_replayed() -> None:
    """The arrival of the rows is the planned one, at the planner's share of the top speed; the referee saw the tracks."""
    study = posed(
        planners=(planner("lattice-sipp", speed_fraction=0.5), "lattice"),
        crowd=StudyTraffic("random-walk", 4),
        robot=CAR,
    )
    timed, plain = rows_of(study)
    assert (timed.ending, timed.error) == ("done", "")
    assert timed.metrics["outcome"] == "found"
    assert timed.metrics["time_s"] == pytest.approx(timed.metrics["cost_m"] / 0.5, rel=1e-6)
    assert timed.metrics["bound"] <= 1.1 * (1 + 1e-6)
    assert plain.ending == "done"
    assert plain.metrics["time_s"] != pytest.approx(plain.metrics["cost_m"], rel=1e-3)


def test_a_drive_of_planned_times_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LampyrisError, match="do not follow these"):
        load(tmp_path, ROBOT + MAP % "{random: 1}" + "kind: drive\nplanners: [lattice-sipp]\n")


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    ("tracks", "kind", "planner_name"), [("live", "mixed", "lattice"), ("replayed", "random-walk", "pad")]
)
def test_drives_among_polygons(tracks: Any, kind: str, planner_name: str) -> None:
    """Obstacles have the outline of the study, in the drive and in its evidence, and the row is accepted."""
    from dataclasses import asdict

    from lampyris.model.settings.drive import DriveSettings
    from lampyris.model.traffic import RandomWalk

    crate = RandomWalk(1, footprint=((0.3, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.3, -0.1)))
    crowd = StudyTraffic(kind, 3, None, crate.radius, tracks, crate.footprint)
    study = posed("drive", (planner_name,), crowd, drive=asdict(DriveSettings()))
    again = from_plain(
        json.loads(json.dumps(study_plain(study))), {g.hash: g.grid for g in study.grounds.values()}
    )
    assert again.traffic_cases == (crowd,)
    (row,), (job,) = rows_of(study), study.jobs()
    assert row.ending == "done", row.error
    made = run_job(job.plain, hall()).noun
    assert isinstance(made, Drive)
    assert {track.outline for track in made.tracks} == {crate.footprint}
    assert any(np.ptp(track.yaw) > 0 for track in made.tracks if track.yaw is not None)
    assert row.metrics["outcome"] == made.outcome.value


def test_polygons_of_study_files(tmp_path: Path) -> None:
    rest = MAP % "{random: 1}" + "kind: drive\nplanners: [astar]\n"
    sides = "traffic: [{kind: random-walk, count: 2, rectangle: [0.8, 0.4]}]\n"
    (crowd,) = load(tmp_path, rest + sides).traffic_cases
    assert crowd.footprint == ((-0.4, -0.2), (0.4, -0.2), (0.4, 0.2), (-0.4, 0.2))
    assert crowd.radius == pytest.approx(math.sqrt(0.2), abs=2e-6)
    with pytest.raises(LampyrisError, match="radius and rectangle together"):
        load(tmp_path, rest + sides.replace("count: 2,", "count: 2, radius: 1,"))
    discs = load(tmp_path, rest + "traffic: [{kind: random-walk, count: 2}]\n").traffic_cases[0]
    assert "footprint" not in discs.plain, "keys of jobs among discs are what they were"
