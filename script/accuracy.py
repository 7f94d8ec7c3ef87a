"""Writes docs/accuracy.md: each model's error bound over its whole domain, and its measured errors. script/make-accuracy calls
it.

The cases and the measure of error are those of the contract tests (tests/support/extremes.py), with more cases.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from pages import table, write  # noqa: E402
from support.extremes import (  # noqa: E402
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

from glshade import BRDFS, Renderer  # noqa: E402
from glshade.brdfs import Brdf  # noqa: E402
from glshade.catalogue.digits import digits_of_model  # noqa: E402
from glshade.spirv.digits import MENTIONED, LineLoss  # noqa: E402

PAGE = ROOT / "docs" / "accuracy.md"
# How many materials of each model are measured: at the extremes, in addition to those that vary a single parameter, and within
# the usual ranges.
EXTREME, USUAL = 200, 100
# Ordinary directions have at least this cosine to the normal.
HIGH = 0.05

TEXT = """\
# How exact the models are

<!-- Made by script/make-accuracy, which measures the figures. To change words, change script/accuracy.py, not this page. -->

Each model's `brdf_cos`, which returns the BRDF times the cosine n.l, runs on the GPU in float32 and, with the same float32
inputs, on the CPU in float64. Neither result is clamped before the two are compared. A value that is not finite counts as a
failure.

Driver: {driver}. These figures depend on the driver's mathematical functions; `glshade doctor` measures those of your driver.

## Over a model's whole domain

The cases cover every parameter from its smallest to its largest value (exponents up to 1e8, strengths that have no upper bound
up to {strong:g}) and every pair of directions, including directions in the horizon (the plane of the surface) and directions
1e-30 above it. The promise is

    |gpu - float64|  <=  {factor:g} x conditioning{exceptions}

The conditioning is the change of the float64 value that rounding the inputs to float32 may cause. It is a sum. Each component
of l and v and each parameter is moved by half an ulp, the normal is turned by 2^-25 rad in the direction that matters most, and
the changes of the value are added up, with half an ulp of the result. No float32 program can promise much less than 1 x
conditioning. Results below 2^-126 may become 0.

The columns "bound", "vertex" and "fragment" are in units of the conditioning: the promise, and the largest error in each shader
stage. The next columns describe the case with this error, the worst case: its directions, those of its parameters that differ
from the model's defaults, and its error relative to max(1, f cos). The last column is the largest error of all cases, relative
to max(1, f cos). An error is large where the problem itself is badly conditioned, which means that a small change of the inputs
changes the value a lot, for example at a step at the horizon.

{extreme}
## At ordinary parameters

The cases cover the usual range of each parameter (in [scene-file.md](scene-file.md)) and directions whose cosine to the normal
is above {high:g}. The errors are relative to max(1, f cos). In rare directions a model may exceed its bound; its error there is
within {factor:g} x conditioning.

{ordinary}"""

DIGITS = """\
## Line by line

`glshade digits` ([digits.md](digits.md)) runs each model's GLSL at random parameters and directions of its whole domain, and
rounds the operations of one line at a time as float32 rounds them. The table has the lines that change the result by more than
{mentioned:g} where rounding the inputs changes it by less than a quarter of that. The column "exact functions" is the change if
built-in functions err by no more than an addition does. Changes are relative to the result; values below 0.001 count as 0.001.

