"""Driver: what the OpenGL driver at hand does and what it costs, by measurement."""
