"""From a file or a name to a Grid."""
