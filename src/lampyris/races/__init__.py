"""Races: several planners in one scene, with what each looked at."""
