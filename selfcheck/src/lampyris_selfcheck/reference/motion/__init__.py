"""References of speeds, sight and simulations."""
