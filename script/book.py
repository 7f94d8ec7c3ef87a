"""docs/brdfs.md: every reflectance model on one page, from what the models declare. Called by script/make-book.

What is measured (costs, errors) changes from machine to machine; it stands between marks, and --check leaves it out.
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
# Of a sphere [pixels]; a lobe below it is as wide.
SIDE = 128
# Of the lobes' light, in degrees from the normal.
INCIDENCE = 45
# Measurements of each model: a page is kept for long.
REPEAT = 15

# The base colour in the pictures, so that highlights stand out.
CLAY = (0.5, 0.17, 0.1)
WARD: Sequence[Mapping[str, Any]] = [{"alpha_x": 0.05}, {"alpha_x": 0.15}, {"alpha_x": 0.4}, {"alpha_x": 0.4, "alpha_y": 0.1}]
# Four materials of a model, from left to right; where a model is not here, four values of its first scalar.
WALKS: Mapping[str, Sequence[Mapping[str, Any]]] = {
    "ambient": [{"ka": 1}, {"ka": 3}, {"ka": 6}, {"ka": 10}],
    "lambert": [{"kd": 0.1}, {"kd": 0.3}, {"kd": 0.6}, {"kd": 1.0}],
    "ashikhmin_shirley": [{"pu": 10, "pv": 10}, {"pu": 100, "pv": 100}, {"pu": 1000, "pv": 1000}, {"pu": 10, "pv": 1000}],
    "ggx": [
        {"metallic": 0, "roughness": 0.3},
        {"metallic": 0, "roughness": 0.7},
        {"metallic": 1, "roughness": 0.3},
        {"metallic": 1, "roughness": 0.5, "anisotropy": 0.9},
    ],
    "lafortune": [
        {"exponent_1": 10},
        {"exponent_1": 100},
        {"cx_1": -1, "cz_1": 0.7, "exponent_1": 10},
        {"cx_1": 1, "exponent_1": 10},
    ],
    "metal": [{"roughness": 0.2}, {"roughness": 0.4}, {"roughness": 0.8}, {"roughness": 0.5, "anisotropy": 0.9}],
    "paint": [
        {"flakes": 0},
        {"flakes": 0.3, "coat_roughness": 0.3},
        {"flakes": 0.8, "flake_roughness": 0.5},
        {"flakes": 0.8, "coat": 0},
    ],
    "plastic": [{"roughness": 0.1}, {"roughness": 0.3}, {"roughness": 0.6}, {"roughness": 1}],
    "principled": [
        {"roughness": 0.3},
        {"roughness": 0.8, "sheen": 1},
        {"metallic": 1, "roughness": 0.5, "anisotropy": 0.9},
        {"roughness": 0.7, "clearcoat": 1},
    ],
    "strauss": [
        {"smoothness": 0.3, "metalness": 0},
        {"smoothness": 0.8, "metalness": 0},
        {"smoothness": 0.3, "metalness": 1},
        {"smoothness": 0.8, "metalness": 1},
    ],
    "retro_ggx": [{"roughness": 0.5}, {"roughness": 0.6}, {"roughness": 0.8}, {"roughness": 1.0}],
    "retro_phong": [{"exponent": 1}, {"exponent": 4}, {"exponent": 16}, {"exponent": 64}],
    "ward": WARD,
    "ward_duer": WARD,
    "ward_gmd": WARD,
}
# Light from the viewer shows lobes that turn back, and has to be weak for that: these are bright.
LIGHTS = (
    {"type": "directional", "direction": (0.55, -0.6, -0.6), "intensity": 0.8},
    {"type": "directional", "direction": (0.0, 0.0, -1.0), "intensity": 0.05},
    {"type": "ambient", "intensity": 0.08},
)

INTRODUCTION = """\
# The reflectance models

<!-- Made by script/make-book from the models; change those, not this. -->

Every model gives f cos [1/sr], the BRDF times the cosine to the light, and 0 where light or viewer is below the horizon. Names
are those of [notation.md](notation.md): n the normal, l to the light, v to the viewer, h half-way between, r the mirror
direction.

Laws are promised for every parameter within its range, and tested, unless a model says that it breaks one, and why.
Reciprocity: f(l, v) = f(v, l). Energy: no more light leaves than arrives. Limits are tested too: the two materials have the
same value to 1e-9 of it, in float64, unless another figure is given.

