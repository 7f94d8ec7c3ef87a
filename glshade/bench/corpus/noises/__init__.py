"""Noises: differences that a right driver may make, which a comparison of pictures should pass.

Every module of this package adds its kinds to `kinds.NOISES` when it is imported. A new module is found by its presence.
"""

from importlib import import_module
from pathlib import Path

from glshade.bench.corpus.kinds import NOISES as NOISES

for _module in sorted(path.stem for path in Path(__file__).parent.glob("[!_]*.py")):
    import_module(f"{__name__}.{_module}")
