"""Batch: several pictures, made by workers of their own, so that what crashes takes one picture with it and no more."""
