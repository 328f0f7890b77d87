"""What is said of the corners of a mesh of rectangles, one byte each: see :mod:`.rectangle_mesh`."""

TURN, PORT, LINE_X, LINE_Y, TOWARDS_X, TOWARDS_Y = 1, 2, 4, 8, 16, 32
