"""Good files of every format, their mutants, and what reading one does to the world."""
