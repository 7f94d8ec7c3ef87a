"""Writes docs/brdfs.md, a page about every reflectance model, from the models' declarations. script/make-book calls it.

Measured figures (costs, errors) differ from machine to machine. They stand between marks, and --check ignores them.
"""

from __future__ import annotations

import inspect
import re
import sys
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from pages import table, write

from glshade.brdfs import BRDFS, Brdf
from glshade.presets import PRESETS

if TYPE_CHECKING:
    from glshade.bench.brdfs import Cost, Costs
    from glshade.image.image import Image

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "brdfs.md"
PICTURES = ROOT / "docs" / "images" / "brdfs"
ACCURACY = ROOT / "docs" / "accuracy.md"
# The side of a sphere's picture [pixels]. The lobe's picture below it has the same width.
SIDE = 128
# The angle between the normal and the light that shows the lobes [degrees].
INCIDENCE = 45
# How often each model is measured. The page is made rarely, so its figures may take their time.
REPEAT = 15

# The base colour in the pictures. White highlights are easy to see on it.
CLAY = (0.5, 0.17, 0.1)
# The second light comes from the viewer and shows retro-reflection. It is weak, because retro-reflective lobes are bright.
LIGHTS = (
    {"type": "directional", "direction": (0.55, -0.6, -0.6), "intensity": 0.8},
    {"type": "directional", "direction": (0.0, 0.0, -1.0), "intensity": 0.05},
    {"type": "ambient", "intensity": 0.08},
)

INTRODUCTION = """\
# The reflectance models

<!-- Made by script/make-book from the models; change those, not this. -->

Every model returns f cos [1/sr], the BRDF times the cosine to the light. The value is 0 where the light or the viewer is below
the horizon. Names are those of [notation.md](notation.md): n is the normal, l the direction to the light, v the direction to
the viewer, h the direction half-way between l and v, and r the mirror direction.

**Laws.** Reciprocity means f(l, v) = f(v, l). Energy means that no more light leaves a surface than arrives. Tests check both
for every parameter within its range, unless a model states that it breaks a law, and why. A *limit* names a simpler material
with the same value; tests check it to 1e-9 in float64, unless another figure is given.

**Pictures.** The spheres are lit from the upper left, with a little light from the viewer and from everywhere. Below each
sphere is its lobe: f cos over the hemisphere for light at {incidence} degrees (orange), on a logarithmic scale of four decades
below the largest value. kd is {clay} unless the caption says otherwise.
"""

COSTS = (
    "Nanoseconds of one evaluation, median and range, measured by `glshade bench brdfs` on {renderer}; {version}, with "
    "{threads} threads. {clock} Operations are those of the driver's intermediate code (NIR); each component of a vector "
    "counts. Where a model has several rows, the first shows its defaults and the others its options."
)
CLOCK = {
    "core": "The times are for one core. llvmpipe divides pixels among all its threads, and processes all vertices in one.",
    "wall": "The times are wall-clock times with all units of the GPU at work.",
}

FIGURES = ("a pixel [ns]", "a vertex [ns]", "operations", "bytes of GLSL")

MARK = re.compile(r"(<!-- (?:cost|error)[^>]*-->\n).*?(<!-- end -->\n)", flags=re.DOTALL)


def marked(key: str, text: str) -> str:
    """Measured text between its marks. key: names the text."""
    return f"<!-- {key} -->\n{text}<!-- end -->\n"


def words(page: str) -> str:
    """Returns the page without its measured text, for a comparison."""
    return MARK.sub(r"\1\2", page)


def kept(page: str) -> dict[str, str]:
    """key -> the measured text that the page has."""
    found = re.findall(r"<!-- ((?:cost|error)[^>]*) -->\n(.*?)<!-- end -->\n", page, flags=re.DOTALL)
    return dict(found)


def paragraphs(model: type[Brdf]) -> str:
    """Returns the docstring of a model, with the characters escaped that mean something in Markdown."""
    parts = (inspect.getdoc(model) or "").split("\n\n")
    return "\n\n".join(re.sub(r"([*<])", r"\\\1", " ".join(part.split())) for part in parts) + "\n"


def headline(model: type[Brdf]) -> str:
    """One line about a model: the first line of its module's docstring, without the name."""
    said = (sys.modules[model.__module__].__doc__ or "").strip().splitlines()[0]
    return said.split(": ", 1)[-1].rstrip(".")


def figure(value: Any) -> str:
    """Returns a value as a scene file would write it. Three equal numbers become one."""
    if isinstance(value, tuple | list):
        return f"{value[0]:g}" if len(set(value)) == 1 else f"[{', '.join(f'{x:g}' for x in value)}]"
    return f"{value:g}" if isinstance(value, float | int) else str(value)


