"""Corpus: pairs of pictures of which is known whether they should pass a comparison, and the table of what tools say of them.

A pair is a scene's baseline and a test picture. The test picture is either a `Regression`, which a comparison should find, or
`Noise`, which a right OpenGL driver may make and a comparison should pass. `making` writes the pairs to a folder, `judges` are
the tools that judge them, and `table` counts what they find.
"""
