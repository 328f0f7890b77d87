"""Searches whose order knows what headings cost where there are no walls."""
