"""From a photograph to a grid: thresholds between its grey levels, and cells by the majority of their pixels.

:mod:`lampyris.photos.criteria` says what thresholds are worth, :mod:`lampyris.photos.exact` finds the best by dynamic
programming, :mod:`lampyris.photos.swarm` looks for them with glowworms or particles, :mod:`lampyris.photos.cells`
makes cells of pixels, and :mod:`lampyris.photos.segment` is the public call.
"""
