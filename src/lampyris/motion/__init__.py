"""From a Path to a Profile: small speed caps, their minimum taken once, then made feasible."""
