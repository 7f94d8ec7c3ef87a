"""Driver: measures the OpenGL driver at hand: its arithmetic, pixel formats and rasteriser, and the cost of programs."""
