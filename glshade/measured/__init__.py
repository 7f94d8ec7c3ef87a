"""Measured: files of measured reflectance, the samples that they hold, and the table that is drawn from them."""
