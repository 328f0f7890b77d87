"""The referee of many robots."""
