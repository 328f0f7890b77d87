"""One file for each way of making maps; :mod:`lampyris.io.maps.recipes.make` holds their table."""
