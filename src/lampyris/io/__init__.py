"""Files to nouns and back: maps, scenarios, obstacle tracks, paths."""
