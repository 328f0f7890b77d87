"""Settings of the ROS 2 node."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris._core.settings import check_settings, flag, number, under_name


@dataclass(frozen=True, slots=True)
class NodeSettings:
    """How the node drives the robot.

    Parameters
    ----------
    rate : velocity commands per second.
    margin : additional distance of planned paths from walls, beyond the robot's outline.
    data_timeout : age of the last new /odom after which the robot is stopped.
    obstacle_timeout : age of the last message about obstacles, once there was one, after which the robot is stopped. 0: it
        may be of any age.
    patience : time that the robot stands because of obstacles before a path around them is planned.
    goal_tolerance : distance from the end of the path at which the robot is at the goal.
    yaw_tolerance : error of the heading at which a turn in place is done.
    stamped : publish TwistStamped on /cmd_vel, as Nav2 does from Kilted on, in place of Twist.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    rate: float = number(20.0, 1.0, 1000.0, unit="Hz")
    margin: float = number(0.05, 0.0, 10.0, unit="m")
    data_timeout: float = number(0.3, 1e-3, 60.0, unit="s")
    obstacle_timeout: float = number(2.0, 0.0, 3600.0, unit="s")
    patience: float = number(3.0, 0.0, 3600.0, unit="s")
    goal_tolerance: float = number(0.1, 1e-3, 10.0, unit="m")
    yaw_tolerance: float = number(0.05, 1e-3, 3.2, unit="rad")
    stamped: bool = flag(False)

    def __post_init__(self) -> None:
        check_settings(self, under_name("node"))
