"""Noise of drivers: the scene drawn by another driver, or by the same one with other settings.

Each drawing needs a process of its own, because Mesa reads its settings once in a process.
"""

from __future__ import annotations

from glshade.bench.corpus.kinds import NOISES, Noise


def _add(name: str, reason: str, driver: dict[str, str], samples: int = 16) -> None:
    NOISES[name] = Noise(name, reason, driver={"backend": "egl", **driver}, samples=samples)


_add("drawn-again", "The same driver draws again in a new process.", {})
_add("osmesa", "Another build of llvmpipe draws, without a window system.", {"backend": "osmesa"})
_add(
    "softpipe",
    "Another software driver draws, which interpolates and filters by other sums. It has one sample a pixel.",
    {"GALLIUM_DRIVER": "softpipe"},
    samples=1,
)
for _name, _reason, _variable, _value in (
    ("threads-0", "llvmpipe draws in the calling thread, one tile after another.", "LP_NUM_THREADS", "0"),
    ("threads-1", "llvmpipe draws with one thread.", "LP_NUM_THREADS", "1"),
    ("threads-2", "llvmpipe draws with two threads, which take tiles in any order.", "LP_NUM_THREADS", "2"),
    ("threads-8", "llvmpipe draws with more threads than most machines have cores.", "LP_NUM_THREADS", "8"),
    (
        "vectors-128",
        "llvmpipe runs on a processor with vectors of 128 bits, as older machines of a CI service have.",
        "LP_NATIVE_VECTOR_WIDTH",
        "128",
    ),
    ("vectors-256", "llvmpipe uses vectors of 256 bits.", "LP_NATIVE_VECTOR_WIDTH", "256"),
    ("not-optimised", "LLVM compiles without optimising, so that sums have another order.", "GALLIVM_PERF", "nopt"),
    (
        "level-of-detail-per-pixel",
        "llvmpipe computes the level of detail in every pixel instead of once for 2 x 2 pixels; OpenGL allows both.",
        "GALLIVM_PERF",
        "no_quad_lod",
    ),
    (
        "filter-in-floats",
        "llvmpipe filters 8-bit textures in floats instead of integers; OpenGL asks for no number of bits.",
        "GALLIVM_PERF",
        "no_aos_sampling",
    ),
):
    _add(_name, _reason, {"GALLIUM_DRIVER": "llvmpipe", _variable: _value})
