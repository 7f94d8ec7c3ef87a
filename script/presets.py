"""Writes docs/presets.md from glshade/presets/. `--check` only compares."""

from __future__ import annotations

import sys
from pathlib import Path

from glshade.presets import PRESETS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "presets.md"

INTRODUCTION = """\
# Presets

<!-- Made by script/presets.py from glshade/presets/; change those, not this. -->

A preset is a material with a name. `material = "gold"` in an object means the scene's own material of that name or, if there is
none, the preset. A material may start from a preset and change some of its parameters. It keeps the preset's model:

```toml
[materials]
worn_gold = { preset = "gold", roughness = 0.5 }
```

Each file in `glshade/presets/` is a preset; no list names them. In Python: `from glshade.presets import PRESETS, preset`.
`scenes/materials.toml` shows all of them.

| preset | model | description | source |
|---|---|---|---|
"""

METALS = """
## The metals' figures

`script/make-conductors` derives eta and k of the metals from published spectra, and compares them with the presets. Fresnel's
equations turn a spectrum into a reflectance for each wavelength and angle. Under D65 and for the CIE 1931 2-degree observer,
this gives a colour in linear Rec. 709 for each of 90 angles. For each channel, (eta, k) is fitted to this curve by least
squares, weighted with the cosine. The fitted curves are within 0.006 at all angles, and most are within 0.001. The exception is
gold's red: its colour is outside Rec. 709, with 1.04 in red, and the preset has 0.98.

Measurements of one metal differ by more than that, depending on the film, its age and its oxide: by 0.01 (aluminium) to 0.1
(chromium, iron, titanium).
"""


def page() -> str:
    """Returns the text of docs/presets.md."""
    rows = [f"| `{name}` | `{p.material['brdf']}` | {p.description} | {p.source} |\n" for name, p in PRESETS.items()]
    return INTRODUCTION + "".join(rows) + METALS


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        current = PAGE.exists() and PAGE.read_text(encoding="utf-8") == page()
        sys.exit(0 if current else "docs/presets.md is out of date: run .venv/bin/python script/presets.py")
    PAGE.write_text(page(), encoding="utf-8")
