"""``lampyris ros``: a node of ROS 2 that plans and drives.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from lampyris._core.defaults import NODE_LAW
from lampyris.cli.option_errors import check_choice
from lampyris.cli.option_groups import PlannerOptions, RobotOptions, group_of, settings_in
from lampyris.cli.options import SetLaw
from lampyris.errors import UsageError
from lampyris.model.settings.ros_node import NodeSettings

if TYPE_CHECKING:
    NodeOptions: TypeAlias = Any
else:
    NodeOptions = group_of("NodeOptions", NodeSettings)

TRANSPORTS = ("auto", "rclpy", "dds")


def ros(
    robot_options: RobotOptions,
    planning: PlannerOptions,
    node_options: NodeOptions,
    law: Annotated[
        str,
        typer.Option("--law", metavar="NAME", help="The speed law, one in m/s: see `lampyris laws`."),
    ] = NODE_LAW,
    set_law: SetLaw = None,
    transport: Annotated[
        str,
        typer.Option(
            "--transport",
            metavar="auto|rclpy|dds",
            help="rclpy, or Cyclone DDS (topics only); auto: rclpy if it is installed.",
        ),
    ] = TRANSPORTS[0],
    name: Annotated[str, typer.Option("--name", metavar="NAME", help="Name of the node.")] = "lampyris",
    domain: Annotated[
        int | None,
        typer.Option("--domain", metavar="N", min=0, max=232, help="DDS domain (default: ROS_DOMAIN_ID)."),
    ] = None,
    remap: Annotated[
        list[str] | None,
        typer.Option(
            "--remap", metavar="FROM:=TO", help="Rename a topic, such as /odom:=/robot/odom; repeatable."
        ),
    ] = None,
    services: Annotated[
        bool | None,
        typer.Option(
            "--services/--no-services", help="Offer GetPlan and Nav2's actions (default: with rclpy)."
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", metavar="S", help="End after this time (default: run until interrupted)."),
    ] = None,
) -> None:
    """Run a ROS 2 node: /map, /odom and /goal_pose in; /plan, /cmd_vel and the speed profile with its causes out."""
    check_choice("TRANSPORT", "--transport", transport, TRANSPORTS)
    if seconds is not None and not seconds > 0.0:
        raise UsageError("SECONDS", f"{seconds:g}", where="--seconds", allowed="more than 0")
    from lampyris.cli.request import parse_law, parse_settings
    from lampyris.io.scenario.robot_file import read_robot
    from lampyris.model.robot import Robot
    from lampyris.ros.node.navigator import Navigator
    from lampyris.ros.node.process import run, transport_named

    given = settings_in(robot_options, Robot)
    if robot_options.robot_file is not None:
        given["footprint"] = read_robot(robot_options.robot_file).get("footprint")
    navigator = Navigator(
        Robot(**given), NodeSettings(**settings_in(node_options, NodeSettings)),
        planner=planning.planner, planner_settings=parse_settings(planning.planner, planning.settings or []),
        law=law, law_settings=parse_law(law, set_law or []), renamed=_renamed(remap or []),
    )  # fmt: skip
    carried = transport_named(transport, name, domain)
    try:
        if services or (services is None and carried.services):
            carried.serve(navigator)
        topics = ", ".join(one.name for one in navigator.topics)
        offered = getattr(carried, "offered", [])
        print(
            f"node /{name} by {type(carried).__name__}: {topics}",
            *offered,
            sep="\n  ",
            file=sys.stderr,
            flush=True,
        )
        run(
            navigator,
            carried,
            seconds=seconds,
            said=lambda status: print(status, file=sys.stderr, flush=True),
        )
    finally:
        carried.close()


def _renamed(words: list[str]) -> dict[str, str]:
    from lampyris.ros.node.topics import TOPICS

    names = [one.name for one in TOPICS]
    made: dict[str, str] = {}
    for word in words:
        old, mark, new = word.partition(":=")
        if not mark or old not in names or not new.startswith("/"):
            raise UsageError(
                "TOPIC", repr(word), where="--remap", allowed=f"FROM:=TO, FROM one of {', '.join(names)}"
            )
        made[old] = new
    return made
