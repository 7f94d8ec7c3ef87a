"""Batch: renders several pictures in worker processes, so that a driver crash costs at most one picture."""
