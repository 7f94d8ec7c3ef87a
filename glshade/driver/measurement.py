"""Measure: what a driver's arithmetic, formats and rasteriser really do, by running them. For `glshade doctor`.

Nothing is taken from the driver's word where it can be drawn; each figure is a number, so that two machines can be compared.
"""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.errors import ContextError
from glshade.gl.context import Context
from glshade.glsl.generator import PAGE
from glshade.image.srgb import linear_to_srgb

Array = NDArray[np.float64]
Float32 = NDArray[np.float32]

# Khronos' registry values (gl.xml).
GL_SUBPIXEL_BITS, GL_SAMPLE_POSITION, GL_FRAMEBUFFER_SRGB = 0x0D50, 0x8E50, 0x8DB9
GL_R11F_G11F_B10F, GL_RGB10_A2, GL_SRGB8_ALPHA8 = 0x8C3A, 0x8059, 0x8C43

# Samples of a built-in: a square of 64 x 64.
SIDE = 64
# Loops are tried up to here; a driver that goes on has no cap worth a name. llvmpipe's is 65,535.
ROUNDS = 200_000
# The grid that the reference renderer snaps to (reference/raster.py).
SUBPIXEL_BITS = 8

COVER = """#version 330 core
void main() {
    gl_Position = vec4(4.0 * float(gl_VertexID & 1) - 1.0, 4.0 * float(gl_VertexID >> 1) - 1.0, 0.0, 1.0);
}
"""

# One function a draw; all of them are compiled once.
BUILT_INS = """#version 330 core
uniform sampler2D u_samples;
uniform int u_which;
out vec4 o_value;

float value(float a, float b) {
    switch (u_which) {
    case 0: return a + b;
    case 1: return a - b;
    case 2: return a * b;
    case 3: return a / b;
    case 4: return sqrt(a);
    case 5: return inversesqrt(a);
    case 6: return exp2(a);
    case 7: return log2(a);
    case 8: return sin(a);
    case 9: return cos(a);
    case 10: return pow(a, b);
    case 11: return acos(a);
    case 12: return atan(a);
    }
    return a;
}

void main() {
    vec4 s = texelFetch(u_samples, ivec2(gl_FragCoord.xy), 0);
    o_value = u_which < 0 ? s : vec4(value(s.x, s.y), 0.0, 0.0, 1.0);
}
"""

# Questions with one number for an answer, asked of either stage. What is a uniform the compiler cannot work out beforehand.
PROBE = """
uniform float u_one;       // 1
uniform float u_large;     // 1e8
uniform float u_near_one;  // 1 + 2^-12
uniform float u_sum;       // -(1 + 2^-11)
uniform float u_small;     // 1e-9
uniform float u_denormal;  // 2^-130
uniform float u_normal;    // 2^-126
uniform float u_eighth;    // 1/8
uniform int u_rounds;

float probe(int which) {
    if (which == 0)
        return mix(u_large, u_one, u_one);
    if (which == 1)
        return u_near_one * u_near_one + u_sum;
    if (which == 2) {
        float s = u_one + u_small;
        float b = s - u_one;
        return (u_one - (s - b)) + (u_small - b);
    }
    if (which == 3)
        return u_denormal * 1e20;
    if (which == 4)
        return floatBitsToInt(u_normal * u_eighth) != 0 ? 1.0 : 0.0;
    if (which == 5) {
        float count = 0.0;
        for (int i = 0; i < u_rounds; ++i)
            count += u_one;
        return count;
    }
#ifdef RECENT
    if (which == 6)
        return fma(u_near_one, u_near_one, u_sum);
    if (which == 7) {
        precise float s = u_one + u_small;
        precise float b = s - u_one;
        precise float error = (u_one - (s - b)) + (u_small - b);
        return error;
    }
#endif
    return 0.0;
}
"""
PROBES = 8

GEOMETRY_VERTEX = """#version 330 core
in vec2 a_pixels;
uniform vec2 u_size;
out float v_x;

void main() {
    v_x = a_pixels.x;
    gl_Position = vec4(2.0 * a_pixels / u_size - 1.0, 0.0, 1.0);
}
"""
GEOMETRY_FRAGMENT = """#version 330 core
in float v_x;
out vec4 o_value;

void main() {
    o_value = vec4(v_x - gl_FragCoord.x, 0.0, 0.0, 1.0);
}
"""


