"""Verification: whether a picture of the GPU is what the float64 reference says that it may be."""
