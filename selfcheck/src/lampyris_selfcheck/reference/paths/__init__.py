"""References of fields, paths, replanning and swarms."""
