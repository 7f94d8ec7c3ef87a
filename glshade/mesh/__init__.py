"""Meshes: triangles with their normals, tangents and order; shapes by formula; files."""
