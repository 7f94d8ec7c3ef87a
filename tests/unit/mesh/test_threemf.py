"""3MF packages: units, components, colours and textures, packages in several parts, and archives that mean harm."""

from __future__ import annotations

import importlib
import io
import zipfile
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.mesh_contents import PNG, colours, complaint, corners, mesh_of, read_mesh, uvs

from glshade.errors import AssetError
from glshade.mesh.reading.contents import Contents

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
RELATIONS = (
    '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/a.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
VERTICES = '<vertex x="0" y="0" z="0"/><vertex x="2" y="0" z="0"/><vertex x="0" y="0" z="1"/><vertex x="2" y="0" z="1"/>'
TWO = '<triangle v1="0" v2="1" v3="2"/><triangle v1="1" v2="3" v3="2"/>'
ITEM = '<item objectid="1"/>'


def mesh(triangles: str = TWO, number: int = 1, more: str = "") -> str:
    inside = f"<mesh><vertices>{VERTICES}</vertices><triangles>{triangles}</triangles></mesh>"
    return f'<object id="{number}" type="model" {more}>{inside}</object>'


def model(resources: str, build: str = ITEM, more: str = "") -> str:
    spaces = 'xmlns:m="urn:m" xmlns:p="urn:p"'
    return f'<model {more} xmlns="{CORE}" {spaces}><resources>{resources}</resources><build>{build}</build></model>'


def package(parts: dict[str, bytes | str], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, data in parts.items():
            archive.writestr(zipfile.ZipInfo(name), data, method)
    return buffer.getvalue()


def contents(text: str, **others: bytes | str) -> Contents:
    return read_mesh("a.3mf", package({"_rels/.rels": RELATIONS, "3D/a.model": text, **others}))


@pytest.mark.parametrize(
    ("unit", "scale"),
    [("", 1), ('unit="millimeter"', 1), ('unit="inch"', 25.4), ('unit="micron"', 0.001), ('unit="meter"', 1000)],
)
def test_a_package_stands_upright_and_is_in_millimetres(unit: str, scale: float) -> None:
    found = contents(model(mesh(more='name="Plate"'), more=unit))
    assert [part["name"] for part in found.parts] == ["Plate"]
    np.testing.assert_allclose(sorted(corners(found).reshape(-1, 3).max(axis=0)), [0, scale, 2 * scale], rtol=1e-6)
    # z of the file is up, which is y here.
    assert corners(found)[..., 1].max() == pytest.approx(scale)


def test_components_and_items_multiply_their_transforms_and_share_meshes() -> None:
    group = '<object id="2"><components><component objectid="1" transform="0 1 0 -1 0 0 0 0 1 5 0 0"/><component objectid="1"/>'
    items = '<item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 7"/><item objectid="1"/>'
    found = contents(model(mesh() + group + "</components></object>", items))
    assert len(found.meshes) == 1
    assert len(found.parts) == 3
    # The point 2 0 0 is turned to 0 2 0, moved to 5 2 7, and with z up it is 5 7 -2.
    assert [5, 7, -2] in corners(found, 0).reshape(-1, 3).round(6).tolist()


def test_objects_in_other_parts_of_a_package() -> None:
    other = model(mesh(number=4), "")
    group = '<object id="2"><components><component p:path="/3D/Objects/b.model" objectid="4"/></components></object>'
    found = contents(model(group, '<item objectid="2"/>'), **{"3D/Objects/B.model": other})
    assert len(corners(found)) == 2


def test_a_package_without_a_build_is_drawn() -> None:
    found = contents(model(mesh() + mesh(number=7), ""))
    assert len(found.parts) == 2
    assert found.warnings == ["a.3mf: has nothing in its build; drawn with all its objects"]


def by_height(found: Contents) -> tuple[Any, Any]:
    """Returns the colours of the corners of the lower and of the upper triangle of TWO."""
    upper = (corners(found)[..., 1] > 0.5).sum(axis=1) == 2
    return colours(found)[~upper][0], colours(found)[upper][0]


def test_materials_of_objects_and_triangles() -> None:
    materials = (
        '<basematerials id="5"><base name="a" displaycolor="#FF0000"/><base name="b" displaycolor="#0000FF80"/></basematerials>'
    )
    triangles = TWO.replace('v3="2"/>', 'v3="2" pid="5" p1="1"/>', 1)
    lower, upper = by_height(contents(model(materials + mesh(triangles, more='pid="5" pindex="0"'))))
    np.testing.assert_allclose(lower, [[0, 0, 1, 128 / 255]] * 3, atol=1e-6)
    np.testing.assert_allclose(upper, [[1, 0, 0, 1]] * 3, atol=1e-6)


def test_colours_of_corners_are_encoded_as_srgb() -> None:
    group = '<m:colorgroup id="5"><m:color color="#FF0000"/><m:color color="#00FF00"/><m:color color="#808080"/></m:colorgroup>'
    triangles = TWO.replace('v3="2"/>', 'v3="2" pid="5" p1="0" p2="1" p3="2"/>', 1)
    lower, upper = by_height(contents(model(group + mesh(triangles))))
    grey = ((128 / 255 + 0.055) / 1.055) ** 2.4
    # The corners may come in another order.
    for colour in ([1, 0, 0, 1], [0, 1, 0, 1], [grey, grey, grey, 1]):
        assert np.abs(lower - colour).max(axis=1).min() < 1e-6
    np.testing.assert_allclose(upper, 1)


def test_textures() -> None:
    group = '<m:texture2d id="6" path="/3D/Textures/t.png" contenttype="image/png" tilestyleu="mirror" tilestylev="none"/>'
    group += '<m:texture2dgroup id="5" texid="6"><m:tex2coord u="0" v="0"/><m:tex2coord u="1" v="0.5"/></m:texture2dgroup>'
    triangles = TWO.replace('v3="2"/>', 'v3="2" pid="5" p1="0" p2="1" p3="0"/>', 1)
    found = contents(model(group + mesh(triangles)), **{"3D/Textures/t.png": PNG})
    textured = next(k for k, part in enumerate(found.parts) if part["material"])
    assert found.parts[textured]["material"]["kd"]["wrap"] == ["mirror", "clamp"]
    assert list(found.images.values()) == [PNG]
    assert sorted(uvs(found, textured)[0].tolist()) == [[0, 0], [0, 0], [1, 0.5]]
    assert [len(corners(found, k)) for k in range(2)] == [1, 1]


def test_properties_that_are_not_read_are_told() -> None:
    group = '<m:multiproperties id="5" pids="1 2"><m:multi pindices="0 0"/></m:multiproperties>'
    found = contents(model(group + mesh(more='pid="5" pindex="0"')))
    assert mesh_of(found).colours is None
    assert found.warnings == ["a.3mf: some triangles have multiproperties, which is not read; drawn plain"]
    missing = contents(
        model('<m:colorgroup id="5"><m:color color="#FF0000"/></m:colorgroup>' + mesh(more='pid="5" pindex="3"'))
    )
    assert missing.warnings == ["a.3mf: 2 triangles have properties that do not exist; drawn plain"]


# --- bad packages ----------------------------------------------------------------------------------------------------------

GOOD = model(mesh())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD.replace('v3="2"', 'v3="9"', 1), "object 1, triangle 0: vertex 9 is out of range: the object has 4"),
        (
            GOOD.replace('x="2"', 'x="two"', 1),
            "3D/a.model, line 1: <vertex> lacks an attribute, or has one that cannot be read",
        ),
        (GOOD.replace(' v2="1"', "", 1), "3D/a.model, line 1: <triangle> lacks an attribute"),
        (GOOD.replace('v1="0"', f'v1="{1 << 70}"', 1), "3D/a.model, line 1: <triangle> lacks an attribute, or has one"),
        (GOOD.replace("<model", '<model unit="parsec"'), "3D/a.model, line 1: <model> lacks an attribute"),
        (GOOD.replace('objectid="1"', 'objectid="8"'), "object 8, which the model names, does not exist"),
        (GOOD[:-30], "3D/a.model, line 1, column .*: the XML ends too early"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]>" + GOOD, "3D/a.model, line 1: has a document type"),
        (model(mesh(""), ITEM), "holds no triangles"),
        (model('<object id="1"><components><component objectid="1"/></components></object>'), "object 1 contains itself"),
        (model(mesh(), '<item objectid="1" transform="1 2 3"/>'), "3D/a.model, line 1: <item> lacks an attribute"),
    ],
)
def test_a_bad_model_says_what_is_wrong_and_where(text: str, message: str) -> None:
    with pytest.raises(AssetError, match=f"^a.3mf: .*{message}"):
        contents(text)


