"""The reflectance models. Each is a module of this package, found by its presence, and a GLSL file of the same name.

A model's class describes its table in the scene file: each parameter with default, range, unit and meaning. Its `brdf_cos`
computes f cos in float64: the BRDF f times max(n.l, 0) [1/sr], and 0 where n.l <= 0 or n.v <= 0. n is the normal, l the
direction to the light, and v the direction to the viewer. The shape (...) stands for any leading shape.
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
from glshade.errors import figure
from glshade.found import Found
from glshade.textures.texture import BumpMap, DirectionMap, NormalMap, OcclusionMap, Picture, Texture

Array = NDArray[np.float64]


def _branch(value: Any) -> str:
    return "<texture-table>" if isinstance(value, Mapping | Picture) else "<value>"


# The types of parameters. A colour is three numbers (one number stands for three equal ones) or a texture; a scalar is one
# number or a texture.
Colour = Annotated[Annotated[Triple, Tag("<value>")] | Annotated[Texture, Tag("<texture-table>")], Discriminator(_branch)]
Scalar = Annotated[Annotated[Finite, Tag("<value>")] | Annotated[Texture, Tag("<texture-table>")], Discriminator(_branch)]
# An angle, or a texture that holds a direction in each texel.
Turn = Annotated[Annotated[Finite, Tag("<value>")] | Annotated[DirectionMap, Tag("<texture-table>")], Discriminator(_branch)]


@dataclass(frozen=True)
class Parameter:
    """A model's declaration of one parameter.

    description: its meaning, for the documentation.
    low: the smallest value allowed.
    high: the largest value allowed; None for no limit.
    usual: the range that a slider would offer.
    unit: the unit; "1" for a number without one.
    same_as: the name of another parameter, whose value is the default.
    base: whether it is the surface's own colour. Vertex colours multiply that one, and its texture holds alpha.
    """

    description: str
    low: float = 0.0
    high: float | None = None
    usual: tuple[float, float] = (0.0, 1.0)
    unit: str = "1"
    same_as: str | None = None
    base: bool = False


def parameter(default: Any, declared: Parameter) -> Any:
    """Returns a pydantic field for a parameter, with the declaration attached."""
    return Field(
        default, description=f"{declared.description} [{declared.unit}]", json_schema_extra={"glshade": vars(declared)}
    )


@dataclass(frozen=True)
class Slot:
    """GLSL that takes the place of a name in angle brackets in a model's GLSL file.

    includes: shader files, by their names below the shader folders.
    text: GLSL that follows them.
    """

    includes: tuple[str, ...] = ()
    text: str = ""


def choice(default: str, description: str) -> Any:
    """Returns a pydantic field for an option: a Literal of names, one of which is chosen and changes the generated program."""
    return Field(default, description=description, json_schema_extra={"glshade_choice": True})


# The emission of every material. It is declared like a model's parameter, but it is no member of the models' structs: it is
# light that the surface adds, whatever its model reflects.
EMISSION = Parameter("light that the surface emits, added to the light that it reflects: 1 looks white")
BLACK = (0.0, 0.0, 0.0)


# Physical properties that every model has unless its `breaks` names them. Reciprocity: f(l, v) = f(v, l). Energy: no more light
# leaves a surface than arrives.
Law = Literal["reciprocity", "energy"]


@dataclass(frozen=True)
class Limit:
    """Two materials that have the same f cos for all directions.

    says: the statement in words, for the documentation.
    one: the first material.
    other: the second material.
    within: the relative difference allowed in float64.
    """

    says: str
    one: "Brdf"
    other: "Brdf"
    within: float = 1e-9


class Brdf(Document):
    """A material: the parameters of a model, and the keys that all materials share."""

    brdf: str
    alpha: Annotated[float, Field(ge=0, le=1)] = Field(1.0, description="opacity; the base texture's alpha multiplies it")
    alpha_mode: Literal["opaque", "mask", "blend"] = Field(
        "opaque",
        description="opaque: alpha is ignored; mask: not drawn below alpha_cutoff; blend: drawn back to front (approximate)",
    )
    alpha_cutoff: Annotated[float, Field(ge=0, le=1)] = Field(
        0.5, description="mask: pixels with a smaller alpha are not drawn"
    )
    emission: Colour = Field(BLACK, description=EMISSION.description)
    occlusion: OcclusionMap | None = Field(None, description="how much of the ambient light reaches each point")
    unlit: bool = Field(False, description="whether the surface shows its base colour in place of the light that it reflects")
    normal_map: NormalMap | None = Field(None, description="tangent-space normals")
    bump_map: BumpMap | None = Field(None, description="heights that normals are computed from; not together with normal_map")
    tangent_direction: Turn = Field(
        0.0, description="anisotropic models: the angle by which the tangent is turned from u toward v [degrees]"
    )
    sides: Literal["auto", "front", "both"] = Field("auto", description="the sides that are drawn; an object can override it")

    # The publication: authors, year and equations.
    source: ClassVar[str] = ""
    # The properties that the model lacks by design, each with the reason.
    breaks: ClassVar[Mapping[Law, str]] = {}
    # The reflectances whose sum must be at most 1 to conserve energy. Empty where all values in range conserve energy.
    shares: ClassVar[tuple[str, ...]] = ()
    # How to make an anisotropic model isotropic: parameter -> a number, or the name of the parameter whose value it gets. Empty
    # for a model that is always isotropic.
    isotropic_where: ClassVar[Mapping[str, str | float]] = {}
    # Four materials that show what the model can do, as parameters that differ from the defaults; docs/brdfs.md draws them from
    # left to right. A model may leave this empty, and the page then varies its first parameter.
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = ()
    # Whether `brdf_cos` computes the model. A model that has only a GLSL file has no reference to compare its pictures with.
    has_reference: ClassVar[bool] = True
    # Whether the model's value can depend on the tangent directions.
    anisotropic: ClassVar[bool] = False

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        cls.anisotropic = bool(cls.isotropic_where)

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        """Returns pairs of equal materials: at certain parameters this model equals a simpler one."""
        return ()

    @classmethod
    @cache
    def parameters(cls) -> dict[str, Parameter]:
        """Returns the declarations of the parameters by name, in the order of the members of the GLSL struct."""
        found = {}
        for name, field in cls.model_fields.items():
            extra = field.json_schema_extra
            if isinstance(extra, dict) and "glshade" in extra:
                found[name] = Parameter(**extra["glshade"])  # type: ignore[arg-type]
        return found

    @classmethod
    def declared(cls, name: str) -> Parameter | None:
        """Returns the declaration of a parameter or of emission; None for the other keys."""
        return EMISSION if name == "emission" else cls.parameters().get(name)

    @classmethod
    @cache
    def choices(cls) -> tuple[str, ...]:
        """Returns the names of the options."""
        extras = {name: field.json_schema_extra for name, field in cls.model_fields.items()}
        return tuple(name for name, extra in extras.items() if isinstance(extra, dict) and "glshade_choice" in extra)

    def chosen(self) -> dict[str, str]:
        """Returns the name that is chosen for each option."""
        return {name: getattr(self, name) for name in self.choices()}

    def half_angle(self) -> "Brdf":
        """Returns the half-angle variant of a model that uses the mirror direction: an approximation (lecture slide 20). Other
        models return themselves."""
        return self

    def specular_part(self) -> "Brdf | None":
        """Returns the same material without its diffuse lobes; None for a model that has only diffuse lobes.

        Ambient reflection counts as diffuse.
        """
        return None

    @classmethod
    @cache
    def base(cls) -> str | None:
        """Returns the name of the parameter that is the surface's own colour; None if the model has no such parameter."""
        return next((name for name, declared in cls.parameters().items() if declared.base), None)

    def without_base(self) -> "Brdf":
        """Returns the material with a black base colour: its specular part, if only the diffuse lobe uses that colour."""
        name = self.base()
        if name is None:
            return self
        value = getattr(self, name)
        # Where alpha matters, the texture stays for its alpha, and a factor of 0 makes its colours black.
        keeps = isinstance(value, Texture) and self.alpha_mode != "opaque"
        return self.model_copy(update={name: value.model_copy(update={"factor": BLACK, "add": BLACK}) if keeps else BLACK})

    @property
    def emits(self) -> bool:
        """Whether the surface may emit light."""
        return any((*self.emission.factor, *self.emission.add) if isinstance(self.emission, Texture) else self.emission)

    def slots(self) -> dict[str, Slot]:
        """Returns the GLSL for each name in angle brackets in the model's GLSL file. Parts that this material does not need are
        left out."""
        return {}

    @property
    def needs_tangents(self) -> bool:
        """Whether the value of this material depends on the tangent directions."""
        return self.anisotropic

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        """Returns the parameters that the model reads for light from a direction, or for ambient light."""
        return self._traced(by, tuple(self.chosen().items()))

    @classmethod
    @cache
    def _traced(cls, by: Literal["light", "ambient"], chosen: tuple[tuple[str, str], ...]) -> frozenset[str]:
        """Returns the parameters that the model reads, found by evaluating it once with a stand-in that records them."""
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
        """Returns whether the parameter, or emission, is a colour."""
        default, declared = cls.model_fields[name].default, cls.declared(name)
        same_as = declared.same_as if declared else None
        return cls.is_colour(same_as) if default is None and same_as else isinstance(default, tuple)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Adds the parameters' bounds to the JSON schema. pydantic does not know them, because `_within` checks them."""
        described = handler(schema)
        properties = handler.resolve_ref_schema(described)["properties"]
        for name, declared in {**cls.parameters(), "emission": EMISSION}.items():
            # Fields of one type share their description, so a copy is changed.
            properties[name] = deepcopy(properties[name])
            _bound(properties[name], declared)
        return described

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if not isinstance(data, Mapping):
            return
        if data.get("normal_map") is not None and data.get("bump_map") is not None:
            yield ("bump_map",), "cannot be used together with normal_map, since both set the normal"
        if not cls.anisotropic and data.get("tangent_direction", 0) != 0:
            name = data.get("brdf", cls.model_fields["brdf"].default)
            yield ("tangent_direction",), f"has no effect, because {name} is isotropic"

    @field_validator("*", mode="after")
    @classmethod
    def _within(cls, value: Any, info: ValidationInfo) -> Any:
        declared = cls.declared(info.field_name or "")
        if declared is not None and isinstance(value, Texture) and value.channel and cls.is_colour(info.field_name or ""):
            raise fault(f'a colour reads three channels, so channel = "{value.channel}" is not allowed')
        if declared is None or value is None or isinstance(value, Texture):
            return value
        numbers = value if isinstance(value, tuple) else (value,)
        if min(numbers) < declared.low:
            raise fault(f"must be at least {declared.low:g}, not {figure(min(numbers))}")
        if declared.high is not None and max(numbers) > declared.high:
            raise fault(f"must be at most {declared.high:g}, not {figure(max(numbers))}")
        return value

    def canonical(self, ambient: bool) -> "Brdf":
        """Returns the simplest material with the same value; lobes of weight zero are left out.

        ambient: whether ambient light reaches the material, so that its ambient reflectance must stay the same too.
        """
        return self

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        """Returns f cos (..., 3) [1/sr] in float64.

        m: the material, with colours (..., 3) and scalars (...) as arrays and options as strings.
        l: unit directions to the light (..., 3) in the local frame, in which z is the normal and x the tangent.
        v: unit directions to the viewer (..., 3) in the same frame.
        """
        raise NotImplementedError

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        """Returns the share of ambient light that the material reflects (..., 3). m: as for `brdf_cos`."""
        raise NotImplementedError


