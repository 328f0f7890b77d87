"""Verbs of the cost-to-goal field: solve it, find its gates, measure clearance."""