def test_archives_that_mean_harm_are_refused_before_they_are_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    reader = importlib.import_module("glshade.mesh.formats.3mf")
    monkeypatch.setattr(reader, "MOST_INSTANCES", 1000)
    monkeypatch.setattr(reader, "_LEAST_UNPACKED", 1 << 20)
    bomb = package({"_rels/.rels": RELATIONS, "3D/a.model": b"<model>" + b" " * (8 << 20)})
    assert len(bomb) < 100_000
    assert "is it a ZIP bomb?" in complaint("a.3mf", bomb)
    objects = "".join(
        f'<object id="{k}"><components>' + 10 * f'<component objectid="{k + 1}"/>' + "</components></object>"
        for k in range(1, 9)
    )
    nested = package({"3D/a.model": model(objects + '<object id="9"/>')})
    assert "places more than 1,000 objects" in complaint("a.3mf", nested)


def test_archives_that_cannot_be_read() -> None:
    assert "no ZIP archive, or it is truncated" in complaint("a.3mf", b"PK\3\4 garbage")
    assert "the archive holds no model" in complaint("a.3mf", package({"a.txt": "text"}))
    damaged = package({"3D/a.model": GOOD}, zipfile.ZIP_STORED).replace(b'x="2"', b'x="3"', 1)
    assert "part '3d/a.model' cannot be unpacked: the archive is damaged" in complaint("a.3mf", damaged)
    encrypted = bytearray(package({"3D/a.model": GOOD}))
    encrypted[6] |= 1
    encrypted[encrypted.index(b"PK\1\2") + 8] |= 1
    assert "part '3d/a.model' is encrypted" in complaint("a.3mf", bytes(encrypted))


@given(st.integers(0, 1 << 30), st.integers(0, 255), st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_changed_byte_gives_a_mesh_or_one_line(position: int, value: int, inside: bool) -> None:
    text = bytearray(GOOD.encode())
    if inside:
        text[position % len(text)] = value
    data = bytearray(package({"_rels/.rels": RELATIONS, "3D/a.model": bytes(text)}))
    if not inside:
        data[position % len(data)] = value
    assert "do not fit together" not in complaint("a.3mf", bytes(data))
