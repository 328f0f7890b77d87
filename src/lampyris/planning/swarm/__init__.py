"""Swarm planners: glowworms, particles and ants over paths, and the baselines of the dissertation."""
