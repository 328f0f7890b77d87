"""Safety: speed caps from what is near, what is hidden and what may move."""
