"""Layers as PNG files: the codes give the values back as the description says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.errors import GlshadeError
from glshade.image import file
from glshade.image.image import Image
from glshade.image.layer_paths import layer_files
from glshade.image.layers import Layers
from glshade.image.png_layers import LAYER, MOST, Coding, codes, round_scale


def layers(arrays: dict[str, Any], **keys: Any) -> Layers:
    height, width = next(iter(arrays.values())).shape[:2]
    return Layers(Image(np.zeros((height, width, 3), np.uint8)), arrays, form="png", **keys)


def stored(path: Path) -> Any:
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path))
    return np.asarray(source.read_image(source.spec().format))


@given(st.floats(1e-30, 1e30))
def test_a_scale_reaches_to_the_depth_and_is_round(largest: float) -> None:
    scale = round_scale(largest)
    assert largest / 2.5000001 <= scale * MOST
    assert scale * MOST * (1 + 1e-12) >= largest
    assert f"{scale:e}"[0] in "125"
    assert float(f"{scale:.0e}") == scale


@given(st.lists(st.one_of(st.just(0.0), st.floats(1e-3, 1e6)), min_size=1, max_size=20))
def test_depths_come_back_within_half_a_code(depths: list[float]) -> None:
    array = np.array(depths, dtype=np.float32).reshape(1, -1, 1)
    pixels, told = codes(Path("a.png"), "depth", array, Coding())
    assert pixels.dtype == np.uint16
    assert ((pixels == 0) == (array == 0)).all()
    off = np.abs(pixels * told["scale"] - array.astype(np.float64))
    # A depth below half a code gets the code 1, because 0 says that there is no surface.
    assert (off <= told["scale"] * np.where(pixels == 1, 1.0, 0.5 + 1e-9)).all()


def test_a_depth_beyond_a_given_scale_is_refused() -> None:
    depth = np.full((1, 1, 1), 70.0, np.float32)
    with pytest.raises(GlshadeError, match=r"a\.png: holds the depth 70, but film\.depth_scale = 0\.001 reaches to 65\.535"):
        codes(Path("a.png"), "depth", depth, Coding(depth_scale=0.001))


@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda n: np.linalg.norm(n) > 0.1))
def test_normals_come_back(normal: tuple[float, float, float]) -> None:
    array = (np.array([[normal, (0, 0, 0)]]) / np.linalg.norm(normal)).astype(np.float32)
    pixels, _ = codes(Path("a.png"), "normal", array, Coding())
    assert pixels[0, 1].tolist() == [0, 0, 0]
    assert pixels[0, 0].min() >= 1
    np.testing.assert_allclose((pixels[0, 0] - 32768.0) / 32767, array[0, 0], atol=0.51 / 32767)


def test_each_layer_gets_a_file_that_describes_itself(tmp_path: Path) -> None:
    numbers = np.array([[[0], [1], [300]]], np.float32)
    legend = {1: {"name": "a"}, 300: {"name": "b"}}
    made = layers({"object_id": numbers, "mask": np.minimum(numbers, 1)}, legends={"object_id": legend})
    made.save(tmp_path / "a.jpg", {"glshade:digest": "d"})
    expected = [tmp_path / "a.jpg", *layer_files(tmp_path / "a.jpg", made.arrays, "png")]
    assert sorted(tmp_path.iterdir()) == sorted(expected)
    assert stored(tmp_path / "a.object_id.png").tolist() == numbers.tolist()
    assert stored(tmp_path / "a.mask.png").tolist() == [[[0], [255], [255]]]
    told = json.loads((tmp_path / "a.aovs.json").read_text())
    assert told["picture"] == "a.jpg"
    assert told["layers"]["object_id"]["legend"] == {"1": {"name": "a"}, "300": {"name": "b"}}
    texts = file.attributes(tmp_path / "a.object_id.png")
    assert texts["glshade:digest"] == "d"
    assert {"file": "a.object_id.png", **json.loads(texts[LAYER])} == told["layers"]["object_id"]


def test_too_many_numbers_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    made = layers({"mask": np.ones((1, 1, 1), np.float32), "object_id": np.full((1, 1, 1), 65536, np.float32)})
    made.legends["object_id"] = {}
    with pytest.raises(GlshadeError, match=r"object_id has more than 65,535 numbers"):
        made.save(tmp_path / "a.png")
    assert not list(tmp_path.iterdir())
