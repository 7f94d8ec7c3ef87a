"""Textures: what a scene may say of a picture on a surface, and the texels that are uploaded."""
