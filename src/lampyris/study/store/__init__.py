"""The store of a study: its rows in one SQLite file."""
