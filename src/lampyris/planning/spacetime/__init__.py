"""Search in space and time among obstacles whose tracks are known: SIPP and space-time A*."""