@dataclass(frozen=True)
class BuiltIn:
    """A built-in function: exact in float64, and the ranges of its arguments. spread: over decades, not evenly."""

    name: str
    exact: Callable[[Array, Array], Array]
    first: tuple[float, float]
    second: tuple[float, float] = (0.0, 0.0)
    spread: bool = False


_THOUSAND = (1e-3, 1e3)
_MILLION = (1e-6, 1e6)
# In the order of the shader's cases.
FUNCTIONS = (
    BuiltIn("+", lambda a, b: a + b, _THOUSAND, _THOUSAND, True),
    BuiltIn("-", lambda a, b: a - b, _THOUSAND, _THOUSAND, True),
    BuiltIn("*", lambda a, b: a * b, _THOUSAND, _THOUSAND, True),
    BuiltIn("/", lambda a, b: a / b, _THOUSAND, _THOUSAND, True),
    BuiltIn("sqrt", lambda a, b: np.sqrt(a), _MILLION, spread=True),
    BuiltIn("inversesqrt", lambda a, b: 1 / np.sqrt(a), _MILLION, spread=True),
    BuiltIn("exp2", lambda a, b: np.exp2(a), (-20.0, 20.0)),
    BuiltIn("log2", lambda a, b: np.log2(a), (0.5, 2.0)),
    BuiltIn("sin", lambda a, b: np.sin(a), (-math.pi, math.pi)),
    BuiltIn("cos", lambda a, b: np.cos(a), (-math.pi, math.pi)),
    BuiltIn("pow", lambda a, b: a**b, (0.5, 1.0), (0.0, 100.0)),
    BuiltIn("acos", lambda a, b: np.arccos(a), (-1.0, 1.0)),
    BuiltIn("atan", lambda a, b: np.arctan(a), (-10.0, 10.0)),
)
# What the bounds of the models rest on [ULP]: OpenGL asks for far less, and every driver at hand gives more.
NEEDED = {"+": 1.0, "-": 1.0, "*": 1.0, "/": 2.5, "sqrt": 3.0, "inversesqrt": 3.0, "exp2": 5.0}


def measure(context: Context) -> dict[str, Any]:
    """Everything below as one object that JSON can hold. Errors: ContextError where a probe will not compile.

    For a context of its own: what it makes is given back with it.
    """
    try:
        with context.gl:
            return _Driver(context).everything()
    except moderngl.Error as error:
        raise ContextError(f"the driver refuses a shader of the doctor's: {' '.join(str(error).split())}") from None


