"""Map file formats: one module a format, and the document that all of them read into."""
