"""Incremental search: D*, Focussed D*, LPA* and D* Lite."""
