"""Motion primitives in files: Nav2's JSON and SBPL's ``.mprim``, there and back, and what is refused."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from in_process import call
from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.model.grid import Grid
from lampyris.model.lattice.motion_primitives import (
    MAX_HEADINGS,
    MAX_MOTIONS,
    MAX_POSES,
    Motion,
    MotionPrimitives,
)
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.referee import check_plan
from sizes import some

CAR = ((0.9, 0.25), (-0.3, 0.25), (-0.3, -0.25), (0.9, -0.25))


def scene_of(seed: int, robot: Robot, resolution: float = 0.1) -> Scene:
    rng = np.random.default_rng(seed)
    walls = rng.random((60, 60)) < 0.006
    walls[:12, :12] = walls[-12:, -12:] = False
    ends = [(0.55, 5.45, float(rng.uniform(-3, 3))), (5.45, 0.55, float(rng.uniform(-3, 3)))]
    return Scene(Grid(walls, resolution=resolution), start_pose=ends[0], goal_pose=ends[1], robot=robot)


def planned(scene: Scene, **settings: Any) -> Plan:
    plan = LatticePlanner(weight=1.0, shortcut=False, **settings).open(scene, np.random.default_rng(0)).plan()
    if plan:
        assert check_plan(plan, scene) is None
    return plan


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("drive", "headings"),
    some([("ackermann", 16), ("differential", 16), ("omnidirectional", 16), ("ackermann", 32)], 2),
)
def test_our_primitives_come_back_from_both_forms_with_the_same_costs(
    tmp_path: Path, drive: str, headings: int
) -> None:
    robot = Robot(footprint=CAR, drive=drive, turn_radius=0.6)
    for name in ("p.json", "p.mprim"):
        reverse = name == "p.mprim" and drive != "omnidirectional"
        made = lampyris.motion_primitives(robot, 0.1, headings=headings, reverse=reverse)
        lampyris.save_primitives(made, tmp_path / name, drive=drive)
        back = lampyris.load_primitives(tmp_path / name)
        assert back.headings == pytest.approx(made.headings, abs=1e-9)
        assert len(back.motions) == len(made.motions)
    found = 0
    for seed in range(2):
        scene = scene_of(seed, robot)
        ours = planned(scene, headings=headings)
        for name in ("p.json", "p.mprim"):
            theirs = planned(scene, primitives=str(tmp_path / name))
            assert theirs.status is ours.status
            if ours.pose_path is not None:
                assert theirs.pose_path is not None
                assert theirs.pose_path.cost_m == pytest.approx(ours.pose_path.cost_m, rel=1e-6)
                assert theirs.bound == 1.0
                found += 1
    assert found > 0


def uniform_mprim(digits: int = 4) -> str:
    """A unicycle on 16 uniform headings, as SBPL's generators write it: arcs that miss the last heading a little."""
    lines = ["resolution_m: 0.025000", "numberofangles: 16"]
    motions = []
    for k in range(16):
        quarter, base = divmod(k, 4)
        ahead = [(8, 0), (6, 3), (6, 6), (3, 6)][base]
        turns = (
            [(8, 1, 1), (5, 4, 2), (5, 7, 3), (2, 7, 4)][base],
            [(8, -1, -1), (7, 2, 0), (7, 5, 1), (4, 5, 2)][base],
        )
        for number, (x, y, end, price, back) in enumerate(
            [(*ahead, base, 1, False), (*ahead, base, 5, True), *((*turn, 2, False) for turn in turns)]
        ):
            motions.append((number, k, quarter, x, y, end, price, back))
    lines.append(f"totalnumberofprimitives: {len(motions)}")
    for number, k, quarter, x, y, end, price, back in motions:
        sign = -1 if back else 1
        start, turn = k % 4 * math.pi / 8, (end - k % 4) * math.pi / 8
        points = []
        for i in range(10):
            share = i / 9
            px, py = hermite(x, y, start, start + turn, share) if turn else (share * x, share * y)
            a = quarter * math.pi / 2
            gx, gy = px * math.cos(a) - py * math.sin(a), px * math.sin(a) + py * math.cos(a)
            yaw = start + turn * share * (0.97 if turn else 1.0) + a
            points.append(f"{sign * gx * 0.025:.{digits}f} {sign * gy * 0.025:.{digits}f} {yaw:.{digits}f}")
        for _ in range(quarter):
            x, y = -y, x
        lines += [
            f"primID: {number}", f"startangle_c: {k}", f"endpose_c: {sign * x} {sign * y} {end + 4 * quarter}",
            f"additionalactioncostmult: {price}", f"intermediateposes: {len(points)}", *points,
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


def hermite(x: float, y: float, a: float, b: float, t: float) -> tuple[float, float]:
    """A curve from (0, 0) at the yaw a to (x, y) at the yaw b, for t from 0 to 1."""
    size = math.hypot(x, y)
    h1, h2, h3 = t * (1 - t) ** 2, t * t * (3 - 2 * t), t * t * (t - 1)
    return (
        size * (h1 * math.cos(a) + h3 * math.cos(b)) + h2 * x,
        size * (h1 * math.sin(a) + h3 * math.sin(b)) + h2 * y,
    )


@pytest.mark.nightly
def test_uniform_headings_prices_and_few_digits_as_sbpl_has_them(tmp_path: Path) -> None:
    (tmp_path / "u.mprim").write_text(uniform_mprim())
    given = lampyris.load_primitives(tmp_path / "u.mprim")
    assert given.headings[1] == pytest.approx(math.pi / 8)
    assert [one.price for one in given.motions[:4]] == [1.0, 5.0, 2.0, 2.0]
    robot = Robot(footprint=((0.2, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.2, -0.1)), drive="ackermann")
    walls = np.zeros((100, 100), dtype=bool)
    walls[20:, 50:53] = True
    scene = Scene(
        Grid(walls, resolution=0.025), start_pose=(0.3, 0.3, 1.6), goal_pose=(2.2, 0.3, -1.5), robot=robot
    )
    plan = planned(scene, primitives=str(tmp_path / "u.mprim"))
    path = plan.pose_path
    assert path is not None
    assert path.prices is not None
    assert set(path.prices.tolist()) <= {1.0, 2.0, 5.0}
    assert path.cost_m > path.length_m
    ahead = planned(scene, primitives=given, reverse=False)
    assert ahead.pose_path is not None
    assert (ahead.pose_path.gears == 1).all()


def plain(count: int = 1, **more: Any) -> dict[str, Any]:
    """A small file in Nav2's form."""
    poses = [[0.05, 0.0, 0.0], [0.1, 0.0, 0.0]]
    one = {
        "trajectory_id": 3,
        "start_angle_index": 0,
        "end_angle_index": 0,
        "trajectory_length": 0.1,
        "poses": poses,
    }
    head = {"grid_resolution": 0.05, "heading_angles": [0.0, math.pi / 2], "num_of_headings": 2}
    return {"lattice_metadata": head, "primitives": [dict(one) for _ in range(count)], **more}


def changed(change: Callable[[dict[str, Any], dict[str, Any]], object]) -> dict[str, Any]:
    made = plain()
    change(made["lattice_metadata"], made["primitives"][0])
    return made


JSON_FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "no metadata": ({"primitives": []}, "lattice_metadata"),
    "no primitive": (plain(0), "/primitives: no primitive"),
    "heading": (changed(lambda h, p: p.update(end_angle_index=2)), "/primitives/0/end_angle_index: 2"),
    "order": (changed(lambda h, p: h.update(heading_angles=[1.0, 0.5])), "/lattice_metadata/heading_angles"),
    "count": (changed(lambda h, p: h.update(num_of_headings=16)), "num_of_headings: 16; allowed: 2"),
    "resolution": (changed(lambda h, p: h.update(grid_resolution=0)), "grid_resolution: 0"),
    "end": (
        changed(lambda h, p: p["poses"].__setitem__(1, [0.07, 0.0, 0.0])),
        "primitive 3: ends at (0.07, 0) m",
    ),
    "yaw": (changed(lambda h, p: p["poses"].__setitem__(1, [0.1, 0.0, 1.5])), "primitive 3"),
    "step": (changed(lambda h, p: p.update(poses=[[0.05, 0, 0], [0.9, 0, 0]])), "primitive 3: 17 cells"),
    "length": (changed(lambda h, p: p.update(trajectory_length=0.4)), "0.4 m, and poses along 0.1 m"),
    "pose": (changed(lambda h, p: p.update(poses=[[0.1, 0.0]])), "/primitives/0/poses/0: 2 numbers"),
    "text": (changed(lambda h, p: p.update(poses="x")), "/primitives/0/poses"),
    "flag": (changed(lambda h, p: p.update(start_angle_index=True)), "start_angle_index"),
}


