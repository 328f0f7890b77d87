"""``lampyris drive``: among moving obstacles in continuous time, by one controller or several."""