class _Driver:
    """A context with the programs that ask it."""

    def __init__(self, context: Context) -> None:
        self.context, self.gl = context, context.gl
        self.recent = context.gl.version_code >= 400
        self.built_ins = self.gl.program(COVER, BUILT_INS)
        self.copied = self.gl.vertex_array(self.built_ins, [])

    def everything(self) -> dict[str, Any]:
        fragment, vertex = self._probe_fragment(), self._probe_vertex()
        return {
            "built_ins": self._built_ins(),
            "fma": {"offered": self.recent, "fused": bool(fragment[6] != 0) if self.recent else None},
            "contracted": {"vertex": bool(vertex[1] != 0), "fragment": bool(fragment[1] != 0)},
            "precise": {"offered": self.recent, "kept": bool(fragment[7] != 0 and vertex[7] != 0) if self.recent else None},
            "compensated_sum_without_precise": bool(fragment[2] != 0),
            "mix_at_its_end": float(fragment[0]),
            "denormals": {
                stage: {"read": bool(answer[3] != 0), "made": bool(answer[4] != 0)}
                for stage, answer in (("vertex", vertex), ("fragment", fragment))
            },
            "loop_rounds": {"tried": ROUNDS, "vertex": int(vertex[5]), "fragment": int(fragment[5])},
            "formats": self._formats(),
            "timer_query": self._timer(),
            "subpixel_bits": {"told": self._integer(GL_SUBPIXEL_BITS), "measured": self._subpixel_bits()},
            "interpolation_shift_in_steps": self._interpolation(),
            "sample_positions": self._sample_positions(),
        }

    def _target(self, size: tuple[int, int], **options: Any) -> moderngl.Framebuffer:
        options = {"components": 4, "dtype": "f4", **options}
        target = self.gl.framebuffer([self.gl.texture(size, **options)])
        target.use()
        target.clear(0.0, 0.0, 0.0, 0.0)
        self.gl.enable_only(moderngl.NOTHING)
        return target

    def _run(self, which: int, samples: Float32, **options: Any) -> Float32:
        """(N, 4): a built-in, or -1 for a copy, of samples (N, 4) with N at most SIDE^2."""
        padded = np.zeros((SIDE * SIDE, 4), dtype=np.float32)
        padded[: len(samples)] = samples
        texture = self.gl.texture((SIDE, SIDE), 4, padded.tobytes(), dtype="f4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        target = self._target((SIDE, SIDE), **options)
        if options.get("internal_format") == GL_SRGB8_ALPHA8:
            self.gl.enable_direct(GL_FRAMEBUFFER_SRGB)
        texture.use(0)
        self.built_ins["u_which"] = which
        self.copied.render(moderngl.TRIANGLES, vertices=3)
        if options.get("internal_format") == GL_SRGB8_ALPHA8:
            self.gl.disable_direct(GL_FRAMEBUFFER_SRGB)
        pixels = np.frombuffer(target.read(components=4, dtype="f4"), dtype=np.float32)
        return pixels.reshape(-1, 4)[: len(samples)]

    def _built_ins(self) -> dict[str, dict[str, Any]]:
        """name -> worst error in ULP and absolute, and the ranges of the arguments."""
        random = np.random.default_rng(1)
        found: dict[str, dict[str, Any]] = {}
        for which, function in enumerate(FUNCTIONS):
            arguments = np.zeros((SIDE * SIDE, 4), dtype=np.float32)
            for column, (low, high) in enumerate((function.first, function.second)):
                share = random.uniform(size=SIDE * SIDE)
                arguments[:, column] = low * (high / low) ** share if function.spread and low else low + (high - low) * share
            a, b = arguments[:, 0].astype(np.float64), arguments[:, 1].astype(np.float64)
            exact = function.exact(a, b)
            error = np.abs(self._run(which, arguments)[:, 0] - exact)
            with np.errstate(over="ignore"):
                ulp = error / np.spacing(np.abs(exact).astype(np.float32)).astype(np.float64)
            given = [function.first] + [function.second] * (function.second != (0.0, 0.0))
            found[function.name] = {"ulp": _figure(ulp.max()), "absolute": _figure(error.max()), "arguments": given}
        return found

    def _probe(self) -> tuple[str, str]:
        version = "#version 400 core\n#define RECENT\n" if self.recent else "#version 330 core\n"
        return version, PROBE

    def _settle(self, program: moderngl.Program) -> None:
        values = {
            **{"u_one": 1.0, "u_large": 1e8, "u_near_one": 1 + 2.0**-12, "u_sum": -(1 + 2.0**-11), "u_small": 1e-9},
            **{"u_denormal": 2.0**-130, "u_normal": 2.0**-126, "u_eighth": 0.125, "u_rounds": ROUNDS},
        }
        for name, value in values.items():
            if name in program:
                program[name] = value

    def _probe_fragment(self) -> Float32:
        version, text = self._probe()
        main = "out vec4 o_value;\nvoid main() { o_value = vec4(probe(int(gl_FragCoord.x))); }\n"
        program = self.gl.program(COVER, version + text + main)
        self._settle(program)
        target = self._target((PROBES, 1))
        self.gl.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
        return np.frombuffer(target.read(components=4, dtype="f4"), dtype=np.float32)[::4]

    def _probe_vertex(self) -> Float32:
        version, text = self._probe()
        main = "out float v_value;\nvoid main() { v_value = probe(gl_VertexID); gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }\n"
        program = self.gl.program(version + text + main, varyings=("v_value",))
        self._settle(program)
        result = self.gl.buffer(reserve=4 * PROBES)
        # Without a framebuffer bound, llvmpipe writes zeros and says nothing.
        self._target((1, 1))
        self.gl.vertex_array(program, []).transform(result, moderngl.POINTS, vertices=PROBES)
        return np.frombuffer(result.read(), dtype=np.float32)

    def _formats(self) -> dict[str, dict[str, Any]]:
        """name -> what a float becomes when it is stored."""
        random = np.random.default_rng(2)
        samples = np.ones((SIDE * SIDE, 4), dtype=np.float32)
        samples[:, :3] = 2.0 ** random.uniform(-9, 9, (SIDE * SIDE, 3))
        positive = samples.copy()
        samples[::2, :3] *= -1
        samples[0, :3], samples[1, :3] = 70000.0, 2.0**-30
        unit = random.uniform(0, 1, (SIDE * SIDE, 4)).astype(np.float32)
        found: dict[str, dict[str, Any]] = {}
        found["RGBA32F"] = {"exact": bool(np.array_equal(self._run(-1, samples), samples))}
        half = self._run(-1, samples, dtype="f2")[:, :3]
        found["RGBA16F"] = {**_mantissa(half[2:], samples[2:, :3], 10), "70000": _figure(half[0, 0])}
        small = self._run(-1, positive, components=3, dtype="f2", internal_format=GL_R11F_G11F_B10F)
        below = self._run(-1, -positive, components=3, dtype="f2", internal_format=GL_R11F_G11F_B10F)
        found["R11F_G11F_B10F"] = {**_mantissa(small[:, :2], positive[:, :2], 6), "negative": _figure(below[:, :3].min())}
        ten = self._run(-1, unit, dtype="f1", internal_format=GL_RGB10_A2)[:, :3]
        found["RGB10_A2"] = {"lsb": _figure(np.abs(ten * 1023.0 - unit[:, :3] * 1023.0).max())}
        eight = self._run(-1, unit, dtype="f1")
        found["RGBA8"] = {"lsb": _figure(np.abs(eight * 255.0 - unit * 255.0).max())}
        encoded = self._run(-1, unit, dtype="f1", internal_format=GL_SRGB8_ALPHA8)[:, :3]
        found["SRGB8_ALPHA8"] = {
            "lsb": _figure(np.abs(encoded * 255.0 - 255.0 * linear_to_srgb(unit[:, :3].astype(np.float64))).max())
        }
        return found

    def _timer(self) -> dict[str, Any]:
        """A draw by the driver's clock, and by the wall's until it is finished [s]."""
        self._target((1024, 1024))
        self.built_ins["u_which"] = 10
        self.gl.texture((SIDE, SIDE), 4, dtype="f4").use(0)
        self.copied.render(moderngl.TRIANGLES, vertices=3)
        self.gl.finish()
        query = self.gl.query(time=True)
        start = time.perf_counter()
        with query:
            self.copied.render(moderngl.TRIANGLES, vertices=3)
        self.gl.finish()
        wall = time.perf_counter() - start
        told = query.elapsed * 1e-9
        return {"query_s": _figure(told), "wall_s": _figure(wall), "share": _figure(told / wall)}

    def _integer(self, name: int) -> int | None:
        get = self.context.procedure("glGetIntegerv", None, ctypes.c_uint, ctypes.POINTER(ctypes.c_int))
        if get is None:
            return None
        value = ctypes.c_int()
        get(name, ctypes.byref(value))
        return value.value

    def _draw(self, size: tuple[int, int], corners: Float32) -> Float32:
        """(H, W, 4): triangles with their corners (N, 2) in pixels; alpha is 1 where one is."""
        if not hasattr(self, "geometry"):
            self.geometry = self.gl.program(GEOMETRY_VERTEX, GEOMETRY_FRAGMENT)
        target = self._target(size)
        self.geometry["u_size"] = size
        buffer = self.gl.buffer(np.ascontiguousarray(corners, dtype=np.float32).tobytes())
        self.gl.vertex_array(self.geometry, [(buffer, "2f", "a_pixels")]).render(moderngl.TRIANGLES)
        return np.frombuffer(target.read(components=4, dtype="f4"), dtype=np.float32).reshape(size[1], size[0], 4)

    def _subpixel_bits(self) -> int:
        """From how many different edges there are while a corner slides over 1/16 pixel.

        In each of 256 columns an edge leans from x = 0.25 at the bottom to 0.75 + d at the top, so that it meets the middle of
        the column at a height that tells d apart: half of 4096 rows a pixel.
        """
        columns, rows = 256, 4096
        i = np.arange(columns)
        d = i / 4096.0
        left, right = i + 0.75 + d, i + 1.0
        one = np.stack([np.stack([i + 0.25, 0 * d], 1), np.stack([right, 0 * d], 1), np.stack([right, 0 * d + rows], 1)], 1)
        other = np.stack(
            [np.stack([i + 0.25, 0 * d], 1), np.stack([right, 0 * d + rows], 1), np.stack([left, 0 * d + rows], 1)], 1
        )
        covered = self._draw((columns, rows), np.concatenate([one, other]).reshape(-1, 2).astype(np.float32))[..., 3] > 0
        steps = len(np.unique(covered.sum(axis=0))) - 1
        return round(math.log2(steps * 16)) if steps > 0 else 0

    def _interpolation(self) -> float:
        """How far attributes are moved when all corners lie 0.4 of a sub-pixel step beside the grid [steps].

        0: they are interpolated from the corners as they are; 0.4: from the corners as they are snapped.
        """
        step = 0.4 / 2**SUBPIXEL_BITS
        corners = np.array([[2 + step, 2], [62 + step, 2], [2 + step, 62]])
        pixels = self._draw((SIDE, SIDE), corners.astype(np.float32))
        shift = pixels[pixels[..., 3] > 0][:, 0].astype(np.float64)
        return _figure(np.median(shift) * 2**SUBPIXEL_BITS)

    def _sample_positions(self) -> list[list[float]]:
        """Within a pixel, from 0 to 1, at as many samples as the driver has."""
        get = self.context.procedure("glGetMultisamplefv", None, ctypes.c_uint, ctypes.c_uint, ctypes.POINTER(ctypes.c_float))
        samples = self.gl.max_samples
        if get is None or samples < 2:
            return []
        self.gl.framebuffer([self.gl.renderbuffer((4, 4), 4, samples=samples)]).use()
        found = []
        for index in range(samples):
            place = (ctypes.c_float * 2)()
            get(GL_SAMPLE_POSITION, index, place)
            found.append([_figure(place[0]), _figure(place[1])])
        return found


def _figure(x: Any) -> float:
    """Four digits: enough to compare. JSON has no infinity: what is not finite is 1e308."""
    return float(f"{float(x):.4g}") if math.isfinite(x) else 1e308


def _mantissa(stored: Any, given: Any, bits: int) -> dict[str, Any]:
    """How floats (N, C) were rounded to a mantissa of `bits` digits."""
    stored, given = np.asarray(stored, dtype=np.float64), np.asarray(given, dtype=np.float64)
    step = 2.0 ** (np.floor(np.log2(np.abs(given))) - bits)
    if np.array_equal(stored, np.rint(given / step) * step):
        rounding = "nearest"
    elif np.array_equal(stored, np.trunc(given / step) * step):
        rounding = "toward zero"
    else:
        rounding = "neither nearest nor toward zero"
    error = (stored - given) / np.abs(given)
    return {"rounding": rounding, "relative": _figure(np.abs(error).max()), "bias": _figure((error * np.sign(given)).mean())}


@dataclass(frozen=True)
class Assumption:
    """Something that the renderer, or its proof, takes for granted; whether it holds here, and what follows where not."""

    what: str
    holds: bool
    measured: str
    follows: str

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def assumptions(context: Context, found: dict[str, Any]) -> list[Assumption]:
    """What the renderer assumes of a driver, held against what `measure` found."""
    errors = {name: found["built_ins"][name]["ulp"] for name in NEEDED}
    bad = [name for name, most in NEEDED.items() if not errors[name] <= most]
    rounds = min(found["loop_rounds"]["vertex"], found["loop_rounds"]["fragment"])
    bits, shift = found["subpixel_bits"]["measured"], found["interpolation_shift_in_steps"]
    stored, eight = found["formats"]["RGBA32F"]["exact"], found["formats"]["RGBA8"]["lsb"]
    return [
        Assumption(
            f"arithmetic within {', '.join(f'{name} {most:g}' for name, most in NEEDED.items())} ULP",
            not bad,
            ", ".join(f"{name} {errors[name]:g}" for name in bad or NEEDED),
            "the bounds of docs/accuracy.md may be exceeded; the picture is as good as these functions are",
        ),
        Assumption(
            f"a loop of {PAGE} rounds, a page of lights",
            rounds >= PAGE,
            f"{rounds} of {ROUNDS} rounds",
            "lights past that number are missing from the picture",
        ),
        Assumption(
            "RGBA32F keeps every bit", stored, "kept" if stored else "changed", "linear pictures are not what was computed"
        ),
        Assumption(
            "RGBA8 rounds to the nearest code",
            eight <= 0.51,
            f"off by {eight:g} of a code",
            "8-bit pictures may be off by one; EXR is not",
        ),
        Assumption(
            "clip depth from 0 to 1",
            context.zero_to_one,
            "glClipControl" if context.zero_to_one else "no glClipControl",
            "reversed depth gains nothing: surfaces far off that lie close together may flicker",
        ),
        Assumption(
            f"edges on a grid of {SUBPIXEL_BITS} sub-pixel bits",
            bits == SUBPIXEL_BITS,
            f"{bits} bits",
            "the reference snaps to another grid: pixels at edges may differ from it",
        ),
        Assumption(
            "attributes interpolated from corners that are not snapped",
            abs(shift) < 0.1,
            f"moved by {shift:g} of a step where snapping moves 0.4",
            "pictures differ from the reference by what 1/512 pixel changes",
        ),
    ]
