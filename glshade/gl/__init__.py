"""The only rooms that speak to OpenGL: context, program, vertices, textures, frame, renderer."""
