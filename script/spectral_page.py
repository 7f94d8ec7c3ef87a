"""Measures the figures of docs/spectral.md, and draws its pictures. script/make-spectral calls it.

The figures stand in the page between a mark such as `<!-- bands -->` and the mark `<!-- end -->` after it.
"""

from __future__ import annotations

import re
import statistics
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pages import table, write

from glshade import Image, Renderer
from glshade.assembly.assembly import assemble
from glshade.optics.fresnel import f0_conductor
from glshade.optics.observer import daylight, matching, rgb_weights, sampled
from glshade.optics.spectra import ILLUMINANTS, Spectrum
from glshade.radiance.draw import draw_of
from glshade.radiance.surface import Surface, evaluate_surface
from glshade.scene.file import load
from glshade.scene.scene import Scene

Array = NDArray[np.float64]
ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "spectral.md"
BANDS = (3, 6, 12, 30)
# The number of drawings of which the page tells the median.
DRAWINGS = 15


@dataclass(frozen=True)
class Sample:
    """A measured material.

    name: its name.
    material: its table in a scene file, for a model whose ambient reflectance is the reflectance itself.
    reflectance: the reflectance (531,).
    """

    name: str
    material: dict[str, Any]
    reflectance: Array


def samples(folder: Path) -> Iterator[Sample]:
    """Yields the patches of the colour chart and the metals of a folder."""
    for path in sorted(folder.glob("macbeth-*.spd")):
        keys = {"spectrum": path}
        yield Sample(path.stem, {"brdf": "lambert", "kd": keys}, Spectrum.model_validate(keys).values())
    for path in sorted(folder.glob("*.eta.spd")):
        symbol = path.name.partition(".")[0]
        eta, k = ({"spectrum": folder / f"{symbol}.{part}.spd"} for part in ("eta", "k"))
        values = [Spectrum.model_validate(x).values(held=True)[:, None] for x in (eta, k)]
        yield Sample(symbol, {"brdf": "metal", "eta": eta, "k": k}, f0_conductor(*values)[:, 0])


def shown(material: dict[str, Any], light: str, **film: Any) -> Array:
    """Returns the colour (3,) that a material shows under an ambient light of a spectrum: its reflectance in that light."""
    scene = Scene.model_validate(
        {
            "film": {"size": (8, 8), **film},
            "objects": [{"shape": "sphere", "material": material}],
            "lights": [{"type": "ambient", "colour": {"spectrum": light}}],
        }
    )
    assembly = assemble(scene)
    point = Surface(np.ones(1), np.array([[0.0, 0.0, -4.0]]), np.array([[0.0, 0.0, 1.0]]), None, None, None)
    return np.asarray(evaluate_surface(draw_of(scene, assembly, assembly.instances[0]), point)[0])


def errors(folder: Path) -> str:
    """Returns the table of the largest errors against sums in steps of 1 nm."""
    chosen = list(samples(folder))
    worst: dict[str, float] = {}
    for sample in chosen:
        is_linear = sample.material["brdf"] == "lambert"
        by_day = (daylight() * sample.reflectance) @ rgb_weights()
        for light in ILLUMINANTS:
            spectrum = Spectrum(spectrum=light).light()
            exact = (spectrum * sample.reflectance) @ rgb_weights()
            found = {"RGB colours multiplied": by_day * (spectrum @ rgb_weights())}
            if is_linear:
                found["integrated exactly (the 12 patches)"] = shown(sample.material, light)
            # The model of Oren and Nayar is not linear in its colour, so that it is drawn in bands. At this sigma it reflects
            # ambient light as a Lambertian surface does.
            banded = {**sample.material, "brdf": "oren_nayar", "sigma": 1e-9} if is_linear else sample.material
            for count in BANDS:
                found[f"{count} bands"] = shown(banded, light, bands=count)
            for name, colour in found.items():
                worst[name] = max(worst.get(name, 0.0), float(np.abs(colour - exact).max()))
    order = ["RGB colours multiplied", *(f"{count} bands" for count in BANDS), "integrated exactly (the 12 patches)"]
    return table(["way", "largest error"], [(name, f"{worst[name]:.2g}") for name in order])


def difference(cells: dict[str, str], reflectance: Array) -> float:
    """Returns the difference, dE2000, between our sums and the colour that an instrument's file tells.

    The sums take the lamp and the observer that the file names: D50 and 2 degrees, or D65 and 10 degrees.
    cells: name of a column -> value.
    reflectance: the measured reflectance (531,).
    """
    import colour

    if cells["Observer"] == "2":
        observer = matching()
    else:
        ten = colour.MSDS_CMFS["CIE 1964 10 Degree Standard Observer"]
        observer = np.stack([sampled(ten.wavelengths, column) for column in ten.values.T], axis=1)
    lamp = colour.SDS_ILLUMINANTS[cells["Illuminant"]]
    light = daylight() if cells["Illuminant"] == "D65" else sampled(lamp.wavelengths, lamp.values)
    white = light @ observer
    own = (light * reflectance) @ observer / white[1]
    told = np.array([float(cells[axis]) for axis in "XYZ"])
    lab = [colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(white)) for xyz in (own, told)]
    return float(colour.delta_E(*lab, method="CIE 2000"))