@pytest.mark.parametrize("fault", JSON_FAULTS)
def test_faults_of_json_are_named_with_place_and_line(tmp_path: Path, fault: str) -> None:
    data, words = JSON_FAULTS[fault]
    file = tmp_path / "p.json"
    file.write_text(json.dumps(data, indent=1))
    with pytest.raises(FileError) as caught:
        lampyris.load_primitives(file)
    assert words in str(caught.value)
    assert "p.json:" in str(caught.value)
    line = int(str(caught.value).split("p.json:")[1].split(":")[0])
    assert 1 <= line <= len(file.read_text().splitlines())


MPRIM_FAULTS: dict[str, tuple[Callable[[str], str], str]] = {
    "word": (lambda t: t.replace("startangle_c: 0", "startangle: 0", 1), "u.mprim:5"),
    "heading": (lambda t: t.replace("startangle_c: 0", "startangle_c: 16", 1), "u.mprim:5"),
    "number": (lambda t: t.replace("0.0222 0.0000", "0.0222 zero", 1), "u.mprim:10: 'zero'"),
    "cell": (
        lambda t: t.replace("endpose_c: 8 0 0", "endpose_c: 7 0 0", 1),
        "primitive 0: ends at (0.2, 0) m",
    ),
    "total": (lambda t: t.replace("primitives: 64", "primitives: 65"), "u.mprim:3: 65 primitives stated, 64"),
    "poses": (
        lambda t: t.replace("intermediateposes: 10", "intermediateposes: 9", 1),
        "primitive 0: ends at (0.1778, 0) m",
    ),
    "price": (lambda t: t.replace("costmult: 1", "costmult: 0", 1), "u.mprim:7: '0'"),
    "cut": (lambda t: t[:-20], "u.mprim:"),
    "empty": (lambda t: "resolution_m:", "u.mprim:1: the file ends"),
}


