"""Bags of ROS 2: written from plans and runs, and read."""
