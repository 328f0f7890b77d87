"""Episodes of robots that an agent drives action by action, many at once; environments are in :mod:`lampyris.rl`."""
