"""What the dissertation printed, what we get, and a verdict on every figure."""
