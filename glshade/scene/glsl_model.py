"""GLSL models: reflectance models that consist of a GLSL file alone. Their parameters are the members of its struct.

Such a model is drawn like any other, but it has no reference: its pictures are verified against its GLSL, run in float64
(glshade/spirv). docs/extending.md explains the comments that declare ranges and defaults.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, Literal

from glshade.brdfs import BRDFS, Array, Brdf, Colour, Law, Parameter, Scalar, parameter
from glshade.errors import NoReference, ShaderError

# The name of a model: a word of small letters, as in `shiny_thing`.
_NAME = re.compile(r"[a-z][a-z0-9_]*")
# A member of a struct, with the comment after it.
_MEMBER = re.compile(r"\s*(?P<type>\w+)\s+(?P<name>\w+)\s*(?P<array>\[.*?\])?\s*;\s*(?://\s*(?P<comment>.*?)\s*)?")
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_PAIR = rf"\[\s*({_NUMBER})\s*,\s*({_NUMBER}|inf)\s*\]"
# The declaration in such a comment: `[0, 1] usual [0, 0.5] default 0.2 unit degrees base: meaning`. Only the range is required.
_DECLARATION = re.compile(
    rf"{_PAIR}(?:,?\s+usual\s+{_PAIR})?"
    rf"(?:,?\s+default\s+(?:({_NUMBER})|\[\s*({_NUMBER})\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\s*\]))?"
    r"(?:,?\s+unit\s+([^\s:,]+))?(?:,?\s+(base))?\s*(?::\s*(.*))?"
)
# The words that `breaks` gives for every law.
_UNKNOWN = "unknown: the model has no reference"


class GlslModel(Brdf):
    """A model that has only a GLSL file.

    path: the file.
    reflects_ambient: whether the file defines `ambient_reflectance`.
    """

    path: ClassVar[Path]
    reflects_ambient: ClassVar[bool]
    breaks: ClassVar[Mapping[Law, str]] = {"reciprocity": _UNKNOWN, "energy": _UNKNOWN}
    has_reference: ClassVar[bool] = False

    @classmethod
    def _traced(cls, by: Literal["light", "ambient"], chosen: tuple[tuple[str, str], ...]) -> frozenset[str]:  # type: ignore[override]
        return frozenset(cls.parameters()) if by == "light" or cls.reflects_ambient else frozenset()

    @classmethod
    def brdf_cos(cls, m: Any, l: Array, v: Array) -> Array:
        raise cls._no_reference()

    @classmethod
    def ambient_reflectance(cls, m: Any) -> Array:
        raise cls._no_reference()

    @classmethod
    def _no_reference(cls) -> NoReference:
        twin = cls.path.with_suffix(".py").name
        return NoReference(
            f'{cls.path}: the model "{cls.path.stem}" has no reference, because no {twin} computes it in float64; '
            "glshade verify compares its pictures with the GLSL itself"
        )


def read_model(path: Path, text: bytes) -> type[GlslModel] | None:
    """Returns the class of the model in a GLSL file; None for a file that defines no model, such as one that models include.

    path: the file.
    text: its content.
    Errors: ShaderError for a struct or a comment that cannot be understood.
    """
    try:
        lines = text.decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise ShaderError(f"{path}: is not UTF-8 text (byte {error.start})") from None
    code = [line.partition("//")[0] for line in lines]
    name, struct = path.stem, BRDFS.class_name(path.stem)
    if not any(re.search(r"\bbrdf_cos\s*\(", line) for line in code):
        return None
    if not _NAME.fullmatch(name):
        raise ShaderError(f"{path}: the name of a model has only small letters, digits and _, and starts with a letter")
    first = next((i for i, line in enumerate(code) if re.match(rf"\s*struct\s+{struct}\b", line)), None)
    if first is None:
        raise ShaderError(f"{path}: has no struct {struct}, whose members are the parameters of the model {name}")
    members = _members(path, lines, first)
    about = _comment_above(lines, first)
    module = _module(name, about)
    namespace: dict[str, Any] = {
        "__module__": module.__name__,
        "__doc__": about,
        "__annotations__": {"brdf": Literal[name]} | {key: annotation for key, (annotation, _) in members.items()},
        "brdf": name,
        "source": f"{path.name}, without a reference",
        "path": path,
        "reflects_ambient": any(re.search(r"\bambient_reflectance\s*\(", line) for line in code),
    }
    model = type(struct, (GlslModel,), namespace | {key: value for key, (_, value) in members.items()})
    # pickle looks up a class in the module of its name.
    setattr(module, struct, model)
    return model


def _members(path: Path, lines: list[str], first: int) -> dict[str, tuple[Any, Any]]:
    """Returns name -> (annotation, pydantic field) of the members of a struct, in their order.

    path: the file, for messages.
    lines: its text.
    first: the index of the struct's first line.
    Errors: ShaderError.
    """
    members: dict[str, tuple[Any, Any]] = {}
    faults: list[str] = []
    for number, line in enumerate(lines[first + 1 :], first + 2):
        if line.lstrip().startswith("}"):
            break
        if line.partition("//")[0].strip() in ("", "{"):
            continue
        try:
            name, annotation, field = _member(line)
            members[name] = annotation, field
        except ValueError as error:
            faults.append(f"{path}:{number}: {error}")
    if faults:
        raise ShaderError("\n".join(faults))
    return members


def _member(line: str) -> tuple[str, Any, Any]:
    """Returns (name, annotation, pydantic field) of the member in a line of a struct. Errors: ValueError with the fault."""
    match = _MEMBER.fullmatch(line)
    if match is None or match["array"] or match["type"] not in ("vec3", "float"):
        raise ValueError("a parameter of a model reads `vec3 NAME;` or `float NAME;`")
    name, is_colour = match["name"], match["type"] == "vec3"
    if name in Brdf.model_fields:
        raise ValueError(f'a parameter cannot have the name "{name}", which is a key of all materials')
    return name, Colour if is_colour else Scalar, _field(name, match["comment"] or "", is_colour)


@dataclass(frozen=True)
class _Declared:
    """The declaration in a comment.

    low, high: the range; high is infinite for a parameter without an upper bound.
    usual: the range that a slider offers; None for the default.
    default: one number or three; None for the default.
    unit: the unit.
    is_base: whether the parameter is the surface's own colour.
    description: the meaning.
    """

    low: float
    high: float
    usual: tuple[float, float] | None = None
    default: tuple[float, ...] | None = None
    unit: str = "1"
    is_base: bool = False
    description: str = ""


def _declared(name: str, comment: str, is_colour: bool) -> _Declared:
    """Returns the declaration in a comment. One that does not start with a bracket is a description alone.

    name: the parameter's name.
    comment: the comment after the struct's member, empty if there is none.
    is_colour: whether the parameter is a colour.
    Errors: ValueError with the fault.
    """
    if not comment.startswith("["):
        return _Declared(0.0, 1.0 if is_colour else math.inf, description=comment or f"the member {name} of the struct")
    match = _DECLARATION.fullmatch(comment)
    if match is None:
        raise ValueError("the comment is no declaration such as `[0, 1] usual [0, 0.5] default 0.2 unit m base: meaning`")
    low, high, *others = (None if text is None else float(text) for text in match.groups()[:8])
    given = tuple(number for number in others[2:] if number is not None)
    return _Declared(
        low or 0.0,
        math.inf if high is None else high,
        None if others[0] is None or others[1] is None else (others[0], others[1]),
        given or None,
        match[9] or "1",
        match[10] is not None,
        match[11] or f"the member {name} of the struct",
    )


def _field(name: str, comment: str, is_colour: bool) -> Any:
    """Returns the pydantic field of a parameter. Arguments and errors: as for `_declared`."""
    declared = _declared(name, comment, is_colour)
    low, high = declared.low, declared.high
    usual = declared.usual or (low, low + 1.0 if math.isinf(high) else high)
    default = declared.default or (min(max(0.5, low), high),)
    if len(default) == 3 and not is_colour:
        raise ValueError("the default of a float is one number")
    if not (low <= usual[0] < usual[1] <= high and all(low <= value <= high for value in default)):
        raise ValueError("the usual range and the default must lie within the range")
    value = default * (3 // len(default)) if is_colour else default[0]
    top = None if math.isinf(high) else high
    return parameter(value, Parameter(declared.description, low, top, usual, declared.unit, base=declared.is_base))


def _comment_above(lines: list[str], first: int) -> str:
    """Returns the text of the comment above a line, or a sentence in its place. first: the index of the line."""
    above: list[str] = []
    while first > 0 and lines[first - 1].startswith("//"):
        first -= 1
        above.insert(0, lines[first].removeprefix("//").strip())
    return " ".join(above) or "A model without a description."


def _module(name: str, about: str) -> ModuleType:
    """Returns a module for the class, whose docstring has the form of those of the other models."""
    module = ModuleType(f"glshade_models.{name}", f"{name}: {about}")
    # pydantic looks up the annotations of a class in the module of this name.
    sys.modules[module.__name__] = module
    return module
