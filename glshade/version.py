"""Version: the one place that says which glshade this is."""

__version__ = "0.1.0"
