"""The reflectance models: one module each, found by its presence, beside one GLSL file of the same name.

A model's class is its entry in the scene file: parameters with default, range, unit and meaning. `brdf_cos` is its value in
float64: f cos = BRDF times max(n.l, 0) [1/sr], 0 where n.l <= 0 or n.v <= 0.
"""

from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, GetJsonSchemaHandler, Tag, ValidationInfo, field_validator
from pydantic_core import CoreSchema

from glshade.arrays import rounded
from glshade.document import Document, Finite, Triple, fault
from glshade.found import Found
from glshade.textures.texture import BumpMap, DirectionMap, NormalMap, Picture, Texture

Array = NDArray[np.float64]


def _branch(value: Any) -> str:
    return "<texture-table>" if isinstance(value, Mapping | Picture) else "<value>"


# What a parameter may be: three numbers (one stands for three) or one number, or a texture.
Colour = Annotated[Annotated[Triple, Tag("<value>")] | Annotated[Texture, Tag("<texture-table>")], Discriminator(_branch)]
Scalar = Annotated[Annotated[Finite, Tag("<value>")] | Annotated[Texture, Tag("<texture-table>")], Discriminator(_branch)]
# An angle, or a picture of directions.
Turn = Annotated[Annotated[Finite, Tag("<value>")] | Annotated[DirectionMap, Tag("<texture-table>")], Discriminator(_branch)]


@dataclass(frozen=True)
class Parameter:
    """What a model declares of one parameter.

    `low`, `high` bound it; `usual` is the range worth a slider; `same_as` names the parameter it equals when left out;
    `base` marks the surface's own colour, which vertex colours multiply and whose texture carries alpha.
    """

    description: str
    low: float = 0.0
    high: float | None = None
    usual: tuple[float, float] = (0.0, 1.0)
    unit: str = "1"
    same_as: str | None = None
    base: bool = False


def parameter(default: Any, declared: Parameter) -> Any:
    """A pydantic field that carries its declaration."""
    return Field(
        default, description=f"{declared.description} [{declared.unit}]", json_schema_extra={"glshade": vars(declared)}
    )


def choice(default: str, description: str) -> Any:
    """A pydantic field for an option that changes a program's text and is no number: a Literal of names."""
    return Field(default, description=description, json_schema_extra={"glshade_choice": True})


# What a model promises unless it says otherwise: f(l, v) = f(v, l); no more light leaves than arrives.
Law = Literal["reciprocity", "energy"]


@dataclass(frozen=True)
class Limit:
    """Two materials that are the same function of directions, and how it is said. within: relative, in float64."""

    says: str
    one: "Brdf"
    other: "Brdf"
    within: float = 1e-9