def real_materials(folder: Path) -> str:
    """Returns the table of the colours of real materials, beside those that the instrument tells."""
    rows = []
    for path in sorted((folder / "real").glob("*.csv")):
        heads, values = (line.split(";") for line in path.read_text(encoding="utf-8").splitlines()[-2:])
        cells = dict(zip(heads, values, strict=True))
        measured = {float(head[1:-3]): float(value) for head, value in cells.items() if re.fullmatch(r"R\d+ nm", head)}
        wavelengths = np.array(list(measured))
        reflectance = sampled(wavelengths, np.array(list(measured.values())))
        instrument = f"{cells['Illuminant']}, {cells['Observer']} degrees"
        table_of = {"spectrum": [[w, v] for w, v in measured.items()]}
        banded = {"brdf": "oren_nayar", "sigma": 1e-9, "kd": table_of}
        worst = {
            count: max(
                float(
                    np.abs(
                        shown(banded, light, bands=count) - (Spectrum(spectrum=light).light() * reflectance) @ rgb_weights()
                    ).max()
                )
                for light in ILLUMINANTS
            )
            for count in (12, 30)
        }
        rgb = " ".join(f"{x:.3f}" for x in (daylight() * reflectance) @ rgb_weights())
        rows.append(
            (path.stem, rgb, instrument, f"{difference(cells, reflectance):.2f}", f"{worst[12]:.4f}", f"{worst[30]:.4f}")
        )
    return table(["material", "RGB under D65", "the instrument's lamp", "dE2000 from its colour", "12 bands", "30 bands"], rows)


def seconds(renderer: Renderer, *scenes: Scene) -> list[float]:
    """Returns the median times of drawing scenes [s], which are drawn in turn."""
    drawings = [renderer.drawing(scene) for scene in scenes]
    times = [[draw() for draw in drawings] for _ in range(DRAWINGS)]
    return [statistics.median(column) for column in zip(*times, strict=True)]


def ball(material: dict[str, Any], *colours: Any, **film: Any) -> Scene:
    light = {"type": "directional", "direction": (-0.5, -0.5, -0.8)}
    return Scene.model_validate(
        {
            "film": {"size": (512, 512), **film},
            "camera": {"eye": (0, 0, 2.6), "target": (0, 0, 0)},
            "objects": [{"shape": {"type": "sphere", "segments": 64, "rings": 32}, "material": material}],
            "lights": [{**light, "colour": colour} for colour in colours],
        }
    )


def costs(folder: Path) -> str:
    """Returns the table of the time of a picture, relative to the same picture in RGB."""
    gold = {"brdf": "metal", "eta": {"spectrum": folder / "Au.eta.spd"}, "k": {"spectrum": folder / "Au.k.spd"}}
    paint = {"brdf": "phong", "kd": {"spectrum": ROOT / "scenes" / "assets" / "metamer-2.spd"}}
    brown = {"brdf": "phong", "kd": (0.4, 0.3, 0.2)}
    lamp, tube, warm = {"spectrum": "A"}, {"spectrum": "F11"}, (1, 0.5, 0.2)
    cases = {
        "`phong`, one lamp with a spectrum": (ball(paint, lamp), ball(brown, warm)),
        "`phong`, two lamps with different spectra": (ball(paint, lamp, tube), ball(brown, warm, warm)),
        "`metal` in 12 bands, one lamp": (ball(gold, lamp), ball({"brdf": "metal"}, warm)),
        "`metal` in 30 bands, one lamp": (ball(gold, lamp, bands=30), ball({"brdf": "metal"}, warm)),
    }
    rows = []
    with Renderer() as renderer:
        for name, (spectral, rgb) in cases.items():
            own, other = seconds(renderer, spectral, rgb)
            rows.append((name, f"{own / other:.2f}"))
        driver = renderer.context.renderer
    return table(["picture of 512 x 512", f"times RGB ({driver})"], rows)


def pictures() -> None:
    """Draws the pictures of the page."""
    with Renderer() as renderer:
        for name in ("metamers", "spectral-metals", "fluorescence"):
            path = ROOT / "docs" / "images" / f"spectral-{name.removeprefix('spectral-')}.png"
            image = renderer.render(load(ROOT / "scenes" / f"{name}.toml"))
            # Attributes would hold the driver's name, and the file would change although the picture is the same.
            Image(image.pixels, image.encoding).save(path)
            print(path)


def main(folder: Path) -> None:
    warnings.simplefilter("ignore")  # colour-science warns of optional packages that are missing
    text = PAGE.read_text(encoding="utf-8")
    for name, found in {"errors": errors(folder), "real": real_materials(folder), "costs": costs(folder)}.items():
        print(found)
        text = re.sub(
            rf"<!-- {name} -->\n.*?<!-- end -->",
            lambda _, n=name, f=found: f"<!-- {n} -->\n\n{f}\n<!-- end -->",
            text,
            flags=re.S,
        )
    pictures()
    write(PAGE, text)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: script/make-spectral FOLDER")
    main(Path(sys.argv[1]))
