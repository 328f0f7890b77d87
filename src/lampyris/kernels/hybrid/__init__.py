"""Loops over continuous poses."""