Pictures: spheres under a light from the upper left, a little light from the viewer and from everywhere, and below each its
lobe: f cos over the hemisphere for light at {incidence} degrees (orange), by a logarithmic scale of four decades below its
largest value. Where a model has a kd, it is {clay} unless said otherwise.
"""

COSTS = (
    "Nanoseconds of one evaluation, median and range, measured by `glshade bench brdfs` on {renderer}; {version}, with "
    "{threads} threads. {clock} Operations are those of the driver's intermediate code (NIR), each component of a vector "
    "counted. Where a model has several rows, the first is its defaults, and the others are its options."
)
CLOCK = {
    "core": "The times are of one core. llvmpipe shares pixels among all its threads, and does all vertices in one.",
    "wall": "The times are by the clock on the wall, all units of the GPU at work.",
}

FIGURES = ("a pixel [ns]", "a vertex [ns]", "operations", "bytes of GLSL")

MARK = re.compile(r"(<!-- (?:cost|error)[^>]*-->\n).*?(<!-- end -->\n)", flags=re.DOTALL)


def marked(key: str, text: str) -> str:
    """Text that is measured; key says what it is."""
    return f"<!-- {key} -->\n{text}<!-- end -->\n"


def words(page: str) -> str:
    """A page without what is measured."""
    return MARK.sub(r"\1\2", page)


def kept(page: str) -> dict[str, str]:
    """key -> text of what was measured."""
    found = re.findall(r"<!-- ((?:cost|error)[^>]*) -->\n(.*?)<!-- end -->\n", page, flags=re.DOTALL)
    return dict(found)


def paragraphs(model: type[Brdf]) -> str:
    """A model's own words, with what Markdown would take for its own escaped."""
    parts = (inspect.getdoc(model) or "").split("\n\n")
    return "\n\n".join(re.sub(r"([*<])", r"\\\1", " ".join(part.split())) for part in parts) + "\n"


def headline(model: type[Brdf]) -> str:
    """What a model is, in the words of its module."""
    said = (sys.modules[model.__module__].__doc__ or "").strip().splitlines()[0]
    return said.split(": ", 1)[-1].rstrip(".")


def figure(value: Any) -> str:
    """A value as a scene file would have it; three equal numbers are one."""
    if isinstance(value, tuple | list):
        return f"{value[0]:g}" if len(set(value)) == 1 else f"[{', '.join(f'{x:g}' for x in value)}]"
    return f"{value:g}" if isinstance(value, float | int) else str(value)


def parameters(model: type[Brdf]) -> str:
    """The table of a model's parameters and options."""
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
    """What a model promises, and what not."""
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


def walk(model: type[Brdf]) -> list[dict[str, Any]]:
    """The parameters of the materials in a model's pictures."""
    if model.model_fields["brdf"].default in WALKS:
        return [dict(one) for one in WALKS[model.model_fields["brdf"].default]]
    name, declared = next((name, d) for name, d in model.parameters().items() if not model.is_colour(name))
    low, high = declared.usual
    shares = [i / 3 for i in range(4)]
    values = [low * (high / low) ** s if low > 0 and high > 10 * low else low + (high - low) * s for s in shares]
    return [{name: float(f"{value:.2g}")} for value in values]


def caption(model: type[Brdf]) -> str:
    """What the pictures show, from left to right."""
    return "; ".join(", ".join(f"{name} {figure(value)}" for name, value in one.items()) for one in walk(model))


def materials(model: type[Brdf]) -> list[Brdf]:
    """Those of the pictures."""
    base = {"kd": CLAY} if "kd" in model.parameters() else {}
    return [model.model_validate({"brdf": model.model_fields["brdf"].default, **base, **one}) for one in walk(model)]


def errors() -> dict[str, str]:
    """model -> the line of its errors, from docs/accuracy.md; a model that was not measured has none."""
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
    """(what, pixel, vertex, operations, bytes) of each cost."""

    def ns(spread: Any) -> str:
        # A clock has no digits below this, and a difference may come out below 0.
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
    """key -> text of what was measured, but for the errors."""
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
    """The text of docs/brdfs.md; costs: key -> what was measured, where it was."""
    text = INTRODUCTION.format(incidence=INCIDENCE, clay=figure(CLAY)) + "\n"
    rows = []
    for name, model in BRDFS.items():
        kept_laws = ["no" if law in model.breaks else "yes" for law in ("reciprocity", "energy")]
        rows.append((f"[`{name}`](#{name})", headline(model), *kept_laws, "yes" if model.anisotropic else "no"))
    text += table(("model", "what it is", "reciprocal", "keeps energy", "anisotropic"), rows)
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
    text += '\n## Presets\n\n`material = "gold"` in a scene file, or `preset = "gold"` and what is to be another.\n\n'
    presets = [
        (f"`{name}`", f"[`{one.material['brdf']}`](#{one.material['brdf']})", one.description, one.source)
        for name, one in PRESETS.items()
    ]
    return text + table(("preset", "model", "what it looks like", "source"), presets)


def pictures() -> None:
    """docs/images/brdfs: for each model its spheres, and their lobes below."""
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
            # Without attributes: the file changes when the picture does, and not with the driver's name.
            Image(np.concatenate(rows)).save(PICTURES / f"{name}.png")
    for path in PICTURES.glob("*.png"):
        if path.stem not in BRDFS:
            path.unlink()


def _copy(image: Image) -> Image:
    """The renderer draws the next one into the same pixels."""
    return replace(image, pixels=image.pixels.copy())


def faults() -> list[str]:
    """What is not as it should be, as far as that can be told without measuring."""
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
