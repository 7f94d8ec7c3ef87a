"""ALTA: text of the library ALTA (Belcour, Barla and Pacanowski 2014), with the numbers of one sample on each line.

The lines `#DIM 3 1`, `#PARAM_IN ISOTROPIC_TL_TV_PROJ_DPHI` and `#PARAM_OUT INV_STERADIAN` say how many numbers a sample has,
which directions the first of them describe (glshade/measured/parametrisations.py) and what the last ones are. `#VS 1` or
`#VS 2` announce one or two further numbers, which bound the value's error and are not read. Other lines with # are comments.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from glshade.arrays import Float64
from glshade.document import nearest
from glshade.measured.formats import MeasuredFile, MeasuredFormat
from glshade.measured.number_lines import Rows, numbers, text_lines
from glshade.measured.parametrisations import PARAMETRISATIONS, Parametrisation
from glshade.measured.samples import Samples
from glshade.optics.observer import matching, rgb_weights

# What the values may be. ENERGY is not among them: it is no reflectance, unless one knows the instrument.
QUANTITIES = ("INV_STERADIAN", "INV_STERADIAN_COSINE_FACTOR", "RGB_COLOR", "XYZ_COLOR")
# The smallest cosine of a direction from the normal. Below it, noise divided by the cosine would be larger than the value.
LOWEST_COSINE = 1e-3


@dataclass(frozen=True)
class _Header:
    """What the lines with # say.

    inputs: how many numbers describe the directions.
    outputs: how many numbers are values.
    bounds: how many numbers bound the error.
    parametrisation: what the first numbers mean.
    quantity: what the values are, one of QUANTITIES.
    """

    inputs: int
    outputs: int
    bounds: int
    parametrisation: Parametrisation
    quantity: str


class Alta(MeasuredFormat):
    """ALTA's text files, which end in .alta, .dat or .data."""

    description = "ALTA text (lines #DIM, #PARAM_IN, #PARAM_OUT)"

    def recognises(self, data: bytes) -> bool:
        return re.search(rb"^[ \t]*#[ \t]*(DIM|PARAM_IN|PARAM_OUT)\b", data[:65536], re.MULTILINE) is not None

    def read(self, file: MeasuredFile) -> Samples:
        words: dict[str, tuple[int, list[str]]] = {}
        header, rows, count = None, None, 0
        for line, text in text_lines(file):
            if text.startswith("#"):
                name, *rest = text[1:].split() or [""]
                words.setdefault(name, (line, rest))
                continue
            if header is None or rows is None:
                header = self._header(file, words)
                count = header.inputs + header.outputs
                rows = Rows(file, count)
            found = numbers(file, line, text)
            if len(found) not in (count, count + header.bounds):
                raise file.fail(f"a sample has {count} numbers in this file, not {len(found)}; is the file cut short?", line)
            rows.add(line, found[:count])
        if header is None or rows is None:
            raise file.fail("holds no samples")
        return self._samples(rows, header)

    def _header(self, file: MeasuredFile, words: dict[str, tuple[int, list[str]]]) -> _Header:
        line, given = words.get("DIM", (None, []))
        if len(given) != 2 or not all(re.fullmatch(r"\d{1,3}", word) for word in given):
            raise file.fail("needs a line such as #DIM 3 1 before its samples, with the numbers of inputs and outputs", line)
        inputs, outputs = map(int, given)
        line, given = words.get("PARAM_IN", (None, []))
        if len(given) != 1 or given[0] not in PARAMETRISATIONS:
            name = given[0] if given else ""
            raise file.fail(f'#PARAM_IN "{name}" is no parametrisation that is known{nearest(name, PARAMETRISATIONS)}', line)
        parametrisation = PARAMETRISATIONS[given[0]]
        if parametrisation.columns != inputs:
            raise file.fail(f"{given[0]} has {parametrisation.columns} inputs, but #DIM says {inputs}", line)
        line, given = words.get("PARAM_OUT", (None, []))
        if len(given) != 1 or given[0] not in QUANTITIES:
            name = given[0] if given else ""
            raise file.fail(f'#PARAM_OUT "{name}" is no reflectance that is known{nearest(name, QUANTITIES)}', line)
        if outputs not in ((3,) if given[0].endswith("COLOR") else (1, 3)):
            raise file.fail(
                f"{given[0]} cannot have {outputs} outputs, as #DIM says; 1 is a grey, 3 are red, green, blue", line
            )
        line, bounds = words.get("VS", (None, ["0"]))
        if len(bounds) != 1 or bounds[0] not in ("0", "1", "2"):
            raise file.fail("#VS must be 0, 1 or 2: the number of bounds of the error behind each sample", line)
        return _Header(inputs, outputs, int(bounds[0]), parametrisation, given[0])

    def _samples(self, rows: Rows, header: _Header) -> Samples:
        table = rows.array()
        values = table[:, header.inputs :]
        rows.refuse((values < 0).any(axis=1), "a value is negative, which no reflectance is")
        # Columns beyond every domain would overflow in sines and squares.
        rows.refuse((np.abs(table[:, : header.inputs]) > 100).any(axis=1), "an angle is above 100; are the angles in degrees?")
        l, v = header.parametrisation.pair(*table[:, : header.inputs].T)
        rows.refuse(np.isnan(l).any(axis=1) | np.isnan(v).any(axis=1), "these numbers describe no pair of directions")
        above = (l[:, 2] > LOWEST_COSINE) & (v[:, 2] > LOWEST_COSINE)
        notes = () if above.all() else (f"{np.sum(~above)} samples at or below the horizon are left out",)
        samples = Samples(l, v, _rgb(values, header.quantity), header.parametrisation.axes, header.parametrisation.retro, notes)
        samples = samples.chosen(above)
        if header.quantity != "INV_STERADIAN_COSINE_FACTOR":
            return samples
        # The factor is the cosine at the viewer: with it, and not with that at the light, the data of Belcour et al. (2014)
        # are reciprocal.
        return replace(samples, f=samples.f / samples.v[:, 2:])


def _rgb(values: Float64, quantity: str) -> Float64:
    """Returns linear Rec. 709 (N, 3) of the values (N, 1 or 3) of a file."""
    if values.shape[1] == 1:
        return np.repeat(values, 3, axis=1)
    if quantity == "XYZ_COLOR":
        # rgb_weights = matching @ this matrix.
        rgb: Float64 = values @ np.linalg.lstsq(matching(), rgb_weights(), rcond=None)[0]
        return rgb
    return values
