"""IR-SIM (``pip install ir-sim``): its maps as grids, and our planners in the shape of its own.

Nothing of IR-SIM is imported: what its planners are given is taken by its attributes.
"""

from lampyris.irsim.maps import grid_of as grid_of
from lampyris.irsim.planner import IrsimPlanner as IrsimPlanner

__all__ = ["IrsimPlanner", "grid_of"]
