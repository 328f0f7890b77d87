"""References for multi-robot planning: rules, joint spaces, searches of one robot among others."""
