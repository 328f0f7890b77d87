"""ROS 2: bags, messages, and a node that plans and drives.

Nothing of ROS is needed to import it. Bags need the extra ``ros`` (rosbags); the node needs rclpy, which every robot
with ROS 2 has, or the extra ``ros-live`` (cyclonedds and rosbags).
"""

from __future__ import annotations

from lampyris.ros.bags.reader import Bag, BagPath, BagTrack, open_bag
from lampyris.ros.bags.writer import write_bag
from lampyris.ros.path_export import export_path, path_poses

__all__ = ["Bag", "BagPath", "BagTrack", "export_path", "open_bag", "path_poses", "write_bag"]
