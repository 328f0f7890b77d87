"""Pictures of maps with paths."""
