"""Bags: what is written is read back, by rosbags and by a reader that is not ours."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import in_process
import lampyris
from lampyris import ros
from lampyris.errors import FileError, UsageError
from lampyris.io.paths import read_path_points
from lampyris.io.tracks.timed_tracks import read_timed_track
from lampyris.ros import messages
from lampyris.ros.bags.writer import Stamped, _write
from lampyris.ros.stores import typestore
from sizes import some

rosbags = pytest.importorskip("rosbags", reason="the extra ros is not installed")


def room() -> lampyris.Grid:
    walls = np.zeros((20, 24), dtype=bool)
    walls[6:14, 9:11] = True
    unknown = np.zeros_like(walls)
    unknown[0, :3] = True
    return lampyris.Grid(walls | unknown, unknown, resolution=0.1, origin=(1.0, -2.0, 0.3))


@pytest.fixture(scope="module")
def driven() -> lampyris.Drive:
    scene = lampyris.Scene(room(), (2, 10), (21, 10), robot=lampyris.Robot(radius=0.1))
    return lampyris.drive(scene, "astar", traffic=lampyris.RandomWalk(2), seed=3)


@pytest.mark.parametrize("name", some(["run.mcap", "run.db3", "folder"]))
def test_a_drive_comes_back(name: str, driven: lampyris.Drive, tmp_path: Path) -> None:
    grid = driven.scene.grid
    count = ros.write_bag(driven, tmp_path / name, start=1_700_000_000.0)
    with ros.open_bag(tmp_path / name) as bag:
        counts = {one.name: one.messages for one in bag.topics}
        assert sum(counts.values()) == count
        assert set(counts) == {
            "/map", "/tf_static", "/tf", "/plan", "/pose", "/odom", "/cmd_vel", "/obstacles", "/lampyris/markers",
        }  # fmt: skip
        assert bag.start == 1_700_000_000.0
        assert bag.duration == pytest.approx(driven.duration, abs=1e-6)
        assert bag.grid() == lampyris.Grid(grid.blocked, grid.unknown, grid.resolution, grid.origin, "map")
        for k, one in enumerate(bag.tracks()):
            theirs = grid.to_metres(driven.tracks[k].at(one.track.t))
            assert np.abs(theirs - one.track.xy).max() < 1e-6  # stamps of 1.7e9 s are read as 64-bit floats
            assert one.track.radius == pytest.approx(driven.tracks[k].radius)
        for topic in (None, "/tf", "/odom"):
            poses = bag.poses(topic)
            assert np.abs(poses[:, 1:3] - driven.poses(poses[:, 0])[:, :2]).max() < 1e-6
        speeds = [(t, one["twist"]["linear"]["x"]) for _, _, t, one in bag.read("/cmd_vel")]
        t, v = np.array(speeds).T
        assert np.abs(v - driven.at(t)[1]).max() < 1e-6
        assert len(bag.paths()) == len(driven.curves)


def test_tracks_that_went_in_come_out(driven: lampyris.Drive, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    ros.write_bag(driven, file)
    in_process.call("bag", str(file), "--track", str(tmp_path / "person.csv"))
    for k, given in enumerate(driven.tracks):
        found = read_timed_track(tmp_path / f"person-obstacles-{k}.csv")
        assert found.t[-1] == pytest.approx(driven.duration, abs=1e-9)
        inside = given.t[given.t <= driven.duration]
        between = np.linspace(0.0, driven.duration, 97)
        for t in (inside, between):
            ours = np.column_stack([np.interp(t, found.t, found.xy[:, k]) for k in (0, 1)])
            assert np.abs(ours - driven.scene.grid.to_metres(given.at(t))).max() < 1e-8
        at_places = driven.scene.grid.to_metres(given.at(found.t))
        assert np.abs(found.xy - at_places).max() < 1e-9


def test_another_reader_decodes_every_message(driven: lampyris.Drive, tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    decoder = pytest.importorskip("mcap_ros2.decoder", reason="mcap-ros2-support is not installed")
    count = ros.write_bag(driven, tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as file:
        found = list(
            reader.make_reader(file, decoder_factories=[decoder.DecoderFactory()]).iter_decoded_messages()
        )
    assert len(found) == count
    poses = [one.decoded_message for one in found if one.channel.topic == "/pose"]
    times = np.array([p.header.stamp.sec + 1e-9 * p.header.stamp.nanosec for p in poses])
    places = np.array([(p.pose.position.x, p.pose.position.y) for p in poses])
    assert np.abs(places - driven.poses(times)[:, :2]).max() < 1e-8
    tf = next(one for one in found if one.channel.topic == "/tf_static").decoded_message.transforms[0]
    assert (tf.header.frame_id, tf.child_frame_id) == ("map", "odom")


def test_a_simulation_in_ticks_and_a_plan(tmp_path: Path) -> None:
    scene = lampyris.Scene(room(), (2, 10), (21, 10), robot=lampyris.Robot(v_max=0.5))
    trace = lampyris.simulate(scene, "astar", traffic=lampyris.RandomWalk(1), seed=1)
    ros.write_bag(trace, tmp_path / "trace.mcap")
    with ros.open_bag(tmp_path / "trace.mcap") as bag:
        poses = bag.poses()
        assert np.allclose(poses[:, 1:3], scene.grid.to_metres(trace.robot), atol=1e-12)
        assert np.allclose(np.diff(poses[:, 0]), 0.2)  # a cell of 0.1 m at 0.5 m/s
        track = bag.tracks()[0].track
        assert np.allclose(track.xy, scene.grid.to_metres(trace.tracks[0]), atol=1e-12)
    plan = lampyris.plan(scene, "astar")
    profile = lampyris.speed_profile(scene, plan)
    ros.write_bag(plan, tmp_path / "plan.mcap", scene=scene, profile=profile)
    with ros.open_bag(tmp_path / "plan.mcap") as bag:
        held = next(fields for _, _, _, fields in bag.read("/lampyris/speed_profile"))
        said = json.loads(held["data"])
        assert said["v"] == profile.v.tolist()
        assert said["why"] == [profile.why(k) for k in range(len(profile.v))]
        assert np.allclose(bag.paths()[0].poses, ros.path_poses(plan))


def test_a_person_seen_by_a_robot_is_led_to_the_map(tmp_path: Path) -> None:
    """The robot turns on the spot at (1, 2) while a person stands at (3, 2): in its frame the person circles it."""
    rows = []
    for k in range(11):
        t, yaw = 0.1 * k, 0.2 * k
        pose = messages.transform(t, "map", "base_link", (1.0, 2.0, yaw))
        rows.append(Stamped(t, "/tf", messages.TF, {"transforms": [pose]}))
        seen = messages.pose_stamped(t, (2.0 * math.cos(yaw), -2.0 * math.sin(yaw), 0.0), "base_link")
        rows.append(Stamped(t, "/person", messages.POSE, seen))
    _write(rows, tmp_path / "seen.mcap", typestore(), 0.0)
    with ros.open_bag(tmp_path / "seen.mcap") as bag:
        (person,) = bag.tracks("/person", radius=0.3)
        assert np.allclose(person.track.xy, [3.0, 2.0], atol=1e-9)
        assert person.track.radius == 0.3
        with pytest.raises(UsageError, match="TOPIC"):
            bag.tracks("/nobody")
    lost = [row for row in rows if row.topic == "/person"]
    _write(lost, tmp_path / "lost.mcap", typestore(), 0.0)
    with ros.open_bag(tmp_path / "lost.mcap") as bag, pytest.raises(FileError, match="no transform leads"):
        bag.tracks("/person")


def test_the_verb_lists_and_writes(driven: lampyris.Drive, tmp_path: Path) -> None:
    file, map_file, path_file = (str(tmp_path / name) for name in ("a.mcap", "m.yaml", "p.yaml"))
    ros.write_bag(driven, file)
    listed = in_process.call("bag", file, "--json")
    assert {one["name"] for one in json.loads(listed.stdout)["topics"]} >= {"/map", "/tf"}
    in_process.call(
        "bag", file, "--map", map_file, "--export", path_file, "--poses", str(tmp_path / "poses.csv")
    )
    assert (lampyris.load_grid(map_file).blocked == driven.scene.grid.blocked).all()
    assert len(read_path_points(path_file).points) > 5
    assert (tmp_path / "poses.csv").read_text().startswith("t,x_m,y_m,yaw\n0.0,")
    assert in_process.call("bag", file, "--map", map_file).returncode == 2  # it exists
    assert in_process.call("bag", file, "--topic", "/plan").returncode == 2
    (tmp_path / "no.mcap").write_bytes(b"no bag")
    assert in_process.call("bag", str(tmp_path / "no.mcap")).returncode == 3


def test_drive_and_plan_write_bag_and_path(tmp_path: Path) -> None:
    walls = np.zeros((12, 12), dtype=bool)
    np.save(tmp_path / "m.npy", walls)
    (tmp_path / "p.csv").write_text("t,x_m,y_m,radius_m\n0,1.5,10.5,0.4\n8,9.5,10.5,0.4\n")
    ends = (str(tmp_path / "m.npy"), "--start", "1,6", "--goal", "9,6", "--planner", "astar")
    bag, path = str(tmp_path / "o.mcap"), str(tmp_path / "o.json")
    done = in_process.call(
        "drive", *ends, "--obstacles", "0", "--track", str(tmp_path / "p.csv"), "--bag", bag, "--export", path
    )
    assert done.returncode == 0, done.stderr
    with ros.open_bag(bag) as held:
        (person,) = held.tracks()
        assert person.track.radius == pytest.approx(0.5)  # no obstacle is smaller than its cell
        at = np.array([np.interp(4.0, person.track.t, person.track.xy[:, k]) for k in (0, 1)])
        assert np.abs(at - [5.5, 10.5]).max() < 1.0 + 1e-9  # in the cell that holds its place at each tick
    assert read_path_points(path).frame == "metres"
    assert in_process.call("plan", *ends, "--export", str(tmp_path / "o.yaml")).returncode == 0
    assert len(read_path_points(tmp_path / "o.yaml").points) == 9


@pytest.mark.parametrize(
    ("name", "spoil", "says"),
    [
        ("run.mcap", lambda d: d[: len(d) // 2], "an MCAP file that was written to its end"),
        ("run.mcap", lambda d: b"XXXX" + d[4:], "magic"),
        ("run.mcap", lambda d: b"", "empty"),
        ("run.db3", lambda d: d[: len(d) // 2], "sqlite3 FILE .recover"),
        ("run.db3", lambda d: b"hello" * 1000, "not a database"),
    ],
)
def test_a_damaged_bag_is_refused(
    name: str, spoil: Any, says: str, driven: lampyris.Drive, tmp_path: Path
) -> None:
    file = tmp_path / name
    ros.write_bag(driven, file)
    file.write_bytes(spoil(file.read_bytes()))
    with pytest.raises(FileError, match=r"^BAG|BAG") as refused, ros.open_bag(file) as bag:
        bag.grid()
    assert refused.value.code == "BAG"
    assert says in str(refused.value)
    assert refused.value.where == str(file)
    assert refused.value.allowed


def test_a_place_in_a_bag_that_cannot_be_read_is_a_damaged_bag(
    driven: lampyris.Drive, tmp_path: Path
) -> None:
    """Whatever is wrong with its bytes, the answer is a FileError or messages, never a fault of a library."""
    file = tmp_path / "run.mcap"
    ros.write_bag(driven, file)
    data = file.read_bytes()
    rng = np.random.Generator(np.random.PCG64(1))
    refused = []
    for _ in range(12):
        spoiled = bytearray(data)
        at = int(rng.integers(len(data) - 2000))
        spoiled[at : at + 2000] = rng.bytes(2000)
        file.write_bytes(spoiled)
        try:
            with ros.open_bag(file) as bag:
                bag.grid()
                bag.tracks()
        except FileError as fault:
            refused.append(fault.code)
    assert set(refused) == {"BAG"}


def test_without_rosbags_one_sentence_names_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    import importlib

    real = importlib.import_module

    def missing(name: str, *rest: Any) -> Any:
        if name.startswith("rosbags"):
            raise ModuleNotFoundError("No module named 'rosbags'", name="rosbags")
        return real(name, *rest)

    typestore.cache_clear()
    monkeypatch.setattr(importlib, "import_module", missing)
    done = in_process.call("plan", "env-1", "--bag", str(tmp_path / "x.mcap"))
    typestore.cache_clear()
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "pip install 'lampyris[ros]'" in done.stderr
