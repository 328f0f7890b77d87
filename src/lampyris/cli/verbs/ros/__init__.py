"""``lampyris bag`` and ``lampyris ros``: bags and a node of ROS 2."""
