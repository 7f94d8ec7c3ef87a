"""A third renderer: a small ray tracer, written from the rules in docs/, which shares no code with glshade.

The renderer on the GPU and the float64 reference share the code that reads scenes, builds meshes and places cameras and lights.
A fault in that code changes both pictures alike. This ray tracer reads the same scene as a plain dict and has its own code for
everything, so its picture stays right. It leaves out blending, cut-outs, mipmaps, framing, quality and five of the models.

A scene is a dict as TOML or JSON gives it, with absolute paths of files. Arrays are float64. N stands for a number of points, T
for a number of triangles.
"""

from support.third.picture import Trace, trace

__all__ = ["Trace", "trace"]
