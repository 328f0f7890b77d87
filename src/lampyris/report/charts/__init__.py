"""Charts as matplotlib figures and as SVG."""
