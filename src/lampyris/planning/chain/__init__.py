"""Planning for chains of links: trees of configurations."""