@pytest.mark.parametrize("fault", MPRIM_FAULTS)
def test_faults_of_mprim_are_named_with_line(tmp_path: Path, fault: str) -> None:
    change, words = MPRIM_FAULTS[fault]
    file = tmp_path / "u.mprim"
    text = change(uniform_mprim())
    assert text != uniform_mprim()
    file.write_text(text)
    with pytest.raises(FileError) as caught:
        lampyris.load_primitives(file)
    assert words in str(caught.value)


@pytest.mark.nightly
def test_what_a_map_or_a_robot_does_not_fit_is_said(tmp_path: Path) -> None:
    file = tmp_path / "p.json"
    robot = Robot(footprint=CAR, drive="differential", turn_radius=0.5)
    lampyris.save_primitives(lampyris.motion_primitives(robot, 0.1), file, drive="differential")

    def refused(robot: Robot, resolution: float = 0.1) -> str:
        with pytest.raises(FileError) as caught:
            planned(scene_of(0, robot, resolution), primitives=str(file))
        return str(caught.value)

    assert "cells of 0.1 m, on a map of 0.2 m" in refused(robot, 0.2)
    tighter = refused(Robot(footprint=CAR, drive="differential", turn_radius=2.0))
    assert "allowed: at least 2 m, the robot's turn_radius" in tighter
    assert "primitive" in tighter
    assert "turns in place" in refused(Robot(footprint=CAR, drive="ackermann", turn_radius=0.5))
    sideways = Robot(footprint=CAR, drive="omnidirectional")
    lampyris.save_primitives(lampyris.motion_primitives(sideways, 0.1), file, drive="omnidirectional")
    assert "degrees off its heading" in refused(Robot(footprint=CAR, drive="differential"))
    assert planned(scene_of(0, sideways), primitives=str(file)).status is Status.FOUND


