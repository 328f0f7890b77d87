"""Nouns as plain data, tables and CSV."""
