"""The reflectance models. Each is a module of this package, found by its presence, and a GLSL file of the same name.

A model's class describes its table in the scene file: each parameter with default, range, unit and meaning. Its `brdf_cos`
computes f cos in float64: the BRDF f times max(n.l, 0) [1/sr], and 0 where n.l <= 0 or n.v <= 0. n is the normal, l the
direction to the light, and v the direction to the viewer. The shape (...) stands for any leading shape.
"""

import warnings
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Tag,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema

from glshade.arrays import rounded
from glshade.document import Document, Finite, Shorthand, Triple, fault
from glshade.errors import AssetWarning, figure
from glshade.found import Found
from glshade.optics.reradiation import Reradiation
from glshade.optics.spectra import Spectrum, is_spectrum
from glshade.textures.texture import BumpMap, DirectionMap, NormalMap, OcclusionMap, Picture, Texture
from glshade.textures.volume import Volume

Array = NDArray[np.float64]


def _branch(value: Any) -> str:
    return "<texture-table>" if isinstance(value, Mapping | Picture) else "<value>"


def _branch_of_colour(value: Any) -> str:
    return "<spectrum-table>" if is_spectrum(value) else _branch(value)


def _no_spectrum(value: Any) -> Any:
    if is_spectrum(value):
        raise fault("is one number, so that it cannot be a spectrum")
    return value


# The types of parameters. A colour is three numbers (one number stands for three equal ones), a spectrum or a texture; a scalar
# is one number or a texture.
Colour = Annotated[
    Annotated[Triple, Tag("<value>")]
    | Annotated[Spectrum, Tag("<spectrum-table>")]
    | Annotated[Texture, Tag("<texture-table>")],
    Discriminator(_branch_of_colour),
]
Scalar = Annotated[
    Annotated[Finite, Tag("<value>")] | Annotated[Texture, Tag("<texture-table>")],
    Discriminator(_branch),
    BeforeValidator(_no_spectrum),
]
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
    held: whether the ends of its spectrum's table hold beyond them, as those of a refractive index; otherwise it is 0 there.
    """

    description: str
    low: float = 0.0
    high: float | None = None
    usual: tuple[float, float] = (0.0, 1.0)
    unit: str = "1"
    same_as: str | None = None
    base: bool = False
    held: bool = False


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
    reradiation: Annotated[Reradiation, Shorthand("file")] | None = Field(
        None, description="fluorescence: a file of the light that the surface gives off at other wavelengths; docs/spectral.md"
    )

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
    # The colours in which f cos and the ambient reflectance are linear together, channel by channel, while all else is equal at
    # all wavelengths. Spectra of these colours are integrated before drawing; those of others are drawn in bands.
    linear: ClassVar[tuple[str, ...]] = ()
    # The tables that the model reads: name -> the key that names the table's file. `brdf_cos` gets the table NAME as m.NAME,
    # and the model's GLSL file declares it as `uniform sampler3D u_NAME;`.
    tables: ClassVar[Mapping[str, str]] = {}

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

    def linear_colours(self) -> tuple[str, ...]:
        """Returns the colours of `linear`, without those in which this material is not linear."""
        return self.linear

    @property
    def mixes_channels(self) -> bool:
        """Whether a channel of the material's light depends on the other channels of its colours."""
        return False

    @property
    def is_handed(self) -> bool:
        """Whether the surface reflects light differently when light, viewer and normal are all mirrored."""
        return False

    def table(self, name: str) -> Volume:
        """Returns a table of `tables`. Errors: AssetError for a file that cannot be read."""
        raise NotImplementedError

    def volumes(self) -> dict[str, Volume]:
        """Returns all tables by name. Errors: AssetError for a file that cannot be read."""
        return {name: self.table(name) for name in self.tables}

    def notes(self) -> tuple[str, ...]:
        """Returns sentences about the material's tables, for `glshade explain`. Errors: AssetError."""
        return ()

    def data(self) -> dict[str, Any]:
        """Returns all that `brdf_cos` reads beside parameters and options, by name: the tables, and what a model adds to them.

        Errors: AssetError for a file that cannot be read.
        """
        return {**self.volumes()}

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

    def in_rgb(self) -> "Brdf":
        """Returns the material with its colours under D65 in place of spectra, and without reradiation. Errors: AssetError."""
        changes: dict[str, Any] = {"reradiation": None}
        for name in (*self.parameters(), "emission"):
            value, declared = getattr(self, name), self.declared(name)
            if isinstance(value, Spectrum):
                changes[name] = value.colour(lit=declared is not EMISSION, held=declared is not None and declared.held)
        return self.model_copy(update=changes)

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
        if isinstance(self.emission, Spectrum):
            return any(self.emission.colour(lit=False))
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
        if isinstance(value, Spectrum):
            return value if declared is EMISSION else _checked(value, declared)
        numbers = value if isinstance(value, tuple) else (value,)
        if min(numbers) < declared.low:
            raise fault(f"must be at least {declared.low:g}, not {figure(min(numbers))}")
        if declared.high is not None and max(numbers) > declared.high:
            raise fault(f"must be at most {declared.high:g}, not {figure(max(numbers))}")
        return value

    @model_validator(mode="after")
    def _conserves(self) -> "Brdf":
        """Refuses a surface that gives off more light by reradiation and reflection together than arrives."""
        if self.reradiation is None:
            return self
        name = self.base()
        own = getattr(self, name) if name else None
        excess = self.reradiation.excess(_reflectance(own))
        if excess:
            wavelength, ratio = excess
            raise fault(
                f"reradiation: of light of {wavelength:g} nm, {figure(round(ratio, 6))} times its energy is reflected and "
                "given off, and at most 1 can be"
            )
        shorter = self.reradiation.shorter()
        if shorter:
            excited, emitted = shorter
            warnings.warn(
                f"{self.reradiation.file}: light of {excited:g} nm is given off at {emitted:g} nm, which is shorter: real dyes "
                "give off longer waves than they take in; are rows and columns exchanged?",
                AssetWarning,
                stacklevel=2,
            )
        return self

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

    def __getattr__(self, name: str) -> Array | str | Volume | float:
        if name in self._chosen:
            return self._chosen[name]
        if name in self._model.tables:
            return Volume.constant(0.0)
        if name not in self._model.parameters():
            return 1.0
        self.names.add(name)
        return np.full((1, 3) if self._model.is_colour(name) else (1,), 0.5)