class _Asked:
    """A stand-in for a material that records the parameters which are read."""

    def __init__(self, model: type[Brdf], chosen: dict[str, str]) -> None:
        self.names: set[str] = set()
        self._model, self._chosen = model, chosen

    def __getattr__(self, name: str) -> Array | str:
        if name in self._chosen:
            return self._chosen[name]
        self.names.add(name)
        return np.full((1, 3) if self._model.is_colour(name) else (1,), 0.5)


def _bound(schema: dict[str, Any], declared: Parameter) -> None:
    """Adds the bounds to every number in the schema."""
    if schema.get("type") == "number":
        schema["minimum"] = declared.low
        if declared.high is not None:
            schema["maximum"] = declared.high
    parts = [*schema.get("anyOf", ()), *schema.get("oneOf", ())]
    for part in [*parts, schema["items"]] if "items" in schema else parts:
        _bound(part, declared)


def above_horizon(l: Array, v: Array, value: Array) -> Array:
    """Returns `value` (..., 3) where both directions are above the horizon, else 0. Every model has to have these zeros."""
    return np.where(((l[..., 2] > 0) & (v[..., 2] > 0))[..., None], value, 0.0)


BRDFS: Found[Brdf] = Found("glshade.brdfs", Path(__file__).parent)


def numbers(brdf: Brdf) -> dict[str, NDArray[np.float32]]:
    """Returns the parameters of a material without textures by name, rounded to float32. Errors: ValueError for a texture."""
    values = parameter_values(brdf)
    for name, value in values.items():
        if isinstance(value, Texture):
            raise ValueError(f"{name} is a texture where a number is needed")
    return {name: rounded(value) for name, value in values.items()}


def widened(brdf: Brdf) -> SimpleNamespace:
    """Returns the material as `Brdf.brdf_cos` takes it: the float32 values, widened to float64, and the options.

    Errors: ValueError for a texture.
    """
    return SimpleNamespace(**{name: value.astype(np.float64) for name, value in numbers(brdf).items()}, **brdf.chosen())


def parameter_values(material: Brdf) -> dict[str, Any]:
    """Returns the values of the parameters by name. A parameter that was left out has the value of its `same_as`."""
    values = {name: (getattr(material, name), declared.same_as) for name, declared in material.parameters().items()}
    return {
        name: getattr(material, same_as) if value is None and same_as else value for name, (value, same_as) in values.items()
    }
