"""Textures: the keys of textures in a scene file, and the texels and mipmaps that are uploaded."""
