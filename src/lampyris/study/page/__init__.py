"""The page of a study: text, figures, films."""
