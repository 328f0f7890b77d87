"""The loop: sense, plan, step, record."""
