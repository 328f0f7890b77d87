"""Values of multi-robot planning: agents, fleets, joint plans."""
