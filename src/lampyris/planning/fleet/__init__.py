"""Planning for many robots on one map: prioritised SIPP, PIBT, LaCAM*, large neighbourhood search, CBS, EECBS."""
