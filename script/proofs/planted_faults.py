"""Each of thirty faults in code that both renderers share is caught by a law, by the ray tracer or by a test of the suite.

The proof prints a table of the faults: the verdict of `verify`, the laws that are broken on the fault's scene, and whether the
ray tracer of tests/support/third or a test of the suite notices the fault. Without the fault, nothing may be noticed.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from support.opinions import agreement
from support.planted import FAULTS, planted

from glshade import Renderer, Scene, verify
from glshade.verification.laws import check_laws

COUNT = len(FAULTS)
ROOT = Path(__file__).resolve().parent.parent.parent


def prove(count: int, seed: int) -> int:
    """Plants `count` faults, from the fault whose number is the seed on. Returns the number of faults that are not caught."""
    lost, by_law = 0, 0
    print("| fault | what is wrong | `verify` | laws | ray tracer | test |\n|---|---|---|---|---|---|")
    with TemporaryDirectory() as folder, Renderer() as renderer:
        for number in range(seed, seed + count):
            fault = FAULTS[number % len(FAULTS)]
            scene = fault.scene(Path(folder))
            sound = not _laws(scene) and agreement(scene).holds
            with planted(fault):
                verdict, laws, seen = _verdict(scene, renderer), _laws(scene), not agreement(scene).holds
                failing = _fails(fault.test) if fault.test else False
            test = f"`{fault.test.split('::')[-1]}`" if failing else ""
            words = ", ".join(laws)
            print(
                f"| {fault.name} | {fault.description} | {verdict} | {words} | {'yes' if seen else 'no'} | {test} |", flush=True
            )
            by_law += bool(laws)
            lost += not (sound and (laws or seen or failing))
    print(f"{by_law} of {count} faults break a law")
    return lost


def _verdict(scene: Mapping[str, Any], renderer: Renderer) -> str:
    """Returns the verdict of `verify`, whatever the number of pixels at edges."""
    return str(verify(Scene.model_validate(scene), renderer=renderer, max_ambiguous=1.0).verdict)


def _laws(scene: Mapping[str, Any]) -> list[str]:
    """Returns the names of the laws that are broken on a scene."""
    return [finding.law for finding in check_laws(Scene.model_validate(scene)) if finding.outcome == "broken"]


def _fails(test: str) -> bool:
    """Returns whether a test of the suite fails."""
    with contextlib.redirect_stdout(io.StringIO()):
        return pytest.main(["-q", "-x", "-p", "no:cacheprovider", str(ROOT / test)]) == pytest.ExitCode.TESTS_FAILED
