"""Radiance: float64 light at points of a surface."""
