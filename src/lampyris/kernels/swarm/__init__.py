"""Loops of robot swarms: who follows whom, and discs that drive without touching."""
