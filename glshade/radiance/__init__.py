"""Radiance: the light that points of a surface show to the viewer, computed in float64."""