def parameters(model: type[Brdf]) -> str:
    """Returns the table of a model's parameters and options."""
    rows = []
    for name, declared in model.parameters().items():
        default = model.model_fields[name].default
        most = f"{declared.low:g} and more" if declared.high is None else f"{declared.low:g} to {declared.high:g}"
        unit = "" if declared.unit == "1" else f" [{declared.unit}]"
        kind = "colour" if model.is_colour(name) else "number"
        shown = f"that of {declared.same_as}" if default is None else figure(default)
        rows.append((f"`{name}`", kind, shown, most, "{:g} to {:g}".format(*declared.usual), declared.description + unit))
    for name in model.choices():
        field = model.model_fields[name]
        options = ", ".join(f"`{option}`" for option in get_args(field.annotation))
        rows.append((f"`{name}`", "option", f"`{field.default}`", options, "-", field.description or ""))
    return table(("parameter", "kind", "default", "from, to", "usual", "meaning"), rows)


def laws(model: type[Brdf]) -> str:
    """Returns the list of the laws that a model keeps or breaks, and of its limits."""
    breaks = model.breaks
    said = [f"not kept: {breaks['reciprocity']}" if "reciprocity" in breaks else "kept"]
    shares = " + ".join(model.shares)
    said.append(f"not kept: {breaks['energy']}" if "energy" in breaks else f"kept where {shares} <= 1" if shares else "kept")
    text = f"- Reciprocity: {said[0]}.\n- Energy: {said[1]}.\n"
    if model.anisotropic:
        even = ", ".join(f"{name} = {figure(value)}" for name, value in model.isotropic_where.items())
        text += f"- Anisotropic; isotropic where {even}.\n"
    for limit in model.limits():
        text += f"- Limit: {limit.says}{'' if limit.within == 1e-9 else f', to {limit.within:g}'}.\n"
    return text


def samples(model: type[Brdf]) -> Sequence[Mapping[str, Any]]:
    """Returns the parameters of the four materials in a model's pictures, from left to right: the model's own samples where it
    names some, else four values of its first scalar, else four brightnesses of its first colour."""
    if model.samples:
        return model.samples
    colours = [name for name in model.parameters() if model.is_colour(name)]
    scalars = [name for name in model.parameters() if not model.is_colour(name)]
    if not scalars:
        return [{colours[0]: brightness} for brightness in (0.1, 0.3, 0.6, 1.0)]
    low, high = model.parameters()[scalars[0]].usual
    shares = [i / 3 for i in range(4)]
    # A range of several decades is divided into equal ratios, a shorter one into equal differences.
    values = [low * (high / low) ** s if low > 0 and high > 10 * low else low + (high - low) * s for s in shares]
    return [{scalars[0]: float(f"{value:.2g}")} for value in values]


def caption(model: type[Brdf]) -> str:
    """Returns the words below a model's picture: the parameters of each sample, from left to right."""
    return "; ".join(", ".join(f"{name} {figure(value)}" for name, value in one.items()) for one in samples(model))


def materials(model: type[Brdf]) -> list[Brdf]:
    """Returns the samples as materials. A kd that a sample does not set is CLAY."""
    base = {"kd": CLAY} if "kd" in model.parameters() else {}
    return [model.model_validate({"brdf": model.model_fields["brdf"].default, **base, **one}) for one in samples(model)]


def errors() -> dict[str, str]:
    """model -> the sentence about its errors, from docs/accuracy.md. A model that was not measured is left out."""
    found: dict[str, str] = {}
    parts = ACCURACY.read_text(encoding="utf-8").split("\n## ")[1:] if ACCURACY.exists() else []
    tables = [
        {cells[0].strip("`"): cells[1:] for line in part.splitlines() if line.startswith("| `") for cells in [_cells(line)]}
        for part in parts
    ]
    for name, (bound, vertex, fragment, *_) in tables[0].items() if len(tables) == 2 else ():
        extreme, usual = max(vertex, fragment, key=float), max(tables[1][name][1:], key=float)
        found[name] = (
            f"Error against float64 ([accuracy.md](accuracy.md)): {extreme} x conditioning at worst (promised: {bound}), "
            f"{usual} x max(1, f cos) at usual parameters.\n"
        )
    return found


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split("|")[1:-1]]


def cost_rows(rows: Sequence[Cost]) -> list[tuple[str, ...]]:
    """One row (variant, pixel, vertex, operations, bytes) a cost, as text."""

    def ns(spread: Any) -> str:
        # A clock resolves no more digits. A cost is a difference of two measurements, so noise can make it negative.
        low, middle, high = (f"{max(x, 0.0):.1f}" for x in (spread.low, spread.median, spread.high))
        return f"{middle} ({low} to {high})"

    return [
        (
            row.variant or "default",
            ns(row.pixel),
            ns(row.vertex),
            "-" if row.operations is None else f"{row.operations.total}: {row.operations}" if row.operations.total else "0",
            f"{row.size:,}",
        )
        for row in rows
    ]


