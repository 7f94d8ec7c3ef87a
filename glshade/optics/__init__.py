"""Optics: float64 physics that several reflectance models share."""
