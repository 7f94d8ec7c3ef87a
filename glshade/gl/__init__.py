"""GL: the renderer on OpenGL. This is the only package that calls OpenGL: contexts, programs, vertices, textures and frames."""
