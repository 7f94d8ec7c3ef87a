"""The command line of script/prove."""

from __future__ import annotations

import argparse
import importlib
import math
import pkgutil
import sys
from time import perf_counter
from types import ModuleType

import proofs


def main() -> int:
    """Runs the proofs that the command line asks for, and returns the exit code."""
    found = sorted(info.name for info in pkgutil.iter_modules(proofs.__path__) if not info.name.startswith("_"))
    parser = argparse.ArgumentParser(prog="script/prove", description="Tries claims of the docs on many random inputs.")
    parser.add_argument("name", nargs="?", choices=found, help="the proof to run; without it, all are listed")
    parser.add_argument("--count", type=int, help="the number of inputs; the default is the whole proof")
    parser.add_argument("--seed", type=int, default=0, help="the seed from which the inputs follow")
    parser.add_argument("--share", type=float, help="run every proof on this share of its inputs, and on at least one")
    chosen = parser.parse_args()
    if chosen.share is None and chosen.name is None:
        for name in found:
            module = load(name)
            print(f"{name:<20} {module.COUNT:>6} inputs   {(module.__doc__ or '').splitlines()[0]}")
        return 0
    names = [chosen.name] if chosen.name else found
    broken = 0
    for name in names:
        module = load(name)
        count = chosen.count or math.ceil(module.COUNT * (chosen.share or 1))
        start = perf_counter()
        print(f"== {name}: {count} inputs, seed {chosen.seed}", flush=True)
        wrong = module.prove(count, chosen.seed)
        print(f"{name}: {wrong} of {count} inputs break the claim, {perf_counter() - start:.0f} s", flush=True)
        broken += wrong
    return int(broken > 0)


def load(name: str) -> ModuleType:
    """Returns the module of a proof."""
    return importlib.import_module(f"proofs.{name}")


sys.exit(main())
