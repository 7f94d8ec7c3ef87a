"""Catalogue: what models, lights and presets declare, and figures of what they do with light."""
