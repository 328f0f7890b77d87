"""Checks of readers and writers: mutated files, maps of every format."""
