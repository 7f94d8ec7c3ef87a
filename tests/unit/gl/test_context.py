"""Context: contexts are opened, used side by side and released, and failures give a message of one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade import BRDFS, ContextError, Renderer, Scene, evaluate
from glshade.assembly.part import Part
from glshade.gl.context import REQUIRED_VERSION, devices, open_context

SCENE = Scene(objects=[{"shape": "sphere"}], film={"size": (24, 16), "samples": 4})


def test_a_context_describes_its_driver(renderer: Renderer) -> None:
    context = renderer.context
    assert context.gl.version_code >= REQUIRED_VERSION
    assert context.renderer
    assert context.version
    assert context.largest_side >= 4096
    assert context.procedure("glNoSuchFunctionAnywhere", None) is None or context.backend == "egl"


def test_a_context_describes_its_driver_while_another_is_current(renderer: Renderer) -> None:
    backend: Any = renderer.context.backend
    first = open_context(backend)
    second = open_context(backend)
    second.release()
    assert (first.renderer, first.version) == (renderer.context.renderer, renderer.context.version)
    assert first.largest_side >= 4096
    first.release()


def test_devices_are_numbered() -> None:
    listed = devices()
    assert [device.index for device in listed] == list(range(len(listed)))
    assert all(device.vendor for device in listed)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("glut",), "unknown backend 'glut'; allowed: "),
        (("egl", 99), "there is no EGL device 99: `glshade devices` lists"),
        (("standalone", 0), "only EGL has devices to choose from"),
    ],
)
def test_what_is_refused(arguments: Any, message: str) -> None:
    with pytest.raises(ContextError, match=message) as caught:
        open_context(*arguments)
    assert "\n" not in str(caught.value)
    with pytest.raises(ContextError, match=message):
        Renderer(*arguments)


def test_renderers_do_not_disturb_each_other(renderer: Renderer) -> None:
    """Each renderer draws in its own context, whichever was used or opened last."""
    expected = renderer.render(SCENE).pixels.copy()
    other = Renderer()
    assert np.array_equal(other.render(SCENE).pixels, expected)
    assert np.array_equal(renderer.render(SCENE).pixels, expected)
    assert np.array_equal(glshade.render(SCENE).pixels, expected)
    assert np.array_equal(other.render(SCENE).pixels, expected)
    assert evaluate(BRDFS["lambert"](kd=1), [0, 0, 1], [0, 0, 1], on="fragment") == pytest.approx(1 / np.pi)
    other.release()
    assert np.array_equal(renderer.render(SCENE).pixels, expected)


def test_a_renderer_may_be_released_twice() -> None:
    with Renderer() as renderer:
        renderer.render(SCENE)
        renderer.release()


def test_a_released_renderer_says_so() -> None:
    renderer = Renderer()
    image = renderer.render(SCENE)
    draw = renderer.drawing(SCENE)
    prepared = renderer.prepare(SCENE, None, "linear")
    part = Part("lit")
    renderer.release()
    for use in (
        lambda: renderer.render(SCENE),
        lambda: renderer.layers(SCENE),
        lambda: renderer.surfaces(SCENE),
        lambda: next(renderer.draw_part(SCENE, part)),
        lambda: renderer.drawing(SCENE),
        draw,
        lambda: renderer.prepare(SCENE, None, "linear"),
        lambda: renderer.prepare(SCENE, "flat", "linear"),
        lambda: renderer.draw(prepared, np.eye(4, dtype=np.float32)),
        lambda: evaluate(BRDFS["lambert"](), [0, 0, 1], [0, 0, 1], on="fragment", context=renderer.context),
    ):
        with pytest.raises(ContextError, match="has been released"):
            use()
    assert renderer.context.renderer
    assert image.pixels.mean() > 0


@pytest.mark.parametrize("command", [("render", "s.toml", "-o", "x.png"), ("doctor",)])
@pytest.mark.parametrize("backend", ["auto", "egl", "osmesa"])
def test_a_driver_that_does_not_exist(command: tuple[str, ...], backend: str, tmp_path: Path, glshade: Any) -> None:
    """With such a name, OSMesa crashes the process that makes a context."""
    (tmp_path / "s.toml").write_text('objects = [{ shape = "sphere" }]')
    done = glshade(*command, "--backend", backend, cwd=tmp_path, GALLIUM_DRIVER="nosuch")
    assert done.returncode == 5
    assert "Traceback" not in done.stderr
    assert "GALLIUM_DRIVER=nosuch" in done.stdout + done.stderr or "cannot be loaded" in done.stdout + done.stderr
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize("width", ["64", "512"])
def test_a_width_of_vectors_with_which_llvmpipe_crashes(width: str, tmp_path: Path, glshade: Any, renderer: Renderer) -> None:
    if "llvmpipe" not in renderer.context.renderer:
        pytest.skip("the driver is not llvmpipe")
    (tmp_path / "s.toml").write_text('objects = [{ shape = "sphere" }]')
    done = glshade("render", "s.toml", "-o", "x.png", cwd=tmp_path, LP_NATIVE_VECTOR_WIDTH=width)
    assert done.returncode == 5
    assert f"llvmpipe crashes with vectors of {width} bits" in done.stderr


def test_an_image_outlives_its_renderer() -> None:
    with Renderer() as renderer:
        image = renderer.render(SCENE)
    assert image.pixels.mean() > 0


def test_the_program_cache_may_be_off(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    backend: Any = renderer.context.backend

    def linker(program_cache: bool | None = None) -> bool:
        context = open_context(backend, program_cache=program_cache)
        context.release()
        return context.linker is not None

    monkeypatch.delenv("GLSHADE_PROGRAM_CACHE", raising=False)
    on = linker()
    assert not linker(program_cache=False)
    monkeypatch.setenv("GLSHADE_PROGRAM_CACHE", "0")
    assert not linker()
    assert linker(program_cache=True) == on
    monkeypatch.setenv("GLSHADE_PROGRAM_CACHE", "1")
    assert linker() == on
    monkeypatch.setenv("GLSHADE_PROGRAM_CACHE", "")
    assert linker() == on


def test_a_device_by_number(renderer: Renderer) -> None:
    if renderer.context.backend != "egl":
        pytest.skip("no EGL here")
    assert np.array_equal(glshade.render(SCENE, backend="egl", device=0).pixels.shape, (16, 24, 3))
