"""Films of simulations and drives."""
