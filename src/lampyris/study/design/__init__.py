"""The design of a study: its file, its schema, its jobs."""
