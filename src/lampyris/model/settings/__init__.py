"""Settings of simulations and drives; each is declared once (:mod:`lampyris._core.settings`)."""
