"""GLSL: which programs a scene needs, their text, and the values that they are given. No OpenGL here."""