def test_unequal_primitives_and_headings_without_any(tmp_path: Path) -> None:
    straight = Motion(0, 0, 0, (1, 0), [(0, 0, 0), (0.1, 0, 0)])
    given = MotionPrimitives(0.1, (0.0, math.pi / 2), [straight])
    grid = Grid(np.zeros((5, 20), dtype=bool), resolution=0.1)
    robot = Robot(drive="differential")
    scene = Scene(grid, start_pose=(0.25, 0.25, 0.0), goal_pose=(1.55, 0.25, 0.0), robot=robot)
    plan = planned(scene, primitives=given)
    assert plan.pose_path is not None
    assert plan.pose_path.cost_m == pytest.approx(1.3)
    other = Scene(grid, start_pose=(0.25, 0.25, 1.5), goal_pose=(1.55, 0.25, 0.0), robot=robot)
    assert planned(other, primitives=given).status is Status.NO_PATH
    turn = Motion(0, 0, 1, (0, 0), [(0, 0, 0.5 * k) for k in range(4)])
    with pytest.raises(FileError, match="no motion to another cell"):
        planned(scene, primitives=MotionPrimitives(0.1, (0.0, math.pi / 2), [turn]))


@pytest.mark.nightly
def test_limits(tmp_path: Path) -> None:
    def ask(data: object, name: str = "p.json") -> int:
        (tmp_path / name).write_text(data if isinstance(data, str) else json.dumps(data))
        return len(lampyris.load_primitives(tmp_path / name).motions)

    def of_headings(n: int) -> dict[str, Any]:
        return changed(lambda h, p: h.update(heading_angles=[k * 0.01 for k in range(n)], num_of_headings=n))

    assert ask(of_headings(MAX_HEADINGS)) == 1
    with pytest.raises(LimitError):
        ask(of_headings(MAX_HEADINGS + 1))
    assert ask(plain(MAX_MOTIONS)) == MAX_MOTIONS
    with pytest.raises(LimitError):
        ask(plain(MAX_MOTIONS + 1))
    head = "resolution_m: 1\nnumberofangles: 4\ntotalnumberofprimitives: 1\n"
    one = "primID: 0\nstartangle_c: 0\nendpose_c: 1 0 0\nadditionalactioncostmult: 1\nintermediateposes: "

    def of_poses(n: int) -> str:
        return f"{head}{one}{n}\n" + "0 0 0\n" * (n - 1) + "1 0 0\n"

    assert ask(of_poses(1000), "p.mprim") == 1
    with pytest.raises(LampyrisError):
        ask(of_poses(MAX_POSES + 1), "p.mprim")


