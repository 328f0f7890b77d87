"""
A map of a photograph
=====================

Thresholds between grey levels that maximise Otsu's criterion exactly; the bright class is free.
"""

from pathlib import Path

import matplotlib.pyplot as plt
from PIL import Image

import lampyris

here = Path.cwd().resolve()
photo = next(p / "docs/img/photo.jpg" for p in (here, *here.parents) if (p / "docs/img/photo.jpg").exists())
made = lampyris.segment_photo(str(photo), thresholds=2, cell=2)
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), constrained_layout=True)
left.imshow(Image.open(photo))
left.set_axis_off()
lampyris.plot.grid(made.grid, ax=right)
right.set_title(f"thresholds {', '.join(map(str, made.thresholds))}")
plt.show()
