"""Nouns: frozen values handed from stage to stage. No algorithms, no input or output, no caches inside them.

Frames and units, said once: a *cell* is ``(x, y)`` = (column, row) with the origin at the top left.
*Metres* are in the map frame of ROS: x right, y up from the lower-left corner of the lower-left pixel,
turned by the origin's yaw. Lengths and costs without a unit in their name are in cells; names that end in
``_m`` are in metres.
"""
