"""Speed laws: ours, the dissertation's, and the rivals', by name."""
