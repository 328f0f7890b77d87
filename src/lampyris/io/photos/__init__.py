"""From a photograph's file to its grey levels."""
