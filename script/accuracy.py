"""docs/accuracy.md: for each model the bound over its whole domain, and what was measured. Called by script/make-accuracy.

The cases and the measure are those of the contract tests (tests/extremes.py), more of them.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from extremes import (  # noqa: E402
    FACTOR,
    ORDINARY,
    STAGES,
    Worst,
    at_extremes,
    exact,
    in_conditioning,
    joined,
    measured,
    ordinary,
    pairs,
    relative,
)
from pages import table, write  # noqa: E402

from glshade import BRDFS, Renderer  # noqa: E402
from glshade.brdfs import Brdf  # noqa: E402

PAGE = ROOT / "docs" / "accuracy.md"
# Materials of a model: those at the extremes beyond the walk of each parameter alone, and those within the usual ranges.
EXTREME, USUAL = 200, 100
# Ordinary directions: as high above the horizon as this.
HIGH = 0.05

TEXT = """\
# How exact the models are

<!-- Made by script/make-accuracy, which measures; change that, not this. -->

Each model's `brdf_cos` runs on the GPU in float32 and, from the same float32 inputs, on the CPU in float64. Nothing is clamped
before the two are compared, and a value that is not finite is a failure, not a figure.

Driver: {driver}. `glshade doctor` tells what another one makes of the functions that this rests on.

## Over a model's whole domain

Every parameter from its least to its greatest value (exponents to 1e8, strengths without a bound to {strong:g}), every pair of
directions, the horizon and what lies 1e-30 above it included:

    |gpu - float64|  <=  {factor:g} x conditioning{exceptions}

The conditioning is what rounding the inputs to float32 does to the float64 value: each component of l and v and each parameter
by half an ulp, the normal by 2^-25 rad to its worst side, these moves added up, and half an ulp of the result. A program in
float32 can hardly promise less than 1. Below 2^-126 stages flush to zero, and that is no error.

Parameters are those that are not the model's defaults. The last two columns are the error relative to max(1, f cos) where it
was worst in units of the conditioning, and where it was worst of all: large where the problem itself is hardly determined, as
a step at the horizon is.

{extreme}
## At ordinary parameters

The usual range of each parameter (in [scene-file.md](scene-file.md)), both directions more than {high:g} above the horizon: the
error relative to max(1, f cos). Where a model is worse than its bound in some rare direction, it is within {factor:g} x
conditioning there.

{ordinary}"""


def bounds(name: str) -> float:
    """What the contract holds the model to, in units of the conditioning."""
    sys.path.insert(0, str(ROOT / "tests" / "contracts"))
    from test_extremes_conditioning import EXCEPTIONS

    return EXCEPTIONS.get(name, (FACTOR, ""))[0]


def page() -> str:
    """The text of docs/accuracy.md, measured now."""
    from extremes import STRONG

    l, v, case = joined(pairs())
    usual = (l[:, 2] > HIGH) & (v[:, 2] > HIGH)
    extremes, usuals = [], []
    with Renderer() as renderer:
        driver = f"{renderer.context.renderer}; {renderer.context.version}"
        for name in BRDFS:
            extreme, common = ({stage: Worst() for stage in STAGES} for _ in range(2))
            worst, there = Worst(), ("-", "-", 0.0)
            for material in at_extremes(name, EXTREME):
                value, conditioning = exact(material, l, v)
                for stage in STAGES:
                    gpu = measured(material, stage, renderer, l, v)
                    error, share = relative(gpu, value), in_conditioning(gpu, value, conditioning)
                    worst.add(error, lambda i: "")
                    before = max(w.value for w in extreme.values())
                    extreme[stage].add(share, lambda i: "")
                    if extreme[stage].value > before:
                        i = int(np.argmax(share.max(axis=1)))
                        there = (str(case[i]), parameters(material), float(error[i].max()))
            for material in ordinary(name, USUAL):
                value, _ = exact(material, l[usual], v[usual])
                for stage in STAGES:
                    common[stage].add(relative(measured(material, stage, renderer, l[usual], v[usual]), value), lambda i: "")
            figures = [f"{extreme[stage].value:.2f}" for stage in STAGES]
            extremes.append((f"`{name}`", f"{bounds(name):g}", *figures, *there[:2], f"{there[2]:.1e}", f"{worst.value:.1e}"))
            usuals.append((f"`{name}`", f"{ORDINARY:g}", *(f"{common[stage].value:.1e}" for stage in STAGES)))
    own = ", ".join(f"{name}: {bounds(name):g}" for name in BRDFS if bounds(name) != FACTOR)
    return TEXT.format(
        driver=driver,
        strong=STRONG,
        factor=FACTOR,
        exceptions=f"    ({own})" if own else "",
        high=HIGH,
        extreme=table(
            ("model", "bound", *STAGES, "worst case", "parameters", "error there", "largest error"),
            extremes,
        ),
        ordinary=table(("model", "bound", *STAGES), usuals),
    )


def parameters(material: Brdf) -> str:
    """The scalars and options of a material that are not its model's defaults, in a few words."""
    model = type(material)
    names = [*(name for name in model.parameters() if not model.is_colour(name)), *model.choices()]
    given = {name: getattr(material, name) for name in names}
    said = {name: value for name, value in given.items() if value != model.model_fields[name].default}
    return ", ".join(f"{name} {value if isinstance(value, str) else f'{value:g}'}" for name, value in said.items()) or "-"


def models(text: str) -> list[list[str]]:
    """The models that have a row in each of the page's tables."""
    return [re.findall(r"^\| `(\w+)` \|", part, flags=re.MULTILINE) for part in text.split("\n## ")[1:]]


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        current = PAGE.exists() and models(PAGE.read_text(encoding="utf-8")) == [list(BRDFS)] * 2
        sys.exit(0 if current else "docs/accuracy.md has other models than glshade/brdfs: run script/make-accuracy")
    write(PAGE, page())