def _reflectance(colour: Any) -> Array:
    """Returns the reflectance by wavelength (531,) of a surface's own colour; 0 for a texture and for None."""
    from glshade.optics.upsampling import spectrum_of  # here, because few scenes need it

    if isinstance(colour, Spectrum):
        return colour.values()
    return spectrum_of(BLACK if colour is None or isinstance(colour, Texture) else colour)


def _checked(value: Spectrum, declared: Parameter) -> Spectrum:
    """Returns the spectrum of a parameter; refuses one that is a light or that leaves the parameter's range."""
    if value.is_light:
        raise fault(f"{value.name} is the spectrum of a light, not of a surface")
    wavelengths, values = value.rows
    values = value.scale * values
    low, high = int(np.argmin(values)), int(np.argmax(values))
    if values[low] < declared.low:
        raise fault(f"must be at least {declared.low:g}, not {figure(values[low])} (at {wavelengths[low]:g} nm)")
    if declared.high is not None and values[high] > declared.high:
        raise fault(f"must be at most {declared.high:g}, not {figure(values[high])} (at {wavelengths[high]:g} nm)")
    return value


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
    """Returns the material as `Brdf.brdf_cos` takes it: the float32 values, widened to float64, the options and the tables.

    Errors: ValueError for a texture; AssetError for a table whose file cannot be read.
    """
    values = {name: value.astype(np.float64) for name, value in numbers(brdf).items()}
    return SimpleNamespace(**values, **brdf.chosen(), **brdf.data())


def parameter_values(material: Brdf) -> dict[str, Any]:
    """Returns the values of the parameters by name.

    A parameter that was left out has the value of its `same_as`, and one with a spectrum has its colour under D65.
    """
    values = {}
    for name, declared in material.parameters().items():
        value = getattr(material, name)
        if value is None and declared.same_as:
            value = getattr(material, declared.same_as)
        values[name] = value.colour(lit=True, held=declared.held) if isinstance(value, Spectrum) else value
    return values
