"""Measures how exactly files of measured reflectance are drawn and fitted, and writes the figures of docs/measured.md.

script/make-measured calls it. The data files are not part of the repository.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
from pages import table, write
from scipy.spatial import cKDTree

from glshade.arrays import Float64
from glshade.brdfs import BRDFS, Brdf
from glshade.catalogue.baking import reflectance
from glshade.catalogue.baking import write as bake
from glshade.catalogue.figures import save
from glshade.catalogue.fit_errors import relative_errors
from glshade.catalogue.fitting import fit_model, transformed
from glshade.catalogue.measured_figures import figure
from glshade.measured.reading import read
from glshade.measured.rusinkiewicz import directions
from glshade.measured.samples import Samples, points
from glshade.measured.scattered import Scattered
from glshade.measured.table import Table, above_horizon
from glshade.measured.tabulation import tabulated

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "measured.md"
IMAGES = ROOT / "docs" / "images"
MARK = "<!-- figures -->\n"
# The files, and the models that are plotted beside them.
FILES = {
    "krylon_blue.brdf": "ward",
    "mystique.brdf": "paint",
    "pink-felt-1d.alta": "ward",
    "retro-3M-jaune.dat": "retro_ggx",
}
# The materials whose values are baked and read back.
BAKED = (
    ("ward", {"alpha_x": 0.1}),
    ("ward", {"alpha_x": 0.4}),
    ("ggx", {"roughness": 0.316}),
    ("ggx", {"roughness": 0.7}),
    ("beckmann", {"roughness": 0.5}),
    ("oren_nayar", {}),
)
# The parameters of Ward's model that Ngan et al. (2005) fitted to MERL's pink felt.
NGAN = {"kd": (0.281, 0.170, 0.112), "ks": (0.083, 0.0623, 0.0318), "alpha_x": 0.5}
# Every tenth of the samples is left out, in this many of the ten ways: in all where tables are made at once.
FOLDS, ALL_FOLDS = 2, 10


def main(folder: Path) -> None:
    """Writes the figures and the plots. folder: that of the data files."""
    parts = [_raw_and_left_out(folder), _baked(), _felt(folder), _plots(folder)]
    text = PAGE.read_text(encoding="utf-8").partition(MARK)[0]
    write(PAGE, text + MARK + "\n" + "\n".join(parts))


def _raw_and_left_out(folder: Path) -> str:
    raw, left = [], []
    for name in FILES:
        samples = points(read(folder / name), 20_000)
        start = process_time()
        drawn, enforced = tabulated(samples), tabulated(samples, "enforced")
        seconds = (process_time() - start) / 2
        errors = [_quantiles(relative_errors(made.at(samples.l, samples.v), samples)) for made in (drawn, enforced)]
        raw.append([name, len(samples), *errors, f"{drawn.values.nbytes / 1e6:.1f} MB", f"{seconds:.0f} s"])
        left.append([name, *_left_out(samples)])
    return (
        "At the samples themselves, the errors (median / 95th percentile) of the table:\n\n"
        + table(["file", "samples", "kept", "reciprocity enforced", "size", "made in (CPU)"], raw)
        + "\nAt samples that were left out, a tenth at a time:\n\n"
        + table(["file", "nearest sample", "inverse distance of 4", "splines", "table"], left)
    )


def _left_out(samples: Samples) -> list[str]:
    """Returns the errors at samples that were left out: of the nearest sample, of the mean of four by the inverse squared
    distance, of the splines, and of the table."""
    order = np.random.default_rng(0).permutation(len(samples))
    found: list[list[Float64]] = [[], [], [], []]
    for fold in range(FOLDS if "phi_d" in samples.axes else ALL_FOLDS):
        out, kept = samples.chosen(order[fold::10]), samples.chosen(np.setdiff1d(order, order[fold::10]))
        splines, made = Scattered(kept), tabulated(kept)
        near, weighted = _by_distance(kept, out, splines.one_sided and "phi_d" in samples.axes)
        values = near, weighted, splines.at(*out.about(splines.retro)), made.at(out.l, out.v)
        for errors, value in zip(found, values, strict=True):
            errors.append(relative_errors(value, out))
    return [_quantiles(np.concatenate(errors)) for errors in found]


def _by_distance(kept: Samples, out: Samples, mirrored: bool) -> tuple[Float64, Float64]:
    """Returns f (M, 3) of the nearest sample, and of the four nearest. mirrored: whether mirror images count as samples."""
    places, values = np.concatenate([kept.l, kept.v], axis=1), np.maximum(kept.f, 0)
    if mirrored:
        places = np.concatenate([places, places * np.array([1, -1, 1, 1, -1, 1])])
        values = np.concatenate([values, values])
    distance, near = cKDTree(places).query(np.concatenate([out.l, out.v], axis=1), 4)
    weight = 1 / np.maximum(distance, 1e-9) ** 2
    return values[near[:, 0]], np.sum(values[near] * (weight / weight.sum(axis=1, keepdims=True))[..., None], axis=1)


def _baked() -> str:
    l, v = _even_over_cells(20_000)
    rows = []
    with TemporaryDirectory() as name:
        for model, values in BAKED:
            material = BRDFS[model].model_validate({"brdf": model, **values})
            cells = []
            for suffix in (".binary", ".brdf"):
                path = Path(name) / f"baked{suffix}"
                bake(material, path)
                measured = read(path)
                made = tabulated(measured)
                cells.append(_errors_of(made, material, l, v))
                if isinstance(measured, Samples):
                    cells.append(_errors_of(made, material, measured.l, measured.v))
            words = ", ".join(f"{key} = {value}" for key, value in values.items())
            rows.append([f"{model} {words}".strip(), *cells])
    return "Baked and read back, at random directions that are even over the cells:\n\n" + table(
        ["material", "`.binary`", "`.brdf`", "`.brdf`, at its samples"], rows
    )


def _errors_of(made: Table, material: Brdf, l: Float64, v: Float64) -> str:
    return _quantiles(relative_errors(made.at(l, v), Samples(l, v, reflectance(material, l, v))))


def _even_over_cells(count: int) -> tuple[Float64, Float64]:
    u = np.random.default_rng(0).random((3, count))
    angles = np.pi / 2 * u[0] ** 2, np.pi / 2 * u[1], 2 * np.pi * u[2]
    above = above_horizon(*angles)
    return directions(*(angle[above] for angle in angles))


def _felt(folder: Path) -> str:
    samples = points(read(folder / "pink-felt-1d.alta"), 20_000)
    rows: list[list[Any]] = []
    for words, material in (
        ("Ngan et al. 2005", BRDFS["ward"].model_validate({"brdf": "ward", **NGAN})),
        ("`glshade fit --model ward`", fit_model(samples, BRDFS["ward"]).material),
        ("`glshade fit --model ggx`", fit_model(samples, BRDFS["ggx"]).material),
    ):
        f = reflectance(material, samples.l, samples.v)
        off = transformed(f * samples.l[:, 2:], "log-cosine") - transformed(samples.f * samples.l[:, 2:], "log-cosine")
        rows.append([words, f"{np.sqrt(np.mean(off**2)):.5f}", _quantiles(relative_errors(f, samples))])
    return (
        "Pink felt (MERL, one angle), root of the mean squared difference of log(1 + f cos), and relative errors:\n\n"
        + table(["fit", "root mean square", "median / 95th percentile"], rows)
    )


def _plots(folder: Path) -> str:
    shown = []
    for name, model in FILES.items():
        measured = read(folder / name)
        fit = fit_model(measured, BRDFS[model])
        path = IMAGES / f"measured-{Path(name).stem}.png"
        save(figure(name, points(measured, 20_000), tabulated(measured), fit), path)
        shown.append(f"![{name}: samples, table and a fit of {model}](images/{path.name})\n")
    return "\n".join(shown)


def _quantiles(errors: Float64) -> str:
    """Returns the median and the 95th percentile of relative errors in words."""
    return " / ".join(
        f"{100 * value:.2g} %" if value < 0.1 else f"{100 * value:.0f} %" for value in np.nanquantile(errors, [0.5, 0.95])
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data" / "measured")
