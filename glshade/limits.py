"""Limits: the amount of work that a scene file may ask for, counted before the work begins, and the files that it may reach.

A small file can ask for much: one line cuts a mesh into a billion triangles. So a file that comes from a stranger is refused
unless its user raises the limit. docs/security.md lists the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

# The sizes of files [bytes]. A larger file of its kind is refused before it is read.
# A scene of 16 MiB has a quarter of a million objects; Python's parser of TOML takes half a minute for it.
LARGEST_SCENE = 16 << 20
# The cameras of 300,000 pictures. The points that COLMAP lists with its pictures need most of the file, too.
LARGEST_CAMERAS = 256 << 20
# The largest file that ships with glshade has 8 kB.
LARGEST_SHADER = 1 << 20
# A mesh file is read as a whole into memory.
LARGEST_MESH = 4 << 30
# A file of measured reflectance: one of the MERL database has 35 MB. As text, 32 MiB hold 100,000 samples of 31 wavelengths.
LARGEST_MEASURED, LARGEST_MEASURED_TEXT = 64 << 20, 32 << 20

# The nesting of lists and tables in a document. The deepest value of the format, a number of a matrix, lies at depth 6.
DEEPEST_DOCUMENT = 64
# The absolute values of a document's numbers, other than 0. The squares and cubes of these still fit into float64.
SMALLEST_NUMBER, LARGEST_NUMBER = 1e-100, 1e100
# The length of a chain of parents. Every object multiplies the transforms of its whole chain.
LONGEST_CHAIN = 256
# The parts that are drawn, which take about 0.2 ms each on a CPU.
MOST_INSTANCES = 100_000
# The pixels that a texture may have for each byte of its file, if it has more than `max_texels`. A photograph has about 5.
TEXELS_PER_BYTE = 16
# The corners of a polygon that is not convex. The time to cut it into triangles grows with their square, to some seconds here.
MOST_CORNERS = 10_000
# The files of materials that an OBJ file may name.
MOST_LIBRARIES = 1000
# The faults that a message lists.
MOST_FAULTS = 50
# The pictures of a batch. Each takes about 2 kB of memory before the first is drawn.
MOST_TASKS = 100_000


@dataclass(frozen=True)
class Limits:
    """The limits that an option of the command line, or an argument of `glshade.load`, can raise.

    allow_outside: whether a mesh file may name files outside its folder and the folders that the scene names.
    max_triangles: the number of triangles that are drawn, beside those that mesh files store one by one.
    max_pixels: the number of pixels of a picture that are shaded: the size of its window, times supersample^2.
    max_texels: the number of pixels of all textures together.
    """

    allow_outside: bool = False
    # The most that 2 GB of memory hold if each triangle has vertices of its own.
    max_triangles: int = 1 << 21
    # A picture of 4K in 16 shifted copies. A float picture of this size takes 1.6 GB.
    max_pixels: int = 1 << 27
    # A texture takes up to 45 bytes a pixel while it is read.
    max_texels: int = 1 << 25


# The limits of a scene that was read from a file.
DEFAULT = Limits()
# The limits of a scene that was built in Python: its author has no reason to attack the own machine.
UNLIMITED = Limits(max_triangles=1 << 62, max_pixels=1 << 62, max_texels=1 << 62)
