"""What ``lampyris fleet`` does with ``--execute`` and ``--lifelong``."""
