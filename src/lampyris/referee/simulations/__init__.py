"""Rules of simulations in ticks: edited maps, what a sensor saw, a goal that moves."""
