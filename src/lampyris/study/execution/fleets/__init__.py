"""Runs of studies of fleets: how they are done, what a worker says of them, and how it is judged."""
