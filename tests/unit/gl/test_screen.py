"""Screen and Capture: numbers come back as the shaders wrote them."""

from __future__ import annotations

import numpy as np
import pytest

from glshade import Renderer
from glshade.errors import ContextError
from glshade.gl.frame import FORMATS
from glshade.gl.program import Program
from glshade.gl.screen import Capture, Screen
from glshade.glsl.source import Source, Stage

COVER = """#version 330 core
void main() {
    gl_Position = vec4(4.0 * float(gl_VertexID & 1) - 1.0, 4.0 * float(gl_VertexID >> 1) - 1.0, 0.0, 1.0);
}
"""
COPY = """#version 330 core
uniform sampler2D u_texels;
out vec4 o;
void main() {
    o = texelFetch(u_texels, ivec2(gl_FragCoord.xy), 0);
}
"""
PLACED = "#version 330 core\nin vec2 a_p;\nvoid main() {\n    gl_Position = vec4(a_p, 0.0, 1.0);\n}\n"
WHITE = "#version 330 core\nout vec4 o;\nvoid main() {\n    o = vec4(1.0);\n}\n"
SQUARES = """#version 330 core
out vec2 v_value;
void main() {
    v_value = vec2(gl_VertexID, gl_VertexID * gl_VertexID);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
"""


def program(renderer: Renderer, vertex: str, fragment: str | None, varyings: tuple[str, ...] = ()) -> Program:
    def stage(text: str) -> Stage:
        return Stage(text, tuple(("x", i) for i in range(1, len(text.splitlines()) + 1)))

    return Program(renderer.context, Source(stage(vertex), stage(fragment) if fragment else None), varyings)


def test_a_float_screen_keeps_every_bit_and_every_place(renderer: Renderer) -> None:
    texels = np.random.default_rng(0).normal(size=(3, 5, 4)).astype(np.float32)
    with renderer.context.gl:
        screen = Screen(renderer.context, (5, 3))
        assert not screen.readback().any()
        screen.upload(texels)
        screen.draw(program(renderer, COVER, COPY))
        assert np.array_equal(screen.readback(), texels)


def test_triangles_cover_what_lies_inside_them(renderer: Renderer) -> None:
    with renderer.context.gl:
        screen = Screen(renderer.context, (4, 2))
        left_half = np.array([[-1, -1], [0, -1], [0, 1], [-1, -1], [0, 1], [-1, 1]], dtype=np.float32)
        screen.draw_triangles(program(renderer, PLACED, WHITE), "a_p", left_half)
        assert np.array_equal(screen.readback()[..., 0], [[1, 1, 0, 0]] * 2)


def test_an_srgb_screen_stores_encoded_light(renderer: Renderer) -> None:
    with renderer.context.gl:
        screen = Screen(renderer.context, (1, 1), "srgb8_alpha8")
        screen.upload(np.full((1, 1, 4), 0.5, dtype=np.float32))
        screen.draw(program(renderer, COVER, COPY))
        # IEC 61966-2-1 encodes 0.5 as 188 of 255; alpha is never encoded.
        assert screen.readback().ravel() * 255 == pytest.approx([188, 188, 188, 128], abs=1)


def test_a_capture_holds_one_row_per_vertex(renderer: Renderer) -> None:
    with renderer.context.gl:
        capture = Capture(renderer.context, 5, 2)
        capture.draw(program(renderer, SQUARES, None, ("v_value",)))
        assert np.array_equal(capture.readback(), [[i, i * i] for i in range(5)])


def test_a_screen_that_the_driver_cannot_make(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """RGB9_E5, with an exponent that the channels share, is a format for textures only."""
    monkeypatch.setitem(FORMATS, "rgba16f", (0x8C3D, 3))
    with renderer.context.gl, pytest.raises(ContextError, match="cannot draw into rgba16f"):
        Screen(renderer.context, (1, 1), "rgba16f")
