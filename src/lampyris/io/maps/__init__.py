"""From a file or a name to a Grid: readers, bundled maps, seeded recipes, writers."""
