"""Detail: measures how a driver reads textures: the rule for the level of detail, the weights of neighbouring texels, and the
decoding of sRGB codes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.driver.figures import rounded
from glshade.driver.programs import COVER, load_program
from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.gl.screen import Screen
from glshade.gl.tables import upload_table
from glshade.gl.textures import mipmapped, show_texels
from glshade.image.srgb import linear_to_srgb
from glshade.radiance.sampler import RULES
from glshade.textures.storage import Float, Format, Normal10, Srgb8, Stored, Unorm16
from glshade.textures.volume import Volume

Array = NDArray[np.float64]
Float32 = NDArray[np.float32]

# The program draws SQUARES * SQUARES squares of 2 x 2 pixels.
SQUARES = 32
# The side of the texture that shows the level of detail [texels]. Its levels are numbered from 0 to LAST.
SIDE, LAST = 64, 6
# The formats of textures whose filter's weights are measured: one of each kind of number.
FORMATS: tuple[Format, ...] = (Float(4), Srgb8(4), Unorm16(2), Normal10(3))
# A rule for the level of detail is recognised if no level differs from it by more than this [levels]. Drivers approximate the
# logarithm; the rules differ from each other by up to 0.5 and 1.
RECOGNISED = 0.1


def measure_detail(context: Context) -> dict[str, Any]:
    """Measures the filtering of textures. Returns a dictionary ready for JSON:

    "level_of_detail": "rule" is the name of the rule in glshade.radiance.sampler.RULES that the driver follows, or None if it
        follows none of them. "error" is the largest difference from this rule, or from the range that OpenGL allows [levels].
    "filter_weight_error": the largest error of the weights of two neighbouring texels, in any of FORMATS [texels].
    "srgb_decoding": "error" is the largest error with which an 8-bit sRGB code of a texture is decoded [codes], "values" are
        the linear values of the 256 codes, as the driver decodes them.
    "table_weight_error": the same for textures of three dimensions with half floats, which hold the tables of models [texels].
    Errors: ShaderError, ContextError.
    """
    program = load_program(context, COVER, "driver/detail.frag")
    program.set_integer("u_texture", 1)
    random = np.random.default_rng(3)
    return {
        "level_of_detail": _level_of_detail(context, program, random),
        "filter_weight_error": rounded(max(_filter_weight_error(context, program, random, form) for form in FORMATS)),
        "srgb_decoding": _srgb_decoding(context, program),
        "table_weight_error": _table_weight_error(context, random),
    }


def _draw(context: Context, program: Program, stored: Stored, changes: Array, nearest: bool = False) -> tuple[Array, Array]:
    """Returns (what the squares show (SQUARES^2, 2, 2), the changes in float64 as they were uploaded (SQUARES^2, 4)).

    stored: the texture. The result is its red channel.
    changes: the changes du/dx, dv/dx, du/dy, dv/dy of the texture coordinates of each square (SQUARES^2, 4).
    nearest: True to show the nearest texel of the largest level, without filtering.
    """
    screen, uploaded = Screen(context, (2 * SQUARES, 2 * SQUARES)), changes.astype(np.float32)
    screen.upload(uploaded.reshape(SQUARES, SQUARES, 4))
    texture = mipmapped(context, stored)
    if nearest:
        show_texels(texture)
    texture.use(1)
    screen.draw(program)
    shown = screen.readback()[..., 0].astype(np.float64).reshape(SQUARES, 2, SQUARES, 2)
    return shown.swapaxes(1, 2).reshape(-1, 2, 2), uploaded.astype(np.float64)


def _level_of_detail(context: Context, program: Program, random: np.random.Generator) -> dict[str, Any]:
    """Returns "rule" and "error", as `measure_detail` explains them. Every texel of a level shows the number of its level."""
    chain = [np.full((SIDE >> level, SIDE >> level), level, dtype=np.float32) for level in range(LAST + 1)]
    stored = Stored(Float(1), "R001", tuple(level[..., None] for level in chain))
    shown, changes = _draw(context, program, stored, _changes(random) / SIDE)
    dx, dy = np.split(changes * SIDE, 2, axis=1)
    errors = {rule: float(np.abs(shown - np.log2(span(dx, dy))[:, None, None]).max()) for rule, span in RULES.items()}
    rule = min(errors, key=lambda name: errors[name])
    if errors[rule] <= RECOGNISED:
        return {"rule": rule, "error": rounded(errors[rule])}
    least, largest = (np.log2(RULES[name](dx, dy))[:, None, None] for name in ("largest", "sum"))
    return {"rule": None, "error": rounded(np.maximum(least - shown, shown - largest).max(initial=0.0))}


def _changes(random: np.random.Generator) -> Array:
    """Returns random changes of texture coordinates (SQUARES^2, 4) [texels], whose levels of detail are from 0 to LAST."""
    count = SQUARES * SQUARES
    angle = random.uniform(0, 2 * np.pi, (count, 2))
    share = random.uniform(0, 1, (count, 2))
    share[np.arange(count), random.integers(0, 2, count)] = 1
    # By the rule "largest" the level is up to 0.5 less, and by the rule "sum" up to 1 more than the logarithm of the length.
    length = share * 2.0 ** random.uniform(0.6, LAST - 1.1, (count, 1))
    return np.stack([length * np.cos(angle), length * np.sin(angle)], axis=2).reshape(count, 4)


def _filter_weight_error(context: Context, program: Program, random: np.random.Generator, form: Format) -> float:
    """Returns the largest error of the weights of two neighbouring texels [texels].

    The texture has two texels, which show the least and the largest red of the format. The coordinate u lies between -1/4, the
    middle of the second, and 1/4, the middle of the first. It changes by less than a texel, so that level 0 is read.
    """
    changes = np.zeros((SQUARES * SQUARES, 4))
    changes[:, 0] = random.uniform(-0.25, 0.25, len(changes))
    # A second row keeps the texture's height from being one texel, which drivers may filter in another way.
    pixels = np.zeros((2, 2, form.channels), dtype=np.uint8 if form.codes else np.float32)
    pixels[:, 1] = 255 if form.codes else 1
    stored = Stored.of(pixels, form, "R001")
    low, high = next(stored.decoded())[0, :, 0].astype(np.float64)
    shown, uploaded = _draw(context, program, stored, changes)
    weight = (shown[:, 0, 1] - low) / (high - low)
    return float(np.abs(weight - (0.5 - 2 * uploaded[:, 0])).max())


def _srgb_decoding(context: Context, program: Program) -> dict[str, Any]:
    """Returns "error" and "values", as `measure_detail` explains them."""
    codes = np.arange(256)
    texture = np.repeat(codes.astype(np.uint8)[None, :, None], 4, axis=2)
    changes = np.zeros((SQUARES * SQUARES, 4))
    changes[:256, 0] = (codes + 0.5) / 256
    shown, _ = _draw(context, program, Stored.of(texture, Srgb8(4), "RGBA"), changes, nearest=True)
    values = shown[:256, 0, 1]
    return {"error": rounded(np.abs(linear_to_srgb(values) * 255 - codes).max()), "values": values.tolist()}


def _table_weight_error(context: Context, random: np.random.Generator) -> float:
    """Returns the largest error of the weights of two neighbouring texels of a table [texels].

    The table has two texels along each side. Red, green and blue are 1 in the second one along width, height and depth.
    """
    program = load_program(context, COVER, "driver/table.frag")
    program.set_integer("u_table", 1)
    second = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")[::-1], axis=-1)
    table = Volume(second.astype(np.float16), ("clamp", "clamp", "clamp"), "weights")
    screen, places = Screen(context, (SQUARES, SQUARES)), np.zeros((SQUARES, SQUARES, 4), dtype=np.float32)
    places[..., :3] = random.uniform(0, 1, (SQUARES, SQUARES, 3))
    screen.upload(places)
    texture = upload_table(context, table)
    texture.use(1)
    screen.draw(program)
    exact = table.sample(places[..., :3].astype(np.float64))
    return rounded(np.abs(screen.readback()[..., :3] - exact).max())
