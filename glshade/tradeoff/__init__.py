"""Tradeoff: what a scene's settings cost and what they are off by, and the cheapest that is good enough.

setting (knobs) -> study (time, errors by kind) -> front (what is worth having) -> page; budget chooses.
"""
