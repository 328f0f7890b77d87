"""Loops of episodes: many robots that each drive for themselves, one action a call."""
