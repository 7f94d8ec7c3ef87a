"""SPIR-V: runs GLSL in NumPy, in float64, in float32, or with every operation rounded at random.

`compiler` turns a stage's text into SPIR-V by glslangValidator. `reader` reads the binary into a `Module`, and `machine` runs
the module over arrays of inputs: a lane for each vertex or pixel.
"""
