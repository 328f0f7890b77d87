"""Which cells of a grid a shape covers."""
