"""Values of robot swarms: sources of a signal, and the trace of a swarm that looks for them."""
