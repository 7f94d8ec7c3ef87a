"""MTL: the material files that OBJ files name."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from glshade.errors import AssetError
from glshade.mesh.formats.contents import Material
from glshade.mesh.formats.file import File


def materials(file: File, text: str) -> dict[str, Material]:
    """Materials by name, in the scene file's form."""
    statements: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    for line in text.split("\n"):
        word, _, rest = line.strip().replace("\t", " ").partition(" ")
        if word.lower() == "newmtl":
            current = statements[rest.strip()] = {}
        elif word and not word.startswith("#"):
            current[word.lower()] = rest.strip()
    return {name: _material(file, name, given) for name, given in statements.items()}


def _material(file: File, name: str, given: dict[str, str]) -> Material:
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
            # Many exporters leave Kd at 0 beside a map; taken as a factor it would turn the picture black.
            kd = {"texture": texture, "factor": kd if kd and any(kd) else [1.0, 1.0, 1.0]} | wrap
    # 0.8: what the format's own viewers showed where a material states no Kd.
    material: Material = {"brdf": "lambert", "kd": [0.8, 0.8, 0.8] if kd is None else kd}
    ks = colour("ks")
    # The format defines Ks and Ns with the reflection vector (illum 2): Phong, not Blinn-Phong. illum 0 and 1 have no
    # highlight, and neither has Ns 0: programs write it for "none", where the formula would give all of Ks everywhere.
    exponent = (numbers("ns") or [1.0])[0]
    if ks and any(ks) and exponent > 0 and (numbers("illum") or [2.0])[0] >= 2:
        material |= {"brdf": "phong", "ks": ks, "exponent": exponent}
    ka = colour("ka")
    if ka:
        # Lambert reflects ambient light with kd; a ka of its own makes it a Phong without a highlight.
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
    # Tr is 1 - d, but some programs write opacity there. Nobody writes a material that cannot be seen, so 1 is theirs
    # and means opaque.
    tr = (numbers("tr") or [0.0])[0]
    alpha = (numbers("d") or [1.0 if tr == 1 else 1 - tr])[0]
    if alpha < 1:
        material |= {"alpha": alpha, "alpha_mode": "blend"}
    return material


# How high white stands for a -bm of 1 [widths of the picture]; the format leaves the unit open.
HEIGHT = 0.05
# Heights are grey. In a picture of normals blue, which points outward, lies above red by about half.
BLUER = 0.2


def _holds_normals(file: File, texture: str) -> bool:
    """Whether a bump map has normals in place of heights, as many programs write it."""
    from glshade.image import file as picture_file

    # What is read here depends on the picture's content, not on its presence alone.
    file.read(Path(texture))
    try:
        pixels, _ = picture_file.read(texture, "linear")
    except AssetError:
        return False  # which is said when it is drawn
    return float((pixels[..., 2] - pixels[..., 0]).mean()) > BLUER


# Options of a texture statement and how many words they take; of -o, -s and -t the last two may be missing.
_MAP_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2, "-texres": 1,
    "-o": 3, "-s": 3, "-t": 3,
}  # fmt: skip


def _map_statement(file: File, statement: str) -> tuple[str | None, dict[str, list[str]], float]:
    """The texture's path (None if missing), its wrap mode and its -bm; names may hold spaces."""
    wrap, strength = {}, 1.0
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
