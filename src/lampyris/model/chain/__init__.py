"""Values of chains of links: the chain, and plans for it."""
