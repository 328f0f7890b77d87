"""Thresholds of sample pictures: the exact ones beside scikit-image's, and how near swarms come to them.

``python tools/segmentation_table.py [--runs N]`` needs scikit-image (``requirements/bench.txt``), whose wheel holds the
pictures. It prints the table of docs/photos.md: for each picture and number of thresholds the best ones, whether
``skimage.filters.threshold_multiotsu`` finds the same (up to 3: it takes minutes beyond), CPU milliseconds of both, and
of N runs of each swarm how many are exact and the worst share of the optimum.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image, ImageFilter
from skimage import data
from skimage.filters import threshold_multiotsu

from lampyris.io.maps.library import load
from lampyris.photos.segment import segment_photo

PICTURES = ("camera", "coins", "page", "text")
THRESHOLDS = (1, 2, 3, 5)
THEIRS_UP_TO = 3
SWARMS = ("gso", "igso", "pso")


def photograph(out: Path) -> None:
    """Write what a photograph of the bundled map rooms-20 might look like: unevenly lit, blurred, noisy; a JPEG."""
    blocked = load("rooms-20").grid.blocked.repeat(24, axis=0).repeat(24, axis=1)
    rng = np.random.default_rng(0)
    light = np.linspace(0.8, 1.1, blocked.shape[1])
    levels = np.where(blocked, 62.0, 176.0) * light + rng.normal(0.0, 14.0, blocked.shape)
    picture = Image.fromarray(np.clip(levels, 0.0, 255.0).astype(np.uint8))
    picture.filter(ImageFilter.GaussianBlur(2.0)).save(out, "JPEG", quality=85)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--runs", type=int, default=10, help="of each swarm, each with a seed of its own")
    parser.add_argument(
        "--photo", type=Path, help="write a made-up photograph to this file, and nothing else"
    )
    asked = parser.parse_args()
    if asked.photo is not None:
        photograph(asked.photo)
        return
    runs = asked.runs
    swarms = " ".join(f"{f'{name} exact, worst, ms':>26}" for name in SWARMS)
    print(f"{'picture':<8} {'k':>2} {'thresholds':<24} {'skimage':>8} {'ms':>7} {'its ms':>7} {swarms}")
    exact_runs = dict.fromkeys(SWARMS, 0)
    easy = 0
    for name in PICTURES:
        picture = getattr(data, name)()
        for k in THRESHOLDS:
            made = segment_photo(picture, thresholds=k)
            their_ms, same = "-", "-"
            if k <= THEIRS_UP_TO:
                began = time.process_time()
                theirs = threshold_multiotsu(picture, classes=k + 1)
                their_ms = f"{1e3 * (time.process_time() - began):.1f}"
                same = "same" if theirs.tolist() == list(made.thresholds) else "other"
            cells = []
            for by in SWARMS:
                found = [segment_photo(picture, thresholds=k, by=by, seed=seed) for seed in range(runs)]
                exact = sum(one.gap <= 0.0 for one in found)
                exact_runs[by] += exact if k <= THEIRS_UP_TO else 0
                worst = 1.0 - max(one.gap for one in found)
                ms = 1e3 * float(np.median([one.seconds for one in found]))
                cells.append(f"{f'{exact} of {runs}, {worst:.4f}, {ms:.0f}':>26}")
            easy += runs if k <= THEIRS_UP_TO else 0
            levels = ", ".join(map(str, made.thresholds))
            line = f"{name:<8} {k:>2} {levels:<24} {same:>8} {1e3 * made.seconds:>7.1f} {their_ms:>7} "
            print(line + " ".join(cells), flush=True)
    for by in SWARMS:
        print(f"{by}: {exact_runs[by]} of {easy} runs with up to {THEIRS_UP_TO} thresholds are exact")


if __name__ == "__main__":
    sys.exit(main())