{lines}"""

# (file, text of a line that is to blame) -> the reason for which it stays.
REASONS = {
    ("math/cos_half.glsl", "return c > 0.7 ? 1.0 - 0.25 * dot(q, q) / (1.0 + c) : c;"): (
        "Total reflection starts at a cosine of 0.9999 where eta is near 0.01 and k is 0. Fresnel's reflectance changes there "
        "like a square root. No metal has such an index."
    ),
}
# Built-in functions, and the division, to which OpenGL allows more than the error of a rounding.
FUNCTIONS = re.compile(r"\b(sqrt|inversesqrt|length|normalize|pow|exp2?|log2?)\(|(?<!/)/(?!/)")


def bounds(name: str) -> float:
    """Returns the bound that the contract tests check for the model, in units of the conditioning."""
    sys.path.insert(0, str(ROOT / "tests" / "contracts"))
    from test_extremes_conditioning import EXCEPTIONS

    return EXCEPTIONS.get(name, (FACTOR, ""))[0]


def page() -> str:
    """Returns the text of docs/accuracy.md, measured now."""
    from support.extremes import STRONG

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
    measured_text = TEXT.format(
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
    return f"{measured_text}\n{digits()}"


def digits() -> str:
    """Returns the section about the digits that lines lose, measured now. Errors: KeyError for a line without a reason."""
    rows = []
    for name, loss in lost():
        file, line = where(loss)
        reason = REASONS[file, loss.text] if loss.to_blame else allowed(loss.text)
        figures = (f"{x:.1e}" for x in (loss.loss, loss.formula, loss.inputs))
        rows.append((f"`{name}`", f"{file}:{line}", *figures, f"`{loss.text}`", reason))
    heading = ("model", "line", "loses", "exact functions", "rounded inputs", "text", "reason")
    return DIGITS.format(mentioned=MENTIONED, lines=table(heading, rows))


def lost() -> list[tuple[str, LineLoss]]:
    """Returns (model, line) for the lines that lose more than MENTIONED and more than rounding the inputs does."""
    found = ((name, digits_of_model(model).lines) for name, model in BRDFS.items())
    return [(name, loss) for name, lines in found for loss in lines if loss.loss > MENTIONED and not loss.ill_posed]


def where(loss: LineLoss) -> tuple[str, int]:
    """Returns the file below shaders/, and the line in it."""
    file, _, line = loss.place.rpartition(":")
    return Path(file).relative_to(ROOT / "shaders").as_posix(), int(line)


def allowed(text: str) -> str:
    """Returns the reason for which a line is not to blame: the functions to which OpenGL allows larger errors."""
    names = dict.fromkeys(f"`{match[1]}`" if match[1] else "a division" for match in FUNCTIONS.finditer(text.split("//")[0]))
    return f"OpenGL allows {' and '.join(names)} more than a rounding."


def moved(text: str) -> list[str]:
    """Returns the rows of the page's last table whose text does not stand at their place in shaders/."""
    rows = re.findall(r"^\| `\w+` \| ([\w./]+):(\d+) \|.*?\| `(.*)` \|", text, flags=re.MULTILINE)
    stale = []
    for file, line, quoted in rows:
        path = ROOT / "shaders" / file
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        if int(line) > len(lines) or lines[int(line) - 1].strip() != quoted.replace("\\|", "|"):
            stale.append(f"{file}:{line}")
    return stale or ([] if rows else ["no line"])


def parameters(material: Brdf) -> str:
    """Returns the scalars and options of a material that differ from the defaults, as text; "-" where none does."""
    model = type(material)
    names = [*(name for name in model.parameters() if not model.is_colour(name)), *model.choices()]
    given = {name: getattr(material, name) for name in names}
    said = {name: value for name, value in given.items() if value != model.model_fields[name].default}
    return ", ".join(f"{name} {value if isinstance(value, str) else f'{value:g}'}" for name, value in said.items()) or "-"


def models(text: str) -> list[list[str]]:
    """Returns the names of the models that have a row, for each table of the page."""
    return [re.findall(r"^\| `(\w+)` \|", part, flags=re.MULTILINE) for part in text.split("\n## ")[1:3]]


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        kept = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
        if models(kept) != [list(BRDFS)] * 2:
            sys.exit("docs/accuracy.md has other models than glshade/brdfs: run script/make-accuracy")
        if moved(kept):
            places = ", ".join(moved(kept))
            sys.exit(f"docs/accuracy.md quotes lines that have changed ({places}): run script/make-accuracy --digits")
        sys.exit()
    if sys.argv[1:] == ["--digits"]:
        write(PAGE, PAGE.read_text(encoding="utf-8").split("\n## Line by line")[0].rstrip("\n") + f"\n\n{digits()}")
        sys.exit()
    write(PAGE, page())
