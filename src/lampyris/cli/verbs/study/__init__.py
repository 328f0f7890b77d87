"""``lampyris study``: many runs from one small file, kept, counted and compared."""