def measured(costs: Costs) -> dict[str, str]:
    """key -> the measured text about costs."""
    found = {}
    head = COSTS.format(renderer=costs.renderer, version=costs.version, threads=costs.threads, clock=CLOCK[costs.clock])
    by_model = {name: cost_rows([row for row in costs.rows if row.model == name]) for name in BRDFS}
    rows = []
    for name, own in by_model.items():
        for variant, pixel, vertex, operations, size in own:
            link = f"[`{name}`](#{name})" if variant == "default" else f"&nbsp; {variant}"
            rows.append((link, pixel, vertex, operations.split(":")[0], size))
    found["cost of all"] = textwrap.fill(head, 128) + "\n\n" + table(("model", *FIGURES), rows)
    for name, own in by_model.items():
        found[f"cost of {name}"] = table(("cost", *FIGURES), own)
    return found


def page(costs: Mapping[str, str]) -> str:
    """Returns the text of docs/brdfs.md. costs: key -> measured text; a missing key leaves its place empty."""
    text = INTRODUCTION.format(incidence=INCIDENCE, clay=figure(CLAY)) + "\n"
    rows = []
    for name, model in BRDFS.items():
        kept_laws = ["no" if law in model.breaks else "yes" for law in ("reciprocity", "energy")]
        rows.append((f"[`{name}`](#{name})", headline(model), *kept_laws, "yes" if model.anisotropic else "no"))
    text += table(("model", "description", "reciprocal", "keeps energy", "anisotropic"), rows)
    text += "\n## Cost\n\n" + marked("cost of all", costs.get("cost of all", ""))
    found = errors()
    for name, model in BRDFS.items():
        text += f"\n## {name}\n\n{headline(model)[:1].upper()}{headline(model)[1:]}.\n\n"
        text += f"![{name}](images/brdfs/{name}.png)\n\nFrom left to right: {caption(model)}.\n\n"
        text += f"{paragraphs(model)}\nSource: {model.source}.\n\n{parameters(model)}\n{laws(model)}\n"
        text += marked(f"cost of {name}", costs.get(f"cost of {name}", "")) + "\n"
        text += marked(f"error of {name}", found.get(name, ""))
        own = [preset for preset, one in PRESETS.items() if one.material["brdf"] == name]
        if own:
            text += f"\nPresets: {', '.join(f'[`{preset}`](#presets)' for preset in own)}.\n"
    text += "\n## Presets\n\n"
    text += 'In a scene file: `material = "gold"`, or `{ preset = "gold", roughness = 0.2 }` to change parameters.\n\n'
    presets = [
        (f"`{name}`", f"[`{one.material['brdf']}`](#{one.material['brdf']})", one.description, one.source)
        for name, one in PRESETS.items()
    ]
    return text + table(("preset", "model", "description", "source"), presets)


def pictures() -> None:
    """Writes docs/images/brdfs: one picture a model, with its spheres above and their lobes below."""
    import numpy as np

    from glshade import Image, Renderer, Scene
    from glshade.catalogue import pictures as drawn

    PICTURES.mkdir(parents=True, exist_ok=True)
    lights = Scene.model_validate({"objects": [{"shape": "sphere"}], "lights": LIGHTS}).lights
    with Renderer() as renderer:
        for name, model in BRDFS.items():
            spheres = [drawn.sphere(one, SIDE).model_copy(update={"lights": lights}) for one in materials(model)]
            lobes = [drawn.solid(one, np.radians(INCIDENCE), scale="log", size=SIDE)[0] for one in materials(model)]
            rows = [
                drawn.side_by_side([_copy(renderer.render(scene, dtype="float32")) for scene in scenes]).pixels
                for scenes in (spheres, lobes)
            ]
            # Attributes would hold the driver's name, and the file would change although the picture is the same.
            Image(np.concatenate(rows)).save(PICTURES / f"{name}.png")
    for path in PICTURES.glob("*.png"):
        if path.stem not in BRDFS:
            path.unlink()


def _copy(image: Image) -> Image:
    """Returns a copy of the pixels, because the renderer draws the next picture into the same array."""
    return replace(image, pixels=image.pixels.copy())


def faults() -> list[str]:
    """Returns the faults of the page and its pictures that can be found without measuring; no faults give an empty list."""
    text = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    figures = kept(text)
    found = [] if words(text) == words(page({})) else ["docs/brdfs.md is not what the models say"]
    found += [f"docs/brdfs.md has no cost of {name}" for name in BRDFS if "[ns]" not in figures.get(f"cost of {name}", "")]
    there = {path.stem for path in PICTURES.glob("*.png")}
    found += [f"docs/images/brdfs has no picture of {name}" for name in BRDFS if name not in there]
    return found + [f"docs/images/brdfs/{name}.png is of no model" for name in sorted(there - set(BRDFS))]


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        wrong = faults()
        sys.exit("\n".join([*wrong, "run script/make-book"]) if wrong else 0)
    if sys.argv[1:] == ["--words"]:
        write(PAGE, page(kept(PAGE.read_text(encoding="utf-8")) if PAGE.exists() else {}))
        sys.exit()
    from glshade.bench.brdfs import costs

    pictures()
    write(PAGE, page(measured(costs(repeat=REPEAT))))
