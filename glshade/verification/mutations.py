"""Mutations: small faults put into programs and pictures on purpose, to see whether the verifier finds them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.gl.renderer import Renderer
from glshade.glsl.generator import Source, Stage
from glshade.image.srgb import linear_to_srgb
from glshade.scene.scene import Rate, Scene
from glshade.verification.verification import Candidates, Verdict, candidates, single_sample, verdict_of

Array = NDArray[Any]

# Pictures that differ by less than this somewhere [linear, a quarter of an 8-bit step] count as the same picture.
VISIBLE = 1e-3


@dataclass(frozen=True)
class Mutation:
    """A fault. edits: (pattern, replacement) on the text of every stage; picture: what is done to the picture's pixels."""

    name: str
    description: str
    edits: tuple[tuple[str, str], ...] = ()
    picture: Callable[[Array], Array] | None = None


def _one_nan(pixels: Array) -> Array:
    result = pixels.copy()
    result[pixels.shape[0] // 2, pixels.shape[1] // 2, 0] = np.nan
    return result


def _lost_pixel(pixels: Array) -> Array:
    """The brightest pixel, which is one of a surface's, twice as bright."""
    result = pixels.copy()
    brightest = np.unravel_index(np.argmax(pixels[..., :3].sum(axis=2)), pixels.shape[:2])
    result[brightest] *= 2
    return result


_TURNED = "normalize(f.n + 0.00174533 * normalize(cross(f.n, vec3(0.36, 0.48, 0.8))))"
_ALL = (
    Mutation(
        "unnormalised",
        "interpolated normals are not made unit again",
        (
            (r"return Frame\(side \* unit\(", r"return Frame(side * ("),
            (r"vec3 n = unit\(normal\);", "vec3 n = normal;"),
        ),
    ),
    Mutation("exponent-squared", "the exponent, squared", ((r"m\.(exponent|pu) = ([^;]+);", r"m.\1 = (\2) * (\2);"),)),
    Mutation("exponent-1-percent", "the exponent, 1 % too large", ((r"m\.(exponent|pu) = ([^;]+);", r"m.\1 = 1.01 * (\2);"),)),
    Mutation(
        "swapped-tangents",
        "tangent and bitangent exchanged",
        (
            (
                r"return Frame\(side \* n, t, cross\(n, t\) \* tangent\.w\);",
                "return Frame(side * n, cross(n, t) * tangent.w, t);",
            ),
        ),
    ),
    Mutation(
        "mirrored", "tangent frames of the other handedness", ((r"cross\(n, t\) \* tangent\.w", "cross(n, t) * -tangent.w"),)
    ),
    Mutation(
        "linear-interpolation",
        "attributes interpolated linearly across the picture, not in perspective",
        ((r"\bcentroid (in|out) ", r"noperspective centroid \1 "),),
    ),
    Mutation(
        "falloff",
        "1/r for 1/r^2, and 1/r^2 for 1/r",
        (
            (r"1\.0 / max\(dot\(to_light, to_light\), r_min \* r_min\)", "1.0 / max(length(to_light), sqrt(r_min * r_min))"),
            (r"1\.0 / max\(length\(to_light\), r_min\)", "1.0 / max(dot(to_light, to_light), r_min * r_min)"),
        ),
    ),
    Mutation("exchanged", "l and v exchanged", ((r"brdf_cos\(m, f, l, v\)", "brdf_cos(m, f, v, l)"),)),
    Mutation(
        "two-sided",
        "n.l without its sign: light from behind",
        ((r"float NoL = dot\(f\.n, l\);", "float NoL = abs(dot(f.n, l));"),),
    ),
    Mutation(
        "normal-0.1-degree",
        "every normal turned by 0.1 degree",
        ((r"Frame f = frame\(side\);", f"Frame f = frame(side); f.n = {_TURNED};"),),
    ),
    Mutation(
        "light-1-percent", "every light 1 % stronger", ((r"= illuminate\(light, p, l\);", "= 1.01 * illuminate(light, p, l);"),)
    ),
    Mutation("shifted", "the picture moved by one pixel", picture=lambda pixels: np.roll(pixels, 1, axis=1)),
    Mutation("upside-down", "the picture's rows from bottom to top", picture=lambda pixels: pixels[::-1].copy()),
    Mutation(
        "swapped-channels",
        "red and blue exchanged",
        picture=lambda pixels: np.concatenate([pixels[..., 2::-1], pixels[..., 3:]], axis=2),
    ),
    Mutation("one-nan", "one value that is not a number", picture=_one_nan),
    Mutation("all-nan", "nothing but what is not a number", picture=lambda pixels: np.full_like(pixels, np.nan)),
    Mutation("black", "a black picture", picture=np.zeros_like),
    Mutation("one-pixel", "one pixel twice as bright", picture=_lost_pixel),
    Mutation(
        "encoded",
        "sRGB-encoded where light is linear",
        picture=lambda pixels: np.concatenate([linear_to_srgb(pixels[..., :3]), pixels[..., 3:]], axis=2),
    ),
)
MUTATIONS: dict[str, Mutation] = {mutation.name: mutation for mutation in _ALL}


def mutated(source: Source, mutation: Mutation) -> Source:
    """The source with the mutation's edits."""

    def edited(stage: Stage) -> Stage:
        text = stage.text
        # Found in what was there, not in what another edit has left.
        spans = [(match, new) for old, new in mutation.edits for match in re.finditer(old, text)]
        for match, new in sorted(spans, key=lambda span: -span[0].start()):
            text = text[: match.start()] + match.expand(new) + text[match.end() :]
        return replace(stage, text=text)

    return Source(edited(source.vertex), edited(source.fragment) if source.fragment else None)


class MutatedRenderer(Renderer):
    """A renderer whose programs have a fault. mutation: which; None for none."""

    mutation: Mutation | None = None

    def __enter__(self) -> MutatedRenderer:
        return self

    def render(self, scene: Scene, **options: Any) -> Any:
        # What is prepared holds programs.
        self._prepared.clear()
        return super().render(scene, **options)

    def _program(self, source: Source, flat: bool = False) -> Any:
        return super()._program(mutated(source, self.mutation) if self.mutation else source, flat)


@dataclass(frozen=True, eq=False)
class Trial:
    """A mutation tried on a scene. change: the largest difference it makes to a pixel; verdict: of the mutated picture."""

    mutation: Mutation
    change: float
    verdict: Verdict | None

    @property
    def shows(self) -> bool:
        """Whether the picture is another."""
        return not self.change <= VISIBLE

    @property
    def caught(self) -> bool:
        """Whether the verifier says that something is wrong."""
        return self.verdict is not None and self.verdict.verdict == "failed"


def trials(
    scene: Scene,
    names: Any = None,
    *,
    renderer: MutatedRenderer,
    shading: Rate | None = None,
    expected: Candidates | None = None,
) -> list[Trial]:
    """Every mutation (or those named) tried on a scene. expected: the scene's candidates, if at hand."""
    scene = single_sample(scene)
    expected = expected or candidates(scene, shading=shading)

    def drawn(mutation: Mutation | None) -> Array:
        renderer.mutation = mutation
        try:
            pixels: Array = renderer.render(scene, dtype="float32", shading=shading).pixels.copy()
        finally:
            renderer.mutation = None
        return pixels

    clean = drawn(None)
    result = []
    for name in names or MUTATIONS:
        mutation = MUTATIONS[name]
        picture = mutation.picture(clean) if mutation.picture else drawn(mutation)
        change = float(np.abs(picture.astype(np.float64) - clean).max())
        same = change == 0
        result.append(Trial(mutation, change, None if same else verdict_of(picture, expected, explain=False)))
    return result
