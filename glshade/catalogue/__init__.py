"""Catalogue: lists what models, lights and presets declare, and plots how models reflect light."""
