"""The printed tables of the dissertation, each with a verdict on every figure."""
