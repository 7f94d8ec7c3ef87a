"""docs/presets.md from glshade/presets/: `script/presets.py` writes it, `--check` only compares."""

from __future__ import annotations

import sys
from pathlib import Path

from glshade.presets import PRESETS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "presets.md"

INTRODUCTION = """\
# Presets

<!-- Made by script/presets.py from glshade/presets/; change those, not this. -->

Materials by name. `material = "gold"` in an object takes the scene's own material of that name or, where it has none, the
preset. A material may start from a preset and go on from there; its model is the preset's:

```toml
[materials]
worn_gold = { preset = "gold", roughness = 0.5 }
```

A preset is a file in `glshade/presets/`, found by its presence. In Python: `from glshade.presets import PRESETS, preset`.

`scenes/materials.toml` shows them.

| preset | model | looks like | source |
|---|---|---|---|
"""

METALS = """
## Where the metals' figures are from

`script/make-conductors` derives eta and k of the metals from published spectra, and compares them with the presets. The
reflectance of a spectrum by Fresnel's equations, under D65 to the CIE 1931 2-degree observer, is a colour in linear Rec. 709
for each of 90 angles; (eta, k) of a channel is what has that channel's curve, by least squares weighted with the cosine. The
curves are met to 0.006 over all angles, most to 0.001. The exception is gold's red: its colour is outside Rec. 709, with 1.04
in red, and the preset has 0.98.

Measurements of one metal differ by more than that, with the film, its age and its oxide: by 0.01 (aluminium) to 0.1 (chromium,
iron, titanium).
"""


def page() -> str:
    """The text of docs/presets.md."""
    rows = [f"| `{name}` | `{p.material['brdf']}` | {p.description} | {p.source} |\n" for name, p in PRESETS.items()]
    return INTRODUCTION + "".join(rows) + METALS


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        current = PAGE.exists() and PAGE.read_text(encoding="utf-8") == page()
        sys.exit(0 if current else "docs/presets.md is out of date: run .venv/bin/python script/presets.py")
    PAGE.write_text(page(), encoding="utf-8")
