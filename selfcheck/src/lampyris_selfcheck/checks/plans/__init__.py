"""Checks of planners that sample or search models of the map, of chains, photographs, uncertain settings, unknown maps."""
