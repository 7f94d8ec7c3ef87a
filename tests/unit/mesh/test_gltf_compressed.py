"""glTF compressed: Draco and meshopt give the geometry that was stored, and what is missing is said."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade.errors import AssetError
from glshade.mesh.file import load
from glshade.mesh.mesh import Mesh
from tests.support.gltf_file import GltfFile

DRACO, MESHOPT = "KHR_draco_mesh_compression", "EXT_meshopt_compression"
# A bent square of two triangles with normals and colours.
POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]], dtype="<f4")
INDICES = np.array([0, 1, 2, 2, 1, 3])
COLOURS = np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [51, 102, 153, 255]], dtype="u1")


def only(tmp_path: Path, file: GltfFile) -> Mesh:
    (part,) = load(file.write(tmp_path / "a.glb")).parts
    return part.mesh


def corners(mesh: Mesh) -> Any:
    """Returns positions and colours of the corners (T, 3, 7), in an order that the storage does not decide."""
    assert mesh.colours is not None
    rows = np.concatenate([mesh.positions, mesh.colours], axis=1)[mesh.triangles]
    return np.array(sorted(np.round(rows, 2).tolist()))


def draco(required: bool = True, fallback: bool = False) -> GltfFile:
    library = pytest.importorskip("DracoPy", reason="the extra `compressed` is not installed")
    file = GltfFile(**({"extensionsRequired": [DRACO]} if required else {}))
    faces = INDICES.reshape(-1, 3).astype(np.uint32)
    data = library.encode(POSITIONS, faces, preserve_order=True, colors=COLOURS, quantization_bits=14)
    numbers = {entry["attribute_type"]: entry["unique_id"] for entry in library.decode(data).attributes}

    def accessor(array: Any, **keys: Any) -> int:
        number = file.accessor(array, **keys)
        if not fallback:
            del file.header["accessors"][number]["bufferView"]
        return number

    given = {"POSITION": accessor(POSITIONS), "COLOR_0": accessor(COLOURS, normalized=True)}
    primitive = {"attributes": given, "indices": accessor(INDICES.astype("<u2"))}
    attributes = {"POSITION": numbers[0], "COLOR_0": numbers[2]}
    primitive["extensions"] = {DRACO: {"bufferView": file.view(data), "attributes": attributes}}
    return file.one(primitive)


def plain() -> GltfFile:
    file = GltfFile()
    return file.one(file.primitive(INDICES, POSITION=POSITIONS, COLOR_0=file.accessor(COLOURS, normalized=True)))


def meshopt(fallback: bool = False, **wrong: Any) -> GltfFile:
    """Returns a file whose views are stored by EXT_meshopt_compression. wrong: keys of the extension that are changed."""
    library = pytest.importorskip("meshoptimizer", reason="the extra `compressed` is not installed")
    file = GltfFile(**({} if fallback else {"extensionsRequired": [MESHOPT]}))
    indices = INDICES.astype("<u4")
    stored = [
        (POSITIONS, 12, "ATTRIBUTES", library.encode_vertex_buffer(POSITIONS, 4, 12)),
        (COLOURS, 4, "ATTRIBUTES", library.encode_vertex_buffer(COLOURS.view(np.float32), 4, 4)),
        (indices, 4, "TRIANGLES", library.encode_index_buffer(indices, len(indices), 4)),
    ]
    numbers = []
    offset = 0
    for array, stride, mode, data in stored:
        number = file.accessor(array, normalized=array is COLOURS)
        table = file.header["bufferViews"][file.header["accessors"][number]["bufferView"]]
        packed = file.header["bufferViews"][file.view(data)]
        extension = {"buffer": 0, "byteOffset": packed["byteOffset"], "byteLength": packed["byteLength"]}
        extension |= {"byteStride": stride, "count": len(array), "mode": mode, **wrong}
        table["extensions"] = {MESHOPT: extension}
        numbers.append(number)
        if not fallback:
            table |= {"buffer": 1, "byteOffset": offset}
            offset += table["byteLength"] + 4
    if not fallback:
        file.further = [{"byteLength": offset, "extensions": {MESHOPT: {"fallback": True}}}]
    positions, colours, order = numbers
    return file.one(file.primitive(order, POSITION=positions, COLOR_0=colours))


@pytest.mark.parametrize("make", [draco, meshopt])
def test_compressed_geometry_is_that_of_the_plain_file(tmp_path: Path, make: Any) -> None:
    expected = corners(only(tmp_path, plain()))
    assert len(expected) == 2
    np.testing.assert_allclose(corners(only(tmp_path, make())), expected, atol=0.011)


@pytest.mark.parametrize(("make", "name"), [(draco, "DracoPy"), (meshopt, "meshoptimizer")])
def test_a_missing_library_is_named_by_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: Any, name: str) -> None:
    file = make()
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(AssetError, match=r"needs .*_compression: install glshade\[compressed\]"):
        only(tmp_path, file)


def test_draco_data_that_are_only_used_and_have_no_fallback_are_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such a file once gave an empty picture."""
    file = draco(required=False)
    np.testing.assert_allclose(corners(only(tmp_path, file)), corners(only(tmp_path, plain())), atol=0.011)
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    file.header["asset"]["generator"] = "another file, so that the cache does not have it"
    with pytest.raises(AssetError, match=r"glshade\[compressed\]"):
        only(tmp_path, file)


