"""Loops of robot swarms: neighbours and leaders; discs that move without touching."""
