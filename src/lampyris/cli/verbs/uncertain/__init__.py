"""``lampyris uncertain``: what uncertain settings do to the time, length or energy of a planned drive."""