class Brdf(Document):
    """A material: a model's parameters, and what every material may say of its surface besides."""

    brdf: str
    alpha: Annotated[float, Field(ge=0, le=1)] = Field(1.0, description="opacity; the base texture's alpha multiplies it")
    alpha_mode: Literal["opaque", "mask", "blend"] = Field(
        "opaque",
        description="opaque: alpha is ignored; mask: cut out below alpha_cutoff; blend: drawn back to front (approximate)",
    )
    alpha_cutoff: Annotated[float, Field(ge=0, le=1)] = Field(0.5, description="mask: what is less opaque is cut out")
    normal_map: NormalMap | None = Field(None, description="tangent-space normals")
    bump_map: BumpMap | None = Field(None, description="or heights, from which normals are made")
    tangent_direction: Turn = Field(
        0.0, description="anisotropic models: how far the tangent is turned, from u toward v [degrees]"
    )
    sides: Literal["auto", "front", "both"] = Field("auto", description="sides of the surface; an object may say otherwise")

    # Paper, year and equations.
    source: ClassVar[str] = ""
    # Laws that the model does not keep, and why.
    breaks: ClassVar[Mapping[Law, str]] = {}
    # Reflectances that share one budget: the law of energy is promised where their sum is at most 1.
    shares: ClassVar[tuple[str, ...]] = ()
    # Of a model that looks at the tangent directions: what to set, to another parameter's value or a number, so that nothing
    # hangs on them.
    isotropic_where: ClassVar[Mapping[str, str | float]] = {}
    # Whether the model looks at the tangent directions.
    anisotropic: ClassVar[bool] = False

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        cls.anisotropic = bool(cls.isotropic_where)

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        """The simpler models that this one becomes."""
        return ()

    @classmethod
    @cache
    def parameters(cls) -> dict[str, Parameter]:
        """name -> declaration, in the order of the GLSL struct."""
        found = {}
        for name, field in cls.model_fields.items():
            extra = field.json_schema_extra
            if isinstance(extra, dict) and "glshade" in extra:
                found[name] = Parameter(**extra["glshade"])  # type: ignore[arg-type]
        return found

    @classmethod
    @cache
    def choices(cls) -> tuple[str, ...]:
        """The names of the options."""
        extras = {name: field.json_schema_extra for name, field in cls.model_fields.items()}
        return tuple(name for name, extra in extras.items() if isinstance(extra, dict) and "glshade_choice" in extra)

    def chosen(self) -> dict[str, str]:
        """option -> choice."""
        return {name: getattr(self, name) for name in self.choices()}

    def half_angle(self) -> "Brdf":
        """The model with h in place of the mirror direction, where it has that: an approximation (lecture slide 20)."""
        return self

    def specular_part(self) -> "Brdf | None":
        """The material whose f is this one's without its diffuse lobes; None where it has no others.

        What it reflects of ambient light counts as diffuse.
        """
        return None

    @classmethod
    @cache
    def base(cls) -> str | None:
        """The parameter that is the surface's own colour."""
        return next((name for name, declared in cls.parameters().items() if declared.base), None)

    def without_base(self) -> "Brdf":
        """The material with its own colour black: its specular part, where that colour is the diffuse lobe's alone."""
        name = self.base()
        if name is None:
            return self
        value, black = getattr(self, name), (0.0, 0.0, 0.0)
        # What is cut out or let through stays so: a texture keeps its alpha.
        keeps = isinstance(value, Texture) and self.alpha_mode != "opaque"
        return self.model_copy(update={name: value.model_copy(update={"factor": black}) if keeps else black})

    def slots(self) -> dict[str, str]:
        """GLSL for the places that the model's file names in angle brackets. What this material does not need is not in it."""
        return {}

    @property
    def needs_tangents(self) -> bool:
        """Whether this material looks at the tangent directions."""
        return self.anisotropic

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        """The parameters that light from a direction, or ambient light, asks for."""
        return self._traced(by, tuple(self.chosen().items()))

    @classmethod
    @cache
    def _traced(cls, by: Literal["light", "ambient"], chosen: tuple[tuple[str, str], ...]) -> frozenset[str]:
        """Seen by running the model once."""
        asked = _Asked(cls, dict(chosen))
        up = np.array([[0.0, 0.0, 1.0]])
        if by == "light":
            cls.brdf_cos(asked, up, up)
        else:
            cls.ambient_reflectance(asked)
        return frozenset(asked.names)

    @classmethod
    @cache
    def is_colour(cls, name: str) -> bool:
        """Whether the parameter has three channels."""
        default = cls.model_fields[name].default
        same_as = cls.parameters()[name].same_as
        return cls.is_colour(same_as) if default is None and same_as else isinstance(default, tuple)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The bounds are checked by `_within`; here the schema learns of them."""
        described = handler(schema)
        properties = handler.resolve_ref_schema(described)["properties"]
        for name, declared in cls.parameters().items():
            # A copy: fields of one kind share what describes them.
            properties[name] = deepcopy(properties[name])
            _bound(properties[name], declared)
        return described

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if not isinstance(data, Mapping):
            return
        if data.get("normal_map") is not None and data.get("bump_map") is not None:
            yield ("bump_map",), "not together with normal_map: each says which way the surface faces"
        if not cls.anisotropic and data.get("tangent_direction", 0) != 0:
            name = data.get("brdf", cls.model_fields["brdf"].default)
            yield ("tangent_direction",), f"{name} is alike all round: it has no direction to turn"

    @field_validator("*", mode="after")
    @classmethod
    def _within(cls, value: Any, info: ValidationInfo) -> Any:
        declared = cls.parameters().get(info.field_name or "")
        if declared is not None and isinstance(value, Texture) and value.channel and cls.is_colour(info.field_name or ""):
            raise fault(f'a colour takes three channels, and cannot be told channel = "{value.channel}"')
        if declared is None or value is None or isinstance(value, Texture):
            return value
        numbers = value if isinstance(value, tuple) else (value,)
        if min(numbers) < declared.low:
            raise fault(f"must be at least {declared.low:g}, not {min(numbers):g}")
        if declared.high is not None and max(numbers) > declared.high:
            raise fault(f"must be at most {declared.high:g}, not {max(numbers):g}")
        return value

    def canonical(self, ambient: bool) -> "Brdf":
        """The simplest model with the same value: lobes of weight zero drop out. `ambient`: whether ambient light counts."""
        return self

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        """f cos [1/sr], (..., 3), in float64; `m` has the parameters as arrays, colours (..., 3) and scalars (...), and the
        choices as strings.

        l, v (..., 3): unit directions in the local frame, z along the normal, x along the tangent.
        """
        raise NotImplementedError

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        """(..., 3): what the model reflects of ambient light."""
        raise NotImplementedError


class _Asked:
    """Stands for a material, and notes which parameters are looked at."""

    def __init__(self, model: type[Brdf], chosen: dict[str, str]) -> None:
        self.names: set[str] = set()
        self._model, self._chosen = model, chosen

    def __getattr__(self, name: str) -> Array | str:
        if name in self._chosen:
            return self._chosen[name]
        self.names.add(name)
        return np.full((1, 3) if self._model.is_colour(name) else (1,), 0.5)


def _bound(schema: dict[str, Any], declared: Parameter) -> None:
    """Adds the bounds to every number that the schema allows."""
    if schema.get("type") == "number":
        schema["minimum"] = declared.low
        if declared.high is not None:
            schema["maximum"] = declared.high
    parts = [*schema.get("anyOf", ()), *schema.get("oneOf", ())]
    for part in [*parts, schema["items"]] if "items" in schema else parts:
        _bound(part, declared)


def above_horizon(l: Array, v: Array, value: Array) -> Array:
    """`value` (..., 3) where both directions are above the horizon, else 0: the contract of every model."""
    return np.where(((l[..., 2] > 0) & (v[..., 2] > 0))[..., None], value, 0.0)


BRDFS: Found[Brdf] = Found("glshade.brdfs", Path(__file__).parent)


def numbers(brdf: Brdf) -> dict[str, NDArray[np.float32]]:
    """name -> value of a material without textures, as the GPU gets it. Errors: ValueError for a texture."""
    values = parameter_values(brdf)
    for name, value in values.items():
        if isinstance(value, Texture):
            raise ValueError(f"{name} is a texture where a number is needed")
    return {name: rounded(value) for name, value in values.items()}


def widened(brdf: Brdf) -> SimpleNamespace:
    """The same numbers in float64, with the choices: what `Brdf.brdf_cos` takes. Errors: ValueError for a texture."""
    return SimpleNamespace(**{name: value.astype(np.float64) for name, value in numbers(brdf).items()}, **brdf.chosen())


def parameter_values(material: Brdf) -> dict[str, Any]:
    """name -> value, with what is left out filled in."""
    values = {name: (getattr(material, name), declared.same_as) for name, declared in material.parameters().items()}
    return {
        name: getattr(material, same_as) if value is None and same_as else value for name, (value, same_as) in values.items()
    }
