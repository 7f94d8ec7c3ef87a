"""Illumination: turns the spectra of a scene's lights and materials into RGB colours that are drawn like any others.

The light of a lamp S, reflected with the reflectance R and seen by the observer o, is the sum of S R o over the wavelengths.
Where a model is linear in its colours, these sums are computed once for each material and each spectrum of light, in float64:
the lamp gets the colour L, the sum of S o, and the material the colour (sum of S R o) / L, channel by channel. Other models are
drawn in bands: their three channels stand for three bands of wavelengths, and a matrix turns the three results into RGB.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.instance import Instance, Share
from glshade.brdfs import BLACK, BRDFS, Brdf, parameter_values
from glshade.errors import SceneError
from glshade.lights import Light
from glshade.optics.observer import WAVELENGTHS, daylight, matching, rgb_weights, weights_for
from glshade.optics.spectra import Spectrum, colour_of
from glshade.optics.upsampling import spectrum_of
from glshade.scene.film import Film
from glshade.textures.texture import Texture

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

# A channel of a lamp's colour is divided by, so it is at least this share of the largest one. Light of saturated lamps that no
# spectrum explains is below what float32 tells from 0.
LEAST_CHANNEL = 1e-6
# The digits of relative powers in which lamps have to agree to count as lamps of one spectrum.
SAME = 9
# The digits of a material's colours. Rounding to them makes greys exactly grey, and so materials alike under all lamps.
DIGITS = 11
# The layer `spectrum` has bands of equal width in this range [nm], in which nearly all visible light lies.
LAYER = (380.0, 780.0)
# The observer sees light in this range [nm]. A table that ends within it is worth a remark.
OBSERVED = (360.0, 830.0)


def is_spectral(film: Film, lights: Sequence[Light], materials: Sequence[Brdf]) -> bool:
    """Returns whether a scene has or shows any spectrum, so that its colours depend on the wavelength."""
    return (
        film.white is not None
        or "spectrum" in film.aovs
        or any(isinstance(light.colour, Spectrum) for light in lights)
        or any(has_spectra(material) for material in materials)
    )


def has_spectra(material: Brdf) -> bool:
    """Returns whether a material has a spectrum or reradiates."""
    names = (*material.parameters(), "emission")
    return material.reradiation is not None or any(isinstance(getattr(material, name), Spectrum) for name in names)


@dataclass(frozen=True)
class Beam:
    """Lamps whose spectra are equal up to a factor, and that light one object.

    lights: their indices in the assembly's lights.
    spectrum: the spectrum (531,) of the first one, for an intensity of 1.
    colour: the colour of the first one in the assembly's lights, linear Rec. 709.
    is_seen: whether the observer sees any of its light.
    """

    lights: tuple[int, ...]
    spectrum: Array
    colour: Array
    is_seen: bool

    @property
    def is_daylight(self) -> bool:
        """Whether it is light of D65."""
        return bool(np.allclose(self.spectrum, daylight() * (self.spectrum.sum() / daylight().sum()), rtol=1e-9, atol=0.0))


@dataclass(frozen=True)
class Observer:
    """What turns the spectra into the three channels of a picture.

    weights: (531, 3); a spectrum of light @ weights is its colour.
    bands: the number of bands for models that are not linear in their colours; 0 if each channel is a narrow band itself.
    keeps_rgb: whether RGB lights on RGB materials are shown as in a scene without spectra.
    """

    weights: Array
    bands: int
    keeps_rgb: bool

    @classmethod
    def of_film(cls, film: Film) -> Observer:
        """Returns the observer of a film, which sees linear Rec. 709. Errors: AssetError."""
        if film.white is None or film.white.spectrum == "D65":
            return cls(rgb_weights(), film.bands, keeps_rgb=True)
        return cls(weights_for(film.white.light()), film.bands, keeps_rgb=False)

    @classmethod
    def of_bands(cls, count: int, first: int) -> Observer:
        """Returns an observer of three of the bands of the layer `spectrum`. count: the number of bands. first: the index of
        the first of the three."""
        edges = np.linspace(*LAYER, count + 1)[first : first + 4]
        # A step of 1 nm at an edge belongs to both bands in part.
        ends = np.clip(edges, WAVELENGTHS[:, None] - 0.5, WAVELENGTHS[:, None] + 0.5)
        inside = np.diff(ends, axis=1)
        return cls(inside / inside.sum(axis=0), 0, False)


def wavelengths_of(count: int) -> list[float]:
    """Returns the middles of the bands of the layer `spectrum` [nm]. count: the number of bands."""
    edges = np.linspace(*LAYER, count + 1)
    return [float(middle) for middle in (edges[1:] + edges[:-1]) / 2]


class Illumination:
    """The spectra of a scene's lights, and the observer that sees them.

    lights: the scene's lights with RGB colours.
    bands: the number of bands of the layer `spectrum`.
    """

    def __init__(self, observer: Observer, lights: Sequence[Light], bands: int) -> None:
        """observer: sees the lights. lights: some have spectra. bands: as in the class. Errors: AssetError."""
        self._weights, self._bands, self._keeps_rgb = observer.weights, observer.bands, observer.keeps_rgb
        self.bands = bands
        self._written = tuple(lights)
        self._spectra = [spectrum_of_light(light) for light in lights]
        self._seen = [bool(np.any(np.round(spectrum @ self._weights, DIGITS))) for spectrum in self._spectra]
        self.lights = tuple(light.model_copy(update={"colour": self._colour(index)}) for index, light in enumerate(lights))
        # What changes of an instance, by the id of its material and by its lights. Thousands of objects may share them.
        self._known: dict[tuple[int, tuple[int, ...]], dict[str, Any]] = {}

    def _colour(self, index: int) -> Triple:
        """Returns the colour of a lamp in the assembly. A lamp that nobody sees gets a grey, which only reradiation uses."""
        spectrum, written = self._spectra[index], self._written[index].colour
        if not self._seen[index]:
            power = float(spectrum.sum() / daylight().sum())
            return (power, power, power)
        is_rgb = self._keeps_rgb and not isinstance(written, Spectrum)
        colour = np.array(written) if is_rgb else np.round(spectrum @ self._weights, DIGITS)
        least = LEAST_CHANNEL * np.abs(colour).max()
        red, green, blue = np.where(np.abs(colour) < least, least, colour).tolist()
        return (red, green, blue)

    def of_bands(self, first: int, assembled: Sequence[Light]) -> Illumination:
        """Returns the illumination of three bands of the layer `spectrum`, which become the three channels of a picture.

        first: the index of the first band.
        assembled: the lights of the assembly, whose places are in its unit.
        """
        return Illumination(Observer.of_bands(self.bands, first), self._written, self.bands)._placed_as(assembled)

    def _placed_as(self, assembled: Sequence[Light]) -> Illumination:
        pairs = zip(assembled, self.lights, strict=False)
        self.lights = tuple(light.model_copy(update={"colour": own.colour}) for light, own in pairs)
        return self

    def beams(self, chosen: Sequence[int]) -> list[Beam]:
        """Returns the chosen lamps, given by their indices, sorted by their spectra."""
        groups: dict[bytes, list[int]] = {}
        for index in chosen:
            spectrum = self._spectra[index]
            key = np.round(spectrum / np.abs(spectrum).max(initial=1e-300), SAME) + 0.0
            groups.setdefault(key.tobytes(), []).append(index)
        return [
            Beam(tuple(group), self._spectra[group[0]], np.array(self.lights[group[0]].rgb), self._seen[group[0]])
            for group in groups.values()
        ]

    def lit(self, instance: Instance) -> Instance:
        """Returns an instance with RGB colours in place of spectra, for the lamps that reach it.

        If these have several spectra, or its model needs bands, the instance has `shares`, whose light is added.
        instance: the instance with its material as it is written.
        Errors: AssetError.
        """
        key = id(instance.written or instance.material), instance.lights
        if key not in self._known:
            self._known[key] = self._changes(instance)
        return replace(instance, **self._known[key])

    def _changes(self, instance: Instance) -> dict[str, Any]:
        """Returns the attributes of an instance that depend on the spectra."""
        material = instance.written or instance.material
        if not self._bands:
            _check_curves(instance.name, material)
        # The written material is kept, so that its id is not that of another one later.
        changes: dict[str, Any] = {"material": self._in_daylight(material), "written": material, "shares": (), "weights": None}
        if material.unlit:
            return changes
        shares = self._joined(material, instance.lights)
        changes["said"] = tuple(self._remarks(material, instance))
        changes["lights"] = tuple(sorted({index for share in shares for index in share.lights}))
        if len(shares) == 1 and shares[0].weights is None:
            return {**changes, "material": shares[0].material}
        return {**changes, "shares": shares}

    def _joined(self, material: Brdf, chosen: tuple[int, ...]) -> tuple[Share, ...]:
        """Returns what the chosen lamps, given by their indices, and the emission make of a material, the emission first."""
        shares = list(self._shares(material.model_copy(update={"emission": BLACK}), chosen))
        emission = self._emission(material)
        first = next((index for index, share in enumerate(shares) if share.weights is None), None)
        if first is None and material.emits:
            # Light that is emitted does not go through the bands, so that a share without lights emits it.
            shares, first = [Share(_of_colour(material, BLACK), ()), *shares], 0
        if first is not None:
            bright = shares.pop(first)
            shares.insert(0, replace(bright, material=bright.material.model_copy(update={"emission": emission})))
        return tuple(shares)

    def _shares(self, material: Brdf, chosen: tuple[int, ...]) -> Iterator[Share]:
        """Yields what the chosen lamps, given by their indices, make of a material."""
        exact: list[tuple[list[int], Brdf]] = []

        def add(lights: Sequence[int], own: Brdf) -> None:
            """Adds lamps that show the material as `own`. They join the earlier lamps that show it in the same way."""
            for known, other in exact:
                if other == own:
                    known.extend(lights)
                    return
            exact.append((list(lights), own))

        is_plain = not has_spectra(material)
        bands: list[Share] = []
        bare = material.model_copy(update={"reradiation": None})
        for beam in self.beams(chosen):
            # D65 shows RGB colours as they are, and RGB lights multiply them as in a scene without spectra.
            as_written = beam.is_daylight or not any(isinstance(self._written[i].colour, Spectrum) for i in beam.lights)
            given_off = BLACK if material.reradiation is None else self._given_off(material, beam)
            if is_plain and self._keeps_rgb and as_written:
                add(beam.lights, bare)
            elif beam.is_seen and self.in_bands(material):
                bands += (Share(own, beam.lights, weights) for own, weights in self._banded(bare, beam))
            elif beam.is_seen:
                own = self._integrated(bare, beam)
                if own.brdf == "lambert" and not isinstance(own.kd, Texture):  # type: ignore[attr-defined]
                    kd = np.add(own.kd, given_off).tolist()  # type: ignore[attr-defined]
                    own, given_off = own.model_copy(update={"kd": tuple(kd)}), BLACK
                add(beam.lights, own)
            if any(given_off):
                add(beam.lights, _of_colour(bare, given_off))
        yield from (Share(own, tuple(sorted(lights))) for lights, own in exact)
        yield from bands

    def _integrated(self, material: Brdf, beam: Beam) -> Brdf:
        """Returns a material with the colours that it has in the light of a beam."""
        changes = {}
        for name, values in self._curves(material).items():
            changes[name] = tuple(np.round((beam.spectrum * values) @ self._weights / beam.colour, DIGITS).tolist())
        return material.model_copy(update=changes)

    def _curves(self, material: Brdf) -> dict[str, Array]:
        """Returns the spectra (531,) of a material's colours by name, without textures and colours that equal others."""
        curves = {}
        for name, declared in material.parameters().items():
            value = getattr(material, name)
            if isinstance(value, Spectrum):
                curves[name] = value.values(declared.held)
            elif isinstance(value, tuple) and material.is_colour(name):
                curves[name] = spectrum_of(value)
        return curves

    def in_bands(self, material: Brdf) -> bool:
        """Returns whether a material's spectra are drawn in bands, because its model is not linear in their colours."""
        changing = [name for name, values in self._curves(material).items() if np.ptp(values) > 0]
        exact = set(changing) <= set(material.linear_colours())
        return bool(self._bands) and not (exact or _is_approximate(material))

    def _banded(self, material: Brdf, beam: Beam) -> Iterator[tuple[Brdf, Array]]:
        """Yields (material for three bands, matrix (3, 3) from the light in these bands to RGB) for all bands."""
        seen = beam.spectrum * matching().sum(axis=1)
        # Each band has about as much light as any other, weighted with the observer's three functions together.
        middle = np.cumsum(np.abs(seen)) - np.abs(seen) / 2
        band = np.minimum((self._bands * middle / np.abs(seen).sum()).astype(np.intp), self._bands - 1)
        inside = band[:, None] == np.arange(self._bands)
        colours = (beam.spectrum[:, None] * self._weights).T @ inside
        power = seen @ inside
        curves = self._curves(material)
        means = {
            # A band without any light gets the value in the middle of the spectrum, which has no effect.
            name: np.where(power != 0, (seen * values) @ inside / np.where(power != 0, power, 1), values[len(values) // 2])
            for name, values in curves.items()
        }
        for start in range(0, self._bands, 3):
            three = slice(start, start + 3)
            changes = {name: tuple(np.round(values[three], DIGITS).tolist()) for name, values in means.items()}
            yield material.model_copy(update=changes), colours[:, three] / beam.colour

    def _given_off(self, material: Brdf, beam: Beam) -> Triple:
        """Returns the colour of a Lambertian surface that looks as the reradiation does in the light of a beam."""
        assert material.reradiation is not None
        red, green, blue = (material.reradiation.emitted(beam.spectrum) @ self._weights / beam.colour).tolist()
        return (red, green, blue)

    def _in_daylight(self, material: Brdf) -> Brdf:
        """Returns a material with its colours under D65 in place of spectra, and the emission as the film shows it."""
        changes = {"emission": self._emission(material)}
        if not self._bands:
            changes |= {name: self._seen_as(daylight() * values) for name, values in self._curves(material).items()}
        return material.in_rgb().model_copy(update=changes)

    def _seen_as(self, light: Array) -> Triple:
        """Returns the colour of light of a spectrum (531,)."""
        red, green, blue = np.round(light @ self._weights, DIGITS).tolist()
        return (red, green, blue)

    def albedo(self, material: Brdf) -> Brdf:
        """Returns the material whose base colour, or whose reflectance of ambient light, is that of a material under D65."""
        if material.base() is not None or not self.in_bands(material) or not material.has_reference:
            return self._in_daylight(material)
        # The model computes three wavelengths at once.
        count = len(WAVELENGTHS) // 3
        values: dict[str, Any] = {}
        curves = self._curves(material)
        for name, value in parameter_values(material).items():
            if name in curves:
                values[name] = curves[name].reshape(count, 3)
            elif isinstance(value, Texture):
                values[name] = np.full(count, value.factor[0])
            else:
                values[name] = np.full(count, value) if np.ndim(value) == 0 else np.asarray(value)
        reflectance = type(material).ambient_reflectance(SimpleNamespace(**values, **material.chosen())).reshape(-1)
        return _of_colour(material, colour_of(daylight() * reflectance))

    def _emission(self, material: Brdf) -> Any:
        """Returns the material's emission with its RGB colour in place of a spectrum."""
        emission = material.emission
        if isinstance(emission, Texture) or (self._keeps_rgb and not isinstance(emission, Spectrum)):
            return emission
        light = emission.light() if isinstance(emission, Spectrum) else daylight() * spectrum_of(emission)
        return self._seen_as(light)

    def _remarks(self, material: Brdf, instance: Instance) -> Iterator[tuple[str, str]]:
        """Yields (feature, what requires it) for each way in which spectra change how the instance is drawn."""
        name = instance.name
        colours = [key for key in material.parameters() if isinstance(getattr(material, key), Spectrum)]
        if colours or any(isinstance(self._written[index].colour, Spectrum) for index in instance.lights):
            if self.in_bands(material):
                yield f"spectra of {material.brdf} in {self._bands} bands", f"{name}, whose model is not linear in its colours"
            elif _is_approximate(material):
                yield f"spectra of {material.brdf} approximated by RGB", f"{name}, {_is_approximate(material)}"
            else:
                yield f"spectra of {material.brdf} integrated exactly", name
        for key in (*colours, "emission"):
            if isinstance(getattr(material, key), Spectrum):
                declared = material.declared(key)
                yield from _ends(getattr(material, key), f"{name}'s {key}", bool(declared and declared.held))
        for index in instance.lights:
            light = self._written[index]
            if isinstance(light.colour, Spectrum):
                yield from _ends(light.colour, light.name or f"lights[{index}]", held=False)
        if material.reradiation is not None:
            yield "reradiation", name


def spectrum_of_light(light: Light) -> Array:
    """Returns the spectrum (531,) of a light for an intensity of 1. An RGB colour is that of a filter before D65."""
    if isinstance(light.colour, Spectrum):
        return light.colour.light()
    return daylight() * spectrum_of(light.colour)


def _check_curves(name: str, material: Brdf) -> None:
    """Raises SceneError if a material has no spectrum because it has RGB colours of which none can be made.

    name: the name of the object.
    """
    reason = _is_approximate(material)
    if not reason and isinstance(material.emission, Texture):
        reason = "whose emission is an RGB texture"
    if reason:
        raise SceneError(f"film.aovs: spectrum cannot show {name}, {reason}")


def _is_approximate(material: Brdf) -> str:
    """Returns why neither sums nor bands are exact for a material; empty where one of them is."""
    if material.tables:
        return "whose table holds RGB colours"
    if material.mixes_channels:
        return "whose model mixes the channels of its colours"
    textured = [
        name for name in material.parameters() if material.is_colour(name) and isinstance(getattr(material, name), Texture)
    ]
    return f"whose {textured[0]} is an RGB texture" if textured else ""


def _of_colour(material: Brdf, colour: Any) -> Brdf:
    """Returns a Lambertian material of an RGB colour with the other keys of a material: its opacity, its maps, its sides."""
    surface: dict[str, Any] = {name: getattr(material, name) for name in Brdf.model_fields if name != "brdf"}
    base = getattr(material, material.base() or "", None)
    # Where alpha matters, the base texture stays for its alpha.
    kd = (
        base.model_copy(update={"factor": BLACK, "add": colour})
        if isinstance(base, Texture) and material.alpha_mode != "opaque"
        else colour
    )
    return BRDFS["lambert"].model_construct(**{**surface, "brdf": "lambert", "kd": kd, "reradiation": None})


def _ends(spectrum: Spectrum, owner: str, held: bool) -> Iterator[tuple[str, str]]:
    """Yields a remark on a table that ends where the observer still sees light."""
    first, last = spectrum.ends
    if first > OBSERVED[0] or last < OBSERVED[1]:
        beyond = "its ends hold" if held else "it is 0"
        yield f"{spectrum.name} goes from {first:g} nm to {last:g} nm; beyond, {beyond}", owner
