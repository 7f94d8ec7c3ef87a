"""Mutations: faults that are put into programs and pictures on purpose, to test whether the verifier finds them.

Each module of this package without a leading underscore holds one mutation, under the name `MUTATION`. The module is named
after it, with an underscore for each character that a module name cannot have: "exponent-squared" is in exponent_squared.py.
"""

from importlib import import_module
from pathlib import Path

from glshade.verification.mutations._mutation import Mutation as Mutation

_MODULES = sorted(path.stem for path in Path(__file__).parent.glob("[!_]*.py"))
_ALL: list[Mutation] = [import_module(f"{__name__}.{module}").MUTATION for module in _MODULES]
# name -> mutation
MUTATIONS: dict[str, Mutation] = {mutation.name: mutation for mutation in _ALL}
