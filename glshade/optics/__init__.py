"""Optics: physical functions in float64 that several reflectance models share."""
