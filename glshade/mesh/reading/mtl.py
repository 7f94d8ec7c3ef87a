"""MTL: the files with materials that OBJ files name."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from glshade.errors import AssetError
from glshade.limits import TEXELS_PER_BYTE
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.file import MeshFile


def materials(file: MeshFile, text: str) -> dict[str, Material]:
    """Returns the materials in the text of an MTL file, by name and in the form of a scene file."""
    statements: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    for line in text.split("\n"):
        word, _, rest = line.strip().replace("\t", " ").partition(" ")
        if word.lower() == "newmtl":
            current = statements[rest.strip()] = {}
        elif word and not word.startswith("#"):
            current[word.lower()] = rest.strip()
    return {name: _material(file, name, given) for name, given in statements.items()}


def _material(file: MeshFile, name: str, given: dict[str, str]) -> Material:
    def numbers(key: str) -> list[float] | None:
        try:
            values = [float(x) for x in given[key].split("#")[0].split()]
        except KeyError:
            return None
        except ValueError:
            file.warn(f"material '{name}': '{key} {given[key]}' is not a number; left out")
            return None
        return values or None

    def colour(key: str) -> list[float] | None:
        values = numbers(key)
        return None if values is None else values[:3] if len(values) >= 3 else values[:1] * 3

    kd: Any = colour("kd")
    if "map_kd" in given:
        texture, wrap, _ = _map_statement(file, given["map_kd"])
        if texture:
            # Many exporters write a Kd of 0 beside a map. As a factor it would make the picture black.
            kd = {"texture": texture, "factor": kd if kd and any(kd) else [1.0, 1.0, 1.0]} | wrap
    # The viewers of this format have shown 0.8 where a material has no Kd.
    material: Material = {"brdf": "lambert", "kd": [0.8, 0.8, 0.8] if kd is None else kd}
    ks = colour("ks")
    # The format defines Ks and Ns with the reflection vector (illum 2), which is Phong and not Blinn-Phong. illum 0 and 1 have
    # no highlight. Neither has Ns 0: programs write it for "no highlight", although the formula would add Ks everywhere.
    exponent = (numbers("ns") or [1.0])[0]
    if ks and any(ks) and exponent > 0 and (numbers("illum") or [2.0])[0] >= 2:
        material |= {"brdf": "phong", "ks": ks, "exponent": exponent}
    ka = colour("ka")
    if ka:
        # Lambert reflects ambient light with kd, so a material with a ka of its own becomes a Phong without a highlight.
        material = {"ks": [0.0, 0.0, 0.0]} | material | {"brdf": "phong", "ka": ka}
    relief = next((key for key in ("norm", "map_bump", "bump") if key in given), None)
    if relief:
        texture, wrap, strength = _map_statement(file, given[relief])
        if texture and (relief == "norm" or _holds_normals(file, texture)):
            material["normal_map"] = {"texture": texture} | wrap | ({"scale": strength} if strength != 1 else {})
        elif texture:
            material["bump_map"] = {"texture": texture, "height": HEIGHT * strength} | wrap
    used = {"map_kd", relief}
    unused = sorted(key for key in given if key.startswith(("map_", "bump", "refl", "disp")) and key not in used)
    if unused:
        file.warn(f"material '{name}': {', '.join(unused)} not used")
    # Tr is 1 - d, but some programs write the opacity there. Nobody writes an invisible material, so a Tr of 1 comes from such
    # a program and means opaque.
    tr = (numbers("tr") or [0.0])[0]
    alpha = (numbers("d") or [1.0 if tr == 1 else 1 - tr])[0]
    if alpha < 1:
        material |= {"alpha": alpha, "alpha_mode": "blend"}
    return material


# The height of white for a bump multiplier (-bm) of 1 [widths of the picture]. The format does not define a unit.
HEIGHT = 0.05
# Heights are grey. In a normal map the mean of blue, the outward component, exceeds the mean of red by about 0.5; a picture is
# taken as a normal map above this difference.
BLUER = 0.2


def _holds_normals(file: MeshFile, texture: str) -> bool:
    """Returns whether the picture of a bump map holds normals instead of heights. Many programs write such files."""
    from glshade.image import file as picture_file

    path = Path(texture)
    if path not in file.normal_maps:
        # The material depends on the content of the picture, not only on its existence, so it becomes a full dependency.
        data = file.read(path)
        try:
            # The renderer reports a picture that is broken or too large.
            fits = picture_file.pixel_count(path) <= max(file.limits.max_texels, TEXELS_PER_BYTE * len(data or b""))
            pixels = picture_file.read(path, "linear")[0] if fits else None
        except AssetError:
            pixels = None
        file.normal_maps[path] = pixels is not None and float((pixels[..., 2] - pixels[..., 0]).mean()) > BLUER
    return file.normal_maps[path]


# The options of a texture statement, with the number of words that follow each. The last two of -o, -s and -t are optional.
_MAP_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2, "-texres": 1,
    "-o": 3, "-s": 3, "-t": 3,
}  # fmt: skip


# Options are read one after another, in a time that grows with the square of the statement's length [characters].
LONGEST_STATEMENT = 10_000


def _map_statement(file: MeshFile, statement: str) -> tuple[str | None, dict[str, list[str]], float]:
    """Returns the path of a texture (None if it is missing), its wrap modes and its bump multiplier (-bm).

    The file's name may contain spaces.
    """
    wrap: dict[str, list[str]] = {}
    strength = 1.0
    if len(statement) > LONGEST_STATEMENT:
        file.warn(f"a texture statement of {len(statement):,} characters is left out")
        return None, wrap, strength
    while statement.startswith("-") and statement.split()[0].lower() in _MAP_OPTIONS:
        option, *words = statement.split()
        taken = _MAP_OPTIONS[option.lower()]
        if option.lower() in ("-o", "-s", "-t"):
            taken = next((k for k, word in enumerate(words[:3]) if not re.fullmatch(r"[-+.\deE]+", word)), 3)
        if option.lower() == "-clamp" and words[:1] == ["on"]:
            wrap = {"wrap": ["clamp", "clamp"]}
        if option.lower() == "-bm":
            try:
                strength = float(words[0])
            except (IndexError, ValueError):
                file.warn(f"'{option} {' '.join(words[:1])}' is not a number; left out")
        statement = statement.split(None, taken + 1)[-1] if len(words) > taken else ""
    return (file.texture(statement) if statement else None), wrap, strength
