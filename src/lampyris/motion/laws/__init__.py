"""Speed laws: ours, the dissertation's, and the baselines, by name."""
