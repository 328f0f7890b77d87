"""Loops over chains of links: collisions of their links, trees of configurations."""
