"""Faults: what could be wrong with a picture of a scene, such as a light that is missing or a normal that points away.

Each source of faults is a function that takes a `Fitting` and yields what the pixels would show with each fault, as the float64
reference computes it.
"""
