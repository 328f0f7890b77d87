"""Races of planners, as the page shows and films them."""
