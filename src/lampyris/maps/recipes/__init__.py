"""One file for each way of making maps; :mod:`lampyris.maps.make` holds their table."""
