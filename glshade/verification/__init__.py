"""Verification: checks that a picture drawn by the GPU lies within the bounds that the float64 reference allows."""
