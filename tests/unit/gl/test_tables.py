"""Tables of models on the GPU: the same numbers as on the CPU, in a cache that counts their bytes and lets them go."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.merl import rough, write_merl

from glshade import BRDFS, Renderer, Scene
from glshade.driver.programs import COVER, load_program
from glshade.errors import SceneError
from glshade.gl.resources import Resources, texture_size
from glshade.gl.screen import Screen
from glshade.gl.tables import upload_table
from glshade.textures.volume import End, Volume

SUN = {"type": "directional", "direction": [-0.4, -0.6, -0.7]}
SIDE = 64


def scene(**material: Any) -> Scene:
    """Returns a small picture of a sphere of measured reflectance."""
    ball = {"shape": {"type": "sphere", "segments": 16, "rings": 8}, "material": {"brdf": "measured", **material}}
    return Scene.model_validate({"objects": [ball], "lights": [SUN], "film": {"size": [48, 32]}})


@pytest.mark.parametrize("ends", [("clamp", "clamp", "repeat"), ("repeat", "clamp", "clamp")])
def test_the_gpu_reads_what_the_cpu_reads(ends: tuple[End, End, End], renderer: Renderer) -> None:
    random = np.random.default_rng(5)
    volume = Volume(random.uniform(-8, 8, (7, 5, 9, 3)).astype(np.float16), ends, "random")
    places = np.zeros((SIDE, SIDE, 4), dtype=np.float32)
    places[..., :3] = random.uniform(-0.7, 1.7, (SIDE, SIDE, 3))
    context = renderer.context
    with context.gl:
        program = load_program(context, COVER, "driver/table.frag")
        program.set_integer("u_table", 1)
        screen = Screen(context, (SIDE, SIDE))
        screen.upload(places)
        texture = upload_table(context, volume)
        texture.use(1)
        screen.draw(program)
        shown = screen.readback()[..., :3]
    at = places[..., :3].astype(np.float64)
    if not context.is_software:
        pytest.skip("a GPU's filter has weights of few binary digits; the driver's measurement tests it")
    assert np.abs(shown - volume.sample(at)).max() < 2e-4


def test_equal_tables_share_a_texture_whose_bytes_are_counted(renderer: Renderer) -> None:
    resources = Resources(renderer.context)
    volume, twin = (Volume(np.zeros((4, 6, 8, 3), np.float16), ("clamp", "clamp", "repeat"), "zeros") for _ in range(2))
    with renderer.context.gl:
        texture = resources.texture(volume)
        assert resources.texture(twin) is texture
        assert texture_size(texture) == 4 * 6 * 8 * 8
        assert resources._textures.size == 4 * 6 * 8 * 8


def test_a_table_goes_with_the_last_picture_that_needs_it(renderer: Renderer) -> None:
    resources = Resources(renderer.context)
    with renderer.context.gl:
        gone = weakref.ref(resources.texture(Volume.constant(1.0)))
        resources.age()
        resources.evict_unused()
    gc.collect()
    assert gone() is None


def test_a_table_that_is_too_large_for_the_driver_is_refused(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(renderer.context.gl.info, "GL_MAX_3D_TEXTURE_SIZE", 4)
    with renderer.context.gl, pytest.raises(SceneError, match="a table of 2 x 5 x 3 texels: this driver allows 4"):
        upload_table(renderer.context, Volume(np.zeros((3, 5, 2, 3), np.float16), ("clamp", "clamp", "clamp"), "large"))


def test_two_materials_keep_their_tables_apart(renderer: Renderer, tmp_path: Path) -> None:
    """Materials of one model share a program, and each has its own file."""
    pictures = []
    paths = [write_merl(tmp_path / f"{seed}.binary", rough(seed)) for seed in (1, 2)]
    single = [renderer.render(scene(file=path), dtype="float32").pixels.copy() for path in paths]
    for first, second in (paths, paths[::-1]):
        both = scene(file=first).model_dump()
        both["objects"] = [
            {**both["objects"][0], "name": name, "material": {"brdf": "measured", "file": path}, "transform": {"translate": at}}
            for name, path, at in (("left", first, [-1.2, 0, 0]), ("right", second, [1.2, 0, 0]))
        ]
        pictures.append(renderer.render(Scene.model_validate(both), dtype="float32").pixels.copy())
    assert np.abs(single[0] - single[1]).max() > 0.01
    left, exchanged = (picture[:, :24] for picture in pictures)
    assert np.abs(left - exchanged).max() > 0.01


def test_a_file_that_changes_changes_the_next_picture(renderer: Renderer, tmp_path: Path) -> None:
    path = write_merl(tmp_path / "a.binary", np.full((4, 4, 4, 3), 0.5))
    first = renderer.render(scene(file=path), dtype="float32").pixels.copy()
    write_merl(path, np.full((4, 4, 5, 3), 1.0))
    second = renderer.render(scene(file=path), dtype="float32").pixels
    assert second == pytest.approx(2 * first, rel=1e-3)
    assert BRDFS["measured"](file=path).table("reflectance").size == (4, 4, 5)
