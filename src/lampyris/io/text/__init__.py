"""Strict readers of CSV, JSON and YAML: every error has its line and column."""
