"""``lampyris chain``: motions of a planar chain of links among obstacles."""