def test_motions_that_are_too_long_are_refused_before_they_are_laid_out() -> None:
    from lampyris.planning.lattice.lattice import MOST_LENGTH, MOST_REACH, demand_reach
    from lampyris.planning.lattice.sampled import SampledPrimitive

    def straight(length: float) -> SampledPrimitive:
        return SampledPrimitive(0, 0, (round(length), 0), np.array([(0.0, 0.0, 0.0), (length, 0.0, 0.0)]))

    demand_reach([straight(MOST_REACH)], 0.0)
    with pytest.raises(LimitError, match="LATTICE_REACH"):
        demand_reach([straight(MOST_REACH)], 1.0)
    many = [straight(MOST_REACH)] * (MOST_LENGTH // MOST_REACH)
    demand_reach(many, 0.0)
    with pytest.raises(LimitError, match="LATTICE_LENGTH"):
        demand_reach([*many, straight(1)], 0.0)
    with pytest.raises(LimitError, match="LATTICE_REACH"):
        lampyris.motion_primitives(Robot(turn_radius=1e6), 1e-6)


def test_scenarios_name_the_file_beside_them(tmp_path: Path) -> None:
    robot = Robot(radius=0.3, drive="differential")
    lampyris.save_primitives(
        lampyris.motion_primitives(robot, 0.5), tmp_path / "p.json", drive="differential"
    )
    text = (
        "version: 1\nmap: {bundled: env-6, resolution: 0.5}\nrobot: {radius: 0.3}\n"
        "planner: {name: lattice, settings: {primitives: NAME}}\n"
    )
    (tmp_path / "s.yaml").write_text(text.replace("NAME", "p.json"))
    scenario = lampyris.load_scenario(tmp_path / "s.yaml")
    done = lampyris.run(scenario)
    assert done.plan.pose_path is not None  # type: ignore[union-attr]
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    lampyris.save_scenario(scenario, folder / "t.yaml")
    assert "../p.json" in (folder / "t.yaml").read_text()
    again = lampyris.load_scenario(folder / "t.yaml", allow_outside=True)
    assert lampyris.run(again).plan.cost == done.plan.cost  # type: ignore[union-attr]
    (tmp_path / "s.yaml").write_text(text.replace("NAME", "../p.json"))
    with pytest.raises(FileError, match="outside the scenario's folder"):
        lampyris.load_scenario(tmp_path / "s.yaml")


@pytest.mark.nightly
def test_the_verb_writes_shows_converts_and_draws(tmp_path: Path) -> None:
    robot = tmp_path / "car.yaml"
    robot.write_text("rectangle: [1.2, 0.6]\ndrive: ackermann\nturn_radius: 0.5\n")
    made = call(
        "primitives", "--robot", robot, "--resolution", "0.05", "-o", tmp_path / "p.json",
        "--picture", tmp_path / "p.png",
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    assert (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"
    shown = call("primitives", tmp_path / "p.json", "--json")
    record = json.loads(shown.stdout)
    assert record["primitives"] == 48
    assert record["drives"]["ackermann"] is None
    assert call("primitives", tmp_path / "p.json", "-o", tmp_path / "q.mprim").returncode == 0
    assert len(lampyris.load_primitives(tmp_path / "q.mprim").motions) == 48
    args = ("plan", "env-6", "--resolution", "0.05", "--robot", robot, "--planner", "lattice")
    done = call(*args, "--set", f"primitives={tmp_path / 'missing.json'}")
    assert done.returncode == 3
    assert call("primitives").returncode == 2
    assert call("primitives", "--resolution", "0.1", "-o", tmp_path / "p.txt").returncode == 2


def test_primitives_are_values() -> None:
    made = lampyris.motion_primitives(Robot(drive="ackermann", turn_radius=0.5), 0.05)
    same = lampyris.motion_primitives(Robot(drive="ackermann", turn_radius=0.5), 0.05)
    assert made == same
    assert hash(made) == hash(same)
    assert made != lampyris.motion_primitives(Robot(drive="ackermann", turn_radius=0.6), 0.05)
    assert "48 at 16 headings" in repr(made)


@pytest.mark.parametrize(("heading", "end"), [(0.0, [1e-9, 0.0, 0.0]), (1e-9, [0.2, 0.0, 0.0])])
def test_ends_a_billionth_off_the_lattice_are_moved_onto_it(
    tmp_path: Path, heading: float, end: list[float]
) -> None:
    data = {
        "lattice_metadata": {"grid_resolution": 0.1, "heading_angles": [heading]},
        "primitives": [
            {
                "trajectory_id": 0, "start_angle_index": 0, "end_angle_index": 0, "left_turn": True,
                "trajectory_radius": 0.0, "trajectory_length": 0.2, "arc_length": 0.0, "straight_length": 0.2,
                "poses": [[0.1, 0, 0], end],
            }
        ],
    }  # fmt: skip
    file = tmp_path / "p.json"
    file.write_text(json.dumps(data, indent=0))
    (motion,) = lampyris.load_primitives(file).motions
    wanted = [motion.cell[0] * 0.1, motion.cell[1] * 0.1, heading]
    assert np.abs(motion.poses[-1] - wanted).max() < 1e-11
