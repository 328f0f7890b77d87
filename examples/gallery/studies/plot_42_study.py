"""
A study from Python
===================

Planners x seeds in one table, with what each run did.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt

import lampyris

FILE = """
version: 1
name: gallery
maps: [{bundled: env-3, queries: {random: 3, least: 25}}]
planners: [ad-gso, astar, sipp]
traffic: [{kind: random-walk, count: 20}]
seeds: 5
"""
with TemporaryDirectory() as folder:
    file = Path(folder, "study.yaml")
    file.write_text(FILE)
    table = lampyris.run_study(lampyris.load_study(str(file)))
figure, ax = plt.subplots(figsize=(7, 4), constrained_layout=True)
ticks = {}
for name, n, ok in zip(table["planner"], table["ticks"], table["arrived"], strict=True):
    if ok:
        ticks.setdefault(name, []).append(n)
ax.boxplot(list(ticks.values()), tick_labels=list(ticks))
ax.set_ylabel("ticks until arrival")
plt.show()