def test_the_fallback_is_drawn_without_a_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = [draco(required=False, fallback=True), meshopt(fallback=True)]
    for name in ("DracoPy", "meshoptimizer"):
        monkeypatch.setitem(sys.modules, name, None)
    for file in files:
        np.testing.assert_array_equal(corners(only(tmp_path, file)), corners(only(tmp_path, plain())))


def test_damaged_data_are_named(tmp_path: Path) -> None:
    file = draco()
    view = file.header["meshes"][0]["primitives"][0]["extensions"][DRACO]["bufferView"]
    file.header["bufferViews"][view]["byteLength"] -= 9
    with pytest.raises(AssetError, match=r"meshes\[0\]\.primitives\[0\]: its Draco data are damaged"):
        only(tmp_path, file)
    for wrong, message in (
        ({"byteLength": 9}, r"bufferViews\[0\]: its compressed data are damaged"),
        ({"count": 5}, r"bufferViews\[0\]: its compressed data are longer than the view"),
        ({"mode": "BLOCKS"}, r"bufferViews\[0\]: the mode BLOCKS"),
        ({"filter": "WAVELET"}, r"the filter WAVELET is unknown"),
        ({"filter": "QUATERNION"}, r"4 elements of 12 bytes cannot be stored as ATTRIBUTES with the filter QUATERNION"),
        ({"byteLength": 10**6}, r"its compressed data end behind buffers\[0\]"),
    ):
        with pytest.raises(AssetError, match=message):
            only(tmp_path, meshopt(**wrong))


@pytest.mark.parametrize(("kind", "dtype"), [("OCTAHEDRAL", "<i1"), ("EXPONENTIAL", "<u4"), ("QUATERNION", "<i2")])
def test_the_filters_of_meshopt_are_undone(tmp_path: Path, kind: str, dtype: str) -> None:
    """The values are those that the extension's text gives for one element of each filter (Appendix A)."""
    library = pytest.importorskip("meshoptimizer", reason="the extra `compressed` is not installed")
    from glshade.mesh.reading.file import MeshFile
    from glshade.mesh.reading.gltf_compressed import meshopt_view

    stored, expected = {
        # x = 64 / 127 and z = 1 - |x| - |y|, made unit.
        "OCTAHEDRAL": (np.array([[64, 0, 127, 5]], dtype="i1"), np.array([64, 0, 63]) / np.hypot(64, 63) * 127),
        # The upper 8 bits are the exponent -1, the lower 24 the mantissa 3.
        "EXPONENTIAL": (np.array([[0xFF000003]], dtype="<u4"), np.array([1.5])),
        # No component but the greatest, which is the last: the rotation by nothing.
        "QUATERNION": (np.array([[0, 0, 0, 3]], dtype="<i2"), np.array([0, 0, 0, 32767])),
    }[kind]
    stride = stored.nbytes
    data = library.encode_vertex_buffer(np.frombuffer(stored.tobytes(), dtype=np.float32), 1, stride)
    table = {"count": 1, "byteStride": stride, "mode": "ATTRIBUTES", "filter": kind}
    found = meshopt_view(MeshFile(Path("a.glb"), tmp_path, b""), "it", table, data)
    read = np.frombuffer(found, dtype="<f4" if kind == "EXPONENTIAL" else dtype)[: len(expected)]
    np.testing.assert_allclose(read, expected, atol=0.75 if kind != "EXPONENTIAL" else 0)
