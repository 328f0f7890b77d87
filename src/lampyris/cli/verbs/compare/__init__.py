"""``lampyris compare``: a few planners and laws in the same world."""
