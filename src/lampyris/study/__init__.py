"""Studies: many runs of many planners in the same worlds, kept, counted and compared."""
