"""Fleets and swarms of robots, as frames for the page."""
