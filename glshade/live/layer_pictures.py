"""Layer pictures: shows a layer of a picture, such as its normals or depths, as a picture of 8-bit colours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.image import cryptomatte
from glshade.image.layers import SPECTRAL, wavelength_of
from glshade.image.srgb import linear_to_srgb
from glshade.optics.observer import WAVELENGTHS, rgb_weights

Array = NDArray[Any]
# The light layers of a scene are named after its lights, and all begin with this.
LIGHT = "light_"
# Multiples of the golden ratio spread hues evenly, however many there are (Knuth 1973, 6.4).
GOLDEN = 0.6180339887498949


def aov_of(layer: str) -> str:
    """Returns the name that a film asks for to get a layer: all lights come together."""
    return "lights" if layer.startswith(LIGHT) else layer


def layer_picture(layer: str, arrays: Mapping[str, Array]) -> Array:
    """Returns a layer as a picture (H, W, 3) uint8.

    layer: the name of the layer.
    arrays: name -> (H, W, C) float32, as the renderer draws them.
    Errors: KeyError for a layer that is not there.
    """
    if layer == "cryptomatte":
        # The first two channels hold the number of the object that covers most of the pixel, and its share of the pixel.
        first = arrays[f"{cryptomatte.OBJECT}00"]
        return _coded(_hues(first[..., 0].view(np.uint32)) * first[..., 1:2])
    if layer == "spectrum":
        return _coded(linear_to_srgb(np.maximum(_seen(arrays), 0.0)))
    if layer == "lights":
        layer = next(name for name in arrays if name.startswith(LIGHT))
    values = np.nan_to_num(arrays[layer].astype(np.float64))
    if layer in ("normal", "view_normal"):
        covered = (values != 0).any(axis=2, keepdims=True)
        return _coded(np.where(covered, values / 2 + 0.5, 0.0))
    if layer == "depth":
        return _coded(np.repeat(1 - _spread(values, values > 0), 3, axis=2) * (values > 0))
    if layer == "position":
        covered = (values != 0).any(axis=2, keepdims=True)
        return _coded(_spread(values, covered) * covered)
    if layer == "uv":
        return _coded(np.concatenate([values % 1.0, np.zeros_like(values[..., :1])], axis=2))
    if layer == "mask":
        return _coded(np.repeat(values, 3, axis=2))
    if layer in ("object_id", "material_id", "semantic_id"):
        return _coded(_hues(values[..., 0].astype(np.uint32)))
    return _coded(linear_to_srgb(np.maximum(values, 0.0)))


def _seen(arrays: Mapping[str, Array]) -> Array:
    """Returns the colours (H, W, 3), linear Rec. 709, of the channels of a spectrum, whose bands are equally wide."""
    channels = {wavelength_of(name): values for name, values in arrays.items() if name.startswith(SPECTRAL)}
    wavelengths = sorted(channels)
    width = (wavelengths[-1] - wavelengths[0]) / (len(wavelengths) - 1)
    weights = width * np.stack([np.interp(wavelengths, WAVELENGTHS, column) for column in rgb_weights().T], axis=1)
    seen: Array = np.concatenate([channels[wavelength] for wavelength in wavelengths], axis=2) @ weights
    return seen


def _coded(values: Array) -> Array:
    """Returns colours in [0, 1] as 8-bit codes; others are clipped."""
    codes: Array = (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
    return codes


def _spread(values: Array, covered: Array) -> Array:
    """Returns values (H, W, C), each channel mapped to [0.1, 0.9] by its range over the covered pixels (H, W, 1)."""
    shown = values[covered[..., 0]]
    if not len(shown):
        return np.zeros_like(values)
    low, high = shown.min(axis=0), shown.max(axis=0)
    spread: Array = 0.1 + 0.8 * (values - low) / np.where(high > low, high - low, 1.0)
    return spread


def _hues(numbers: Array) -> Array:
    """Returns a bright colour (H, W, 3) for each number (H, W), and black for 0."""
    hue = (numbers.astype(np.float64) * GOLDEN % 1.0)[..., None]
    colours = 0.55 + 0.4 * np.cos(2 * np.pi * (hue + np.array([0.0, 1 / 3, 2 / 3])))
    bright: Array = colours * (numbers != 0)[..., None]
    return bright
