"""``lampyris bag``: the topics of a bag of ROS 2, and maps, paths, poses and tracks out of it.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris._core import defaults
from lampyris.cli import text
from lampyris.cli.option_errors import check_choice
from lampyris.cli.options import Force, Json
from lampyris.cli.outputs import check_outputs, print_written
from lampyris.cli.text import print_json, print_notes
from lampyris.errors import UsageError

if TYPE_CHECKING:
    from lampyris.ros.bags.reader import Bag


def bag(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A bag: a folder, .mcap or .db3.")],
    topic: Annotated[
        str | None,
        typer.Option(
            "--topic", metavar="NAME", help="The topic to read (default: the usual one, or the only one)."
        ),
    ] = None,
    map_out: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="Write the last map (.yaml, .npy, .png, ...)."),
    ] = None,
    values: Annotated[
        str,
        typer.Option(
            "--values",
            metavar="occupancy|costmap",
            help="How numbers in the map are read: occupancy or costmap.",
        ),
    ] = defaults.VALUES,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export", metavar="FILE", help="Write the last path as nav_msgs/Path (.json or .yaml)."
        ),
    ] = None,
    track: Annotated[
        Path | None,
        typer.Option(
            "--track",
            metavar="FILE",
            help="Write tracks of obstacles (.csv): t,x_m,y_m[,radius_m]; one file each.",
        ),
    ] = None,
    radius: Annotated[
        float | None,
        typer.Option("--obstacle-radius", metavar="M", help="Radius of the obstacles in the tracks."),
    ] = None,
    poses: Annotated[
        Path | None,
        typer.Option("--poses", metavar="FILE", help="Write poses of the robot (.csv): t,x_m,y_m,yaw."),
    ] = None,
    json_: Json = False,
    force: Force = False,
) -> None:
    """List the topics of a ROS 2 bag, or extract a map, a path, tracks of obstacles and poses of the robot."""
    from lampyris.io.maps.load import VALUES

    check_choice("VALUES", "--values", values, VALUES)
    check_outputs(force, map_out, export=export, csv=poses)
    wanted = [
        name
        for name, one in (("--map", map_out), ("--export", export), ("--track", track), ("--poses", poses))
        if one
    ]
    if topic is not None and len(wanted) != 1:
        what = f"--topic with {len(wanted)} outputs"
        raise UsageError("OPTIONS", what, allowed="one of --map, --export, --track, --poses")
    if radius is not None and not 0.0 <= radius <= 1e6:
        raise UsageError(
            "TRAFFIC_RADIUS", f"{radius:g}", where="--obstacle-radius", allowed="0 to 1e6 metres"
        )
    if radius is not None and track is None:
        raise UsageError("OPTIONS", "--obstacle-radius without --track", allowed="with --track")
    from lampyris.ros.bags.reader import open_bag

    written: list[Path] = []
    with open_bag(file) as found:
        if map_out is not None:
            from lampyris.io.maps.save import save_map

            grid = found.grid(topic, costs=values == "costmap")
            save_map(grid, map_out, values="costmap" if grid.terrain is not None else None)
            written.append(map_out)
        if export is not None:
            written.append(_export(found, topic, export))
        if track is not None:
            written += _tracks(found, topic, track, radius, force)
        if poses is not None:
            _poses(found, topic, poses)
            written.append(poses)
        record = {
            "bag": str(file), "start_s": found.start, "duration_s": found.duration,
            "topics": [one._asdict() for one in found.topics], "written": [str(one) for one in written],
        }  # fmt: skip
    if json_:
        print_json(record)
        return
    if not wanted:
        _list(record)
    print_written(*written)


def _list(record: dict[str, Any]) -> None:
    text.line(f"{record['bag']}: {record['duration_s']:.3f} s", style="bold")
    rows = [(one["name"], one["kind"], str(one["messages"])) for one in record["topics"]]
    text.table("", ("topic", "type", "messages"), rows, right=("messages",))


def _export(found: Bag, topic: str | None, out: Path) -> Path:
    from lampyris.ros.path_export import export_path

    paths = found.paths(topic)
    if not paths:
        raise UsageError("TOPIC", "the topic has no path", where=str(out), allowed="a topic with messages")
    if len(paths) > 1:
        print_notes((f"the last of {len(paths)} paths",))
    if paths[-1].frame not in ("", "map"):
        print_notes((f"the path is in the frame {paths[-1].frame}",))
    export_path(paths[-1].poses, out)
    return out


def _tracks(found: Bag, topic: str | None, out: Path, radius: float | None, force: bool) -> list[Path]:
    from lampyris.io.tracks.timed_tracks import write_timed_track

    made = found.tracks(topic, radius=radius)
    if not made:
        raise UsageError(
            "TOPIC", "no obstacle in that topic", where=str(out), allowed="a topic with obstacles"
        )
    names = ["".join(c if c.isalnum() or c in "-_" else "_" for c in one.name) for one in made]
    files = [out] if len(made) == 1 else [out.with_name(f"{out.stem}-{name}{out.suffix}") for name in names]
    for file in files:
        check_outputs(force, csv=file)
    for one, file in zip(made, files, strict=True):
        write_timed_track(file, one.track)
    return files


def _poses(found: Bag, topic: str | None, out: Path) -> None:
    from lampyris.io.files import write_file

    rows = [",".join(map(repr, row)) for row in found.poses(topic).tolist()]
    write_file(out, ("\n".join(["t,x_m,y_m,yaw", *rows]) + "\n").encode())
