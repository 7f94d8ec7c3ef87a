"""Debug: shows what GLSL computes: traces of variables, and unit tests that are written in GLSL."""
