"""GLSL: the programs that a scene needs, their text and the values of their uniforms. Nothing here calls OpenGL."""
