"""MTL: the files with materials that OBJ files name (Wavefront; the parameters of physically based rendering by Exocortex)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from glshade.errors import AssetError
from glshade.limits import TEXELS_PER_BYTE
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.mtl_opacity import opacity
from glshade.textures.texture import LARGEST_SCALE, SMALLEST_SCALE

# Makes a material from its statements. Only materials that the OBJ file uses are made, so that others give no warnings.
Given: TypeAlias = Callable[[], Material]

# The height of white for a bump multiplier (-bm) of 1 [widths of the picture]. The format does not define a unit.
HEIGHT = 0.05
# Heights are grey. In a normal map the mean of blue, the outward component, exceeds the mean of red by about 0.5; a picture is
# taken as a normal map above this difference.
BLUER = 0.2
# The largest exponent that the model phong accepts.
LARGEST_EXPONENT = 1e8
# Colours above this are mistakes. The next step, a scene with several lights, would leave float32.
LARGEST_COLOUR = 1e6
# Options are read one after another, in a time that grows with the square of the statement's length [characters].
LONGEST_STATEMENT = 10_000

# The linear Rec. 709 colour of CIE XYZ (IEC 61966-2-1, annex F).
_FROM_XYZ = (
    (3.2404542, -1.5371385, -0.4985314),
    (-0.9692660, 1.8760108, 0.0415560),
    (0.0556434, -0.2040259, 1.0572252),
)
# What the illumination models ask for beyond a highlight (illum 2).
_ILLUMINATION = {
    3: "reflections", 4: "glass", 5: "reflections", 6: "refraction", 7: "refraction",
    8: "reflections", 9: "glass", 10: "shadows on an invisible surface",
}  # fmt: skip
# The statements that this module reads. Ni only matters to refraction, and to the parameters of physically based rendering.
_READ = frozenset((
    "kd", "ks", "ka", "ke", "ns", "ni", "d", "tr", "illum", "tf", "pr", "pm", "aniso", "anisor",
    "map_kd", "map_ks", "map_ka", "map_ke", "map_ns", "map_pr", "map_pm", "map_d", "map_tr", "map_opacity",
    "norm", "map_bump", "bump",
))  # fmt: skip
# Statements that change no picture: the sharpness of reflections, and the smoothing of pictures.
_SILENT = frozenset({"sharpness", "map_aat"})


def materials(file: MeshFile, text: str) -> dict[str, Given]:
    """Returns the materials in the text of an MTL file, by name: functions that return them in the form of a scene file."""
    statements: dict[str, dict[str, str]] = {}
    current: dict[str, str] | None = None
    for line in text.split("\n"):
        word, *rest = line.split(None, 1)[:2] or ("",)
        value = " ".join(rest[0].split()) if rest else ""
        if word.lower() == "newmtl":
            current = statements[value] = {}
        elif word and not word.startswith("#"):
            if current is None:
                file.warn("its material file has statements before the first 'newmtl'; they are left out")
                current = {}
            current[word.lower()] = value
    return {name: partial(_material, file, name, given) for name, given in statements.items()}


def _material(file: MeshFile, name: str, given: dict[str, str]) -> Material:
    return _Statements(file, name, given).material()


@dataclass
class _Statements:
    """The statements of one material: the first word in lower case, and the rest of its line."""

    file: MeshFile
    name: str
    given: dict[str, str]
    unused: list[str] = field(default_factory=list)

    def material(self) -> Material:
        """Returns the material in the form of a scene file."""
        illum = self._number("illum", 2.0)
        kd = self._colour("kd")
        # The viewers of this format have shown 0.8 where a material has no Kd.
        base = self._texture("map_kd", kd) or ([0.8, 0.8, 0.8] if kd is None else kd)
        physical = {"pr", "pm", "map_pr", "map_pm"} & self.given.keys()
        material = self._physical(base) if physical else self._classic(base, illum)
        emission = self._texture("map_ke", self._colour("ke")) or self._colour("ke")
        if emission and (isinstance(emission, dict) or any(emission)):
            material["emission"] = emission
        if illum == 0:
            material = {"brdf": "lambert", "kd": base, "unlit": True}  # the format: a colour alone, without any light
        elif illum in _ILLUMINATION and not physical:
            self.warn(f"illum {illum:g} asks for {_ILLUMINATION[int(illum)]}; drawn with a highlight alone")
        self._relief(material)
        material |= opacity(self.file, material, self._alpha(), self._mask())
        self._warn_unused()
        return material

    def _classic(self, base: Any, illum: float) -> Material:
        """Returns a Phong, or a Lambert where the material has no highlight."""
        material: Material = {"brdf": "lambert", "kd": base}
        ks = self._colour("ks")
        highlight: Any = self._texture("map_ks", ks) or ks
        # The format defines Ks and Ns with the reflection vector (illum 2), which is Phong and not Blinn-Phong. illum 0 and 1
        # have no highlight. Neither has Ns 0: programs write it for "no highlight", although the formula would add Ks
        # everywhere.
        exponent = self._number("ns", 1.0, high=LARGEST_EXPONENT)
        if highlight and (isinstance(highlight, dict) or any(highlight)) and exponent > 0 and illum >= 2:
            varied = self._texture("map_ns", [exponent] * 3, scalar=True)
            material |= {"brdf": "phong", "ks": highlight, "exponent": varied or exponent}
        ka = self._colour("ka")
        ambient = self._texture("map_ka", ka) if self.given.get("map_ka") != self.given.get("map_kd") else None
        if ambient or ka:
            # Lambert reflects ambient light with kd, so a material with a ka of its own becomes a Phong without a highlight.
            material = {"ks": [0.0, 0.0, 0.0]} | material | {"brdf": "phong", "ka": ambient or ka}
        return material

    def _physical(self, base: Any) -> Material:
        """Returns a ggx: Pr and Pm are roughness and metallic as in glTF."""
        if isinstance(base, list) and max(base) > 1:
            self.warn(f"Kd {max(base):g} is above 1, which this material does not allow; clamped")
            base = [min(x, 1.0) for x in base]
        material: Material = {"brdf": "ggx", "kd": base}
        for key, word, default in (("metallic", "pm", 0.0), ("roughness", "pr", 0.5)):
            # A map without a number of its own is not scaled.
            value = self._number(word, 1.0 if f"map_{word}" in self.given else default, high=1.0)
            material[key] = self._texture(f"map_{word}", [value] * 3, scalar=True) or value
        ior = self._number("ni", 1.5)
        if ior > 1 and ior != 1.5:  # 1 stands for "not given" in many files
            material["f0"] = [((ior - 1) / (ior + 1)) ** 2] * 3
        anisotropy = self._number("aniso", 0.0, high=1.0)
        if anisotropy:
            material["anisotropy"] = anisotropy
            turn = 360.0 * self._number("anisor", 0.0)  # a part of a whole turn
            material |= {"tangent_direction": turn} if turn else {}
        return material

    def _relief(self, material: Material) -> None:
        """Adds the normal map or the bump map."""
        relief = next((key for key in ("norm", "map_bump", "bump") if key in self.given), None)
        if not relief:
            return
        picture = _picture(self, relief)
        if picture is None:
            return
        table, strength = {key: value for key, value in picture.table.items() if key != "channel"}, picture.strength
        if relief == "norm" or _holds_normals(self.file, table["texture"]):
            material["normal_map"] = table | ({"scale": strength} if strength != 1 else {})
        else:
            material["bump_map"] = table | {"height": HEIGHT * strength}

    def _alpha(self) -> float:
        """Returns the opacity."""
        if self.given.get("d", "").startswith("-halo"):
            self.warn("the halo of 'd -halo' is not drawn; its opacity is used everywhere")
            self.given["d"] = self.given["d"].removeprefix("-halo").strip()
        # Tr is 1 - d, but some programs write the opacity there. Nobody writes an invisible material, so a Tr of 1 comes from
        # such a program and means opaque.
        tr = self._number("tr", 0.0, high=1.0)
        alpha = self._number("d", 1.0 if tr == 1 else 1.0 - tr, high=1.0)
        filtered = self._colour("tf")
        if filtered and alpha < 1 and any(x != 1 for x in filtered):
            self.warn("the colour that it lets through (Tf) is not used; what lies behind keeps its colour")
        return alpha

    def _mask(self) -> Material | None:
        """Returns the table of the picture that says where the surface is opaque."""
        word = next((key for key in ("map_d", "map_opacity", "map_tr") if key in self.given), None)
        if word == "map_tr":
            self.warn("map_Tr is not used; programs do not agree whether white is opaque there")
            return None
        picture = _picture(self, word) if word else None
        return picture.table if picture else None

    def _texture(self, word: str, factor: list[float] | None, scalar: bool = False) -> Material | None:
        """Returns the table of a texture, multiplied by a factor (3,); None where there is none that can be read.

        scalar: whether the parameter is one number, which reads one channel.
        """
        picture = _picture(self, word) if word in self.given else None
        if picture is None:
            return None
        # Many exporters write a factor of 0 beside a map. It would make the picture black.
        factor = factor if factor and any(factor) else [1.0, 1.0, 1.0]
        table = dict(picture.table)
        channel = table.pop("channel", None)
        if scalar and channel:
            table["channel"] = channel
        base, gain = picture.range
        result = {"texture": table.pop("texture"), "factor": [gain * x for x in factor]} | table
        return result | ({"add": [base * x for x in factor]} if base else {})

    def _number(self, word: str, default: float, high: float = math.inf) -> float:
        """Returns the first number of a statement, at least 0 and at most `high`, with a warning where it had to be changed."""
        values = self._numbers(word)
        if not values:
            return default
        value = min(max(values[0], 0.0), high)
        if value != values[0]:
            self.warn(f"'{word} {values[0]:g}' is outside the range from 0 to {high:g}; {value:g} is used")
        return value

    def _colour(self, word: str) -> list[float] | None:
        """Returns the colour (3,) of a statement; None where there is none that can be read."""
        kind = self.given.get(word, "").lower().partition(" ")[0]
        if kind == "spectral":
            self.warn(f"'{word} spectral' names a spectrum, which is not read; left out")
            return None
        values = self._numbers(word, skip=int(kind == "xyz"))
        if not values:
            return None
        values = values[:3] if len(values) >= 3 else values[:1] * 3
        if kind == "xyz":
            values = [sum(m * x for m, x in zip(row, values, strict=True)) for row in _FROM_XYZ]
        clamped = [min(max(x, 0.0), LARGEST_COLOUR) for x in values]
        if clamped != values:
            shown = " ".join(f"{x:g}" for x in values)
            self.warn(f"the colour {word} = {shown} is outside the range from 0 to {LARGEST_COLOUR:g}; clamped")
        return clamped

    def _numbers(self, word: str, skip: int = 0) -> list[float]:
        """Returns the numbers of a statement. The first `skip` words are none."""
        if word not in self.given:
            return []
        try:
            values = [float(x) for x in self.given[word].split("#")[0].split()[skip:]]
        except ValueError:
            values = [math.nan]
        if not all(map(math.isfinite, values)):
            self.warn(f"'{word} {short(self.given[word])}' is not a number; left out")
            return []
        return values

    def warn(self, message: str) -> None:
        """Adds a warning that names the material."""
        self.file.warn(f"material '{short(self.name)}': {message}")

    def _warn_unused(self) -> None:
        """Warns about everything that has an effect in other programs and none here."""
        unused = [word for word in sorted(self.given) if word not in _READ | _SILENT]
        # Sheen and clear coat of no strength change nothing.
        unused = [word for word in unused if word not in ("ps", "pc", "pcr") or self._number(word, 0.0) > 0]
        if "ps" not in unused:
            unused = [word for word in unused if word != "pcr" or "pc" in unused]
        if unused:
            self.warn(f"{', '.join(map(short, unused[:20]))} not used")


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


@dataclass
class _Picture:
    """The picture of a texture statement.

    table: the keys of a picture in a scene file; "channel" where one was chosen.
    strength: the bump multiplier (-bm).
    range: the value of black, and the difference of white from it (-mm).
    """

    table: Material
    strength: float = 1.0
    range: tuple[float, float] = (0.0, 1.0)


# The options of a texture statement, with the number of words that follow each. The last two of -o, -s and -t are optional.
_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2, "-texres": 1, "-type": 1,
    "-o": 3, "-s": 3, "-t": 3,
}  # fmt: skip
# The values of the options that ask for nothing.
_IDLE = {"-blendu": ("on",), "-blendv": ("on",), "-boost": ("0", "0.0"), "-cc": ("off",), "-clamp": ("off",)}
_CHANNELS = {"r": "r", "g": "g", "b": "b", "m": "a", "l": None}
_NUMBER = re.compile(r"[-+.\deE]+")


def _picture(statements: _Statements, word: str) -> _Picture | None:
    """Returns the picture of a texture statement; None where it is missing. The file's name may contain spaces.

    Options that cannot be drawn give a warning.
    """
    statement, warn = statements.given[word], statements.warn
    if len(statement) > LONGEST_STATEMENT:
        warn(f"a texture statement of {len(statement):,} characters is left out")
        return None
    picture = _Picture({})
    keys: Material = {}
    while statement.startswith("-") and (option := statement.split()[0].lower()) in _OPTIONS:
        words = statement.split()[1:]
        taken = _OPTIONS[option]
        if taken == 3:
            taken = next((k for k, given in enumerate(words[:3]) if not _NUMBER.fullmatch(given)), 3)
        values = words[:taken]
        shown = f"{word}: '{' '.join([option, *values])}'"
        if option in _NUMERIC and (numbers := _floats(values)) is None:
            warn(f"{shown} is not a number; left out")
        elif option in _NUMERIC:
            _NUMERIC[option](picture, keys, numbers, partial(_warn_about, warn, shown))
        elif option == "-clamp" and [x.lower() for x in values] == ["on"]:
            keys["wrap"] = ["clamp", "clamp"]
        elif option == "-imfchan":
            channel = _CHANNELS.get(values[0].lower(), "") if values else ""
            if channel == "":
                warn(f"{shown} names no channel that can be read; left out")
            keys |= {"channel": channel} if channel else {}
        elif option not in _IDLE or " ".join(values).lower() not in _IDLE[option]:
            warn(f"{shown} is not used")
        statement = statement.split(None, taken + 1)[-1] if len(words) > taken else ""
    path = statements.file.texture(statement) if statement else None
    if path is None:
        return None
    picture.table = {"texture": path} | keys
    return picture


def _floats(words: list[str]) -> list[float] | None:
    """Returns the numbers that are written; None where there is none, or a word that is no finite number."""
    try:
        values = [float(x) for x in words]
    except ValueError:
        return None
    return values if values and all(map(math.isfinite, values)) else None


def _warn_about(warn: Callable[[str], None], shown: str, message: str) -> None:
    warn(f"{shown} {message}")


def _bump(picture: _Picture, keys: Material, numbers: Any, warn: Callable[[str], None]) -> None:
    picture.strength = numbers[0]


def _range(picture: _Picture, keys: Material, numbers: Any, warn: Callable[[str], None]) -> None:
    picture.range = (numbers[0], numbers[1] if len(numbers) > 1 else 1.0)


def _offset(picture: _Picture, keys: Material, numbers: Any, warn: Callable[[str], None]) -> None:
    moved = [*numbers, 0.0][:2]
    keys |= {"uv_offset": moved} if any(moved) else {}


def _scale(picture: _Picture, keys: Material, numbers: Any, warn: Callable[[str], None]) -> None:
    scale = [*numbers, 1.0][:2]
    if not all(SMALLEST_SCALE <= abs(x) <= LARGEST_SCALE for x in scale):
        warn(f"must be from {SMALLEST_SCALE:g} to {LARGEST_SCALE:g}; left out")
    elif scale != [1.0, 1.0]:
        keys["uv_scale"] = scale


def _turbulence(picture: _Picture, keys: Material, numbers: Any, warn: Callable[[str], None]) -> None:
    if any(numbers):
        warn("is not used")


# The options whose words are numbers.
_NUMERIC: dict[str, Callable[[_Picture, Material, Any, Callable[[str], None]], None]] = {
    "-bm": _bump,
    "-mm": _range,
    "-o": _offset,
    "-s": _scale,
    "-t": _turbulence,
}
