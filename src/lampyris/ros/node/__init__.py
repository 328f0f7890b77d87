"""The node of ROS 2: its core, its controller, and what carries its messages."""
