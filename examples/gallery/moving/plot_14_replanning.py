"""
Replanning with D* Lite
=======================

A session keeps its search: when cells become blocked, it repairs what they touch.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris
from lampyris.planning.incremental.dstar_lite import DStarLite

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46))
session = DStarLite().open(scene, np.random.default_rng(0))
before = session.plan(lampyris.Change(robot=scene.start))
wall = tuple((int(x), int(y)) for x, y in before.path.cells[30:34])
after = session.plan(lampyris.Change(robot=scene.start, blocked=wall))
ax = lampyris.plot.compare({"before": before.path, "after 4 cells became blocked": after.path}, scene.grid)
ax.set_title(f"{before.expansions} expansions, then {after.expansions}")
plt.show()
