"""DAE (COLLADA) files: units, axes, nodes and instances, primitives, materials, and XML that means harm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.mesh_contents import PNG, area, complaint, corners, mesh_of, places, read_mesh, uvs

from glshade.errors import AssetError
from glshade.mesh.formats import dae
from glshade.mesh.reading.contents import Contents

# The corners of an arrow that is not convex, and one more point.
POINTS = "0 0 0  4 0 0  1 1 0  0 4 0  4 4 0"
TRIANGLE = '<triangles count="1" material="m"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 3</p></triangles>'
NODE = '<node id="n" name="N">{inner}</node>'
INSTANCE = '<instance_geometry url="#g">{bind}</instance_geometry>'
BIND = (
    '<bind_material><technique_common><instance_material symbol="m" target="#mat">{inputs}</instance_material>'
    "</technique_common></bind_material>"
)


def source(name: str, values: str, columns: str) -> str:
    count = len(values.split()) // len(columns)
    params = "".join(f'<param name="{column}" type="float"/>' for column in columns)
    return (
        f'<source id="{name}"><float_array id="{name}-array" count="{len(values.split())}">{values}</float_array>'
        f'<technique_common><accessor source="#{name}-array" count="{count}" stride="{len(columns)}">{params}</accessor>'
        "</technique_common></source>"
    )


def document(
    primitives: str = TRIANGLE,
    nodes: str = NODE.format(inner=INSTANCE.format(bind="")),
    asset: str = "",
    sources: str = "",
    libraries: str = "",
) -> str:
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"<asset>{asset}</asset>{libraries}"
        f'<library_geometries><geometry id="g" name="G"><mesh>{source("p", POINTS, "XYZ")}{sources}'
        f'<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{primitives}</mesh></geometry>'
        "</library_geometries>"
        f'<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )


def effect(shader: str, params: str = "", extra: str = "", images: str = "") -> str:
    return (
        f'<library_images>{images}</library_images><library_effects><effect id="e"><profile_COMMON>{params}'
        f'<technique sid="t">{shader}</technique></profile_COMMON>{extra}</effect></library_effects>'
        '<library_materials><material id="mat" name="Mat"><instance_effect url="#e"/></material></library_materials>'
    )


def contents(data: bytes | str, folder: Path = Path("/nowhere")) -> Contents:
    return read_mesh("a.dae", data, folder)


def material(shader: str, folder: Path = Path("/nowhere"), **others: str) -> Any:
    bound = NODE.format(inner=INSTANCE.format(bind=BIND.format(inputs="")))
    return contents(document(nodes=bound, libraries=effect(shader, **others)), folder).parts[0]["material"]


@pytest.mark.parametrize(
    ("asset", "third"),
    [
        ("", [0, 4, 0]),
        ("<up_axis>Y_UP</up_axis>", [0, 4, 0]),
        ("<up_axis>Z_UP</up_axis>", [0, 0, -4]),
        ("<up_axis>X_UP</up_axis>", [-4, 0, 0]),
        ('<unit name="inch" meter="0,0254"/><up_axis>Z_UP</up_axis>', [0, 0, -0.1016]),
        ('<unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis>', [0, 0, -0.1016]),
    ],
)
def test_the_asset_turns_and_scales_the_scene(asset: str, third: list[float]) -> None:
    np.testing.assert_allclose(corners(contents(document(asset=asset)))[0].tolist()[2], third, atol=1e-7)


@pytest.mark.parametrize(
    ("kind", "lists", "expected"),
    [
        ("triangles", "<p>0 1 2 0 2 3</p>", 4.0),
        ("polylist", "<vcount>4</vcount><p>0 1 2 3</p>", 4.0),
        ("polylist", "<vcount>4</vcount><p>1 2 3 0</p>", 4.0),
        ("polylist", "<vcount>3 4</vcount><p>1 4 3 0 1 2 3</p>", 12.0),
        ("polygons", "<p>0 1 2 3</p><p>1 4 3</p>", 12.0),
        ("trifans", "<p>2 3 0 1</p>", 4.0),
        ("tristrips", "<p>0 1 2 4</p><p>1 4 3</p>", 16.0),
    ],
)
def test_primitives_of_all_kinds(kind: str, lists: str, expected: float) -> None:
    text = f'<{kind} count="1"><input semantic="VERTEX" source="#v" offset="0"/>{lists}</{kind}>'
    found = contents(document(text))
    assert area(found) == pytest.approx(expected)
    a, b, c = np.moveaxis(corners(found), 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] >= 0).all()


def test_inputs_with_indices_of_their_own() -> None:
    given_sources = source("n", "0 0 1 0 0.6 0.8", "XYZ") + source("t", "0 0 9  1 0 9  0 1 9", "STP")
    given_sources += source("c", "1 0 0  0.5 1 0", "RGB") + source("t1", "0.25 0.5", "ST")
    inputs = '<input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#n" offset="2"/>'
    inputs += '<input semantic="TEXCOORD" source="#t" offset="1" set="0"/><input semantic="COLOR" source="#c" offset="3"/>'
    inputs += '<input semantic="TEXCOORD" source="#t1" offset="4" set="3"/>'
    text = f'<triangles count="1">{inputs}<p>3 2 0 1 0  0 0 1 0 0  1 1 0 0 0</p></triangles>'
    found = contents(document(text, sources=given_sources))
    mesh = mesh_of(found)
    corner = mesh.triangles[0][places(mesh)[mesh.triangles[0]][:, 1].argmax()]
    assert mesh.normals is not None
    assert mesh.uvs is not None
    assert mesh.colours is not None
    np.testing.assert_allclose(mesh.normals[corner], [0, 0, 1])
    np.testing.assert_allclose(mesh.uvs[corner], [0, 1])
    np.testing.assert_allclose(mesh.colours[corner], [((0.5 + 0.055) / 1.055) ** 2.4, 1, 0, 1], atol=1e-6)


def test_nodes_multiply_their_transforms_in_order_and_share_meshes() -> None:
    inner = NODE.format(inner=f"<translate>0 0 1</translate>{INSTANCE.format(bind='')}")
    outer = f'<node name="outer"><translate>1 0 0</translate><rotate>0 0 1 90</rotate><scale>2 2 2</scale>{inner}</node>'
    again = '<node name="again"><matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_node url="#n"/></node>'
    found = contents(document(nodes=outer + again))
    assert len(found.meshes) == 1
    assert [part["name"] for part in found.parts] == ["N", "N.2"]
    np.testing.assert_allclose(corners(found, 0)[0][:2], [[1, 0, 2], [1, 8, 2]], atol=1e-6)
    np.testing.assert_allclose(corners(found, 1)[0][:2], [[5, 0, 1], [9, 0, 1]], atol=1e-6)


def test_lookat_points_the_negative_z_axis_at_the_target() -> None:
    node = f"<lookat>1 2 3  1 2 -5  0 1 0</lookat>{INSTANCE.format(bind='')}"
    np.testing.assert_allclose(corners(contents(document(nodes=NODE.format(inner=node))))[0][1], [5, 2, 3])


def test_a_skin_and_lights_are_told() -> None:
    skin = '<skin source="#g"><bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 7 0 0 0 1</bind_shape_matrix></skin>'
    library = f'<library_controllers><controller id="c">{skin}</controller></library_controllers>'
    node = '<translate>9 9 9</translate><instance_controller url="#c"/><instance_light url="#l"/>'
    found = contents(document(nodes=NODE.format(inner=node), libraries=library))
    assert corners(found)[0][0].tolist() == [0, 0, 7]
    assert found.warnings == [
        "a.dae: a skin is drawn in the pose in which it was bound",
        "a.dae: 1 lights not read; drawn without them",
    ]


def test_a_library_without_a_scene_is_drawn() -> None:
    found = contents(
        document().replace('<scene><instance_visual_scene url="#s"/></scene>', "").replace("visual_scene", "no_scene")
    )
    assert area(found) == 8
    assert found.warnings == ["a.dae: has no scene; drawn with all its geometries"]


def test_lines_are_drawn_as_lines() -> None:
    inputs = '<input semantic="VERTEX" source="#v" offset="0"/>'
    text = f"<lines>{inputs}<p>0 1 2 3</p></lines><linestrips>{inputs}<p>0 1 4</p><p>2 3</p></linestrips>"
    found = contents(document(text))
    drawn = [sorted(places(mesh)[mesh.strokes].tolist()) for mesh in found.meshes if mesh.strokes is not None]
    assert [len(lines) for lines in drawn] == [2, 3]
    assert [[0, 0, 0], [4, 0, 0]] in drawn[1]
    assert [[4, 0, 0], [4, 4, 0]] in drawn[1]


# --- materials -------------------------------------------------------------------------------------------------------------


def colour(key: str, values: str) -> str:
    return f"<{key}><color>{values}</color></{key}>"


def number(key: str, value: float) -> str:
    return f"<{key}><float>{value}</float></{key}>"


@pytest.mark.parametrize(
    ("shader", "expected"),
    [
        (f"<lambert>{colour('diffuse', '1 0.5 0 1')}</lambert>", {"brdf": "lambert", "kd": [1, 0.5, 0]}),
        ("<lambert/>", {"brdf": "lambert", "kd": [0.8, 0.8, 0.8]}),
        (
            f"<lambert>{colour('emission', '1 0 0 1')}{colour('diffuse', '0 0 1 1')}</lambert>",
            {"brdf": "lambert", "kd": [0, 0, 1], "emission": [1, 0, 0]},
        ),
        (f"<constant>{colour('emission', '1 0 0 1')}</constant>", {"brdf": "lambert", "kd": [0, 0, 0], "emission": [1, 0, 0]}),
        (
            f"<phong>{colour('diffuse', '1 1 1 1')}{colour('specular', '0.5 0.5 0.5 1')}{number('shininess', 50)}</phong>",
            {"brdf": "phong", "kd": [1, 1, 1], "ks": [0.5, 0.5, 0.5], "exponent": 50},
        ),
        (
            f"<blinn>{colour('diffuse', '1 1 1 1')}{colour('specular', '0.5 0.5 0.5 1')}{number('shininess', 50)}</blinn>",
            {"brdf": "blinn_phong", "kd": [1, 1, 1], "ks": [0.5, 0.5, 0.5], "exponent": 50},
        ),
        (
            f"<blinn>{colour('diffuse', '1 1 1 1')}{colour('specular', '0 0 0 1')}{number('shininess', 50)}</blinn>",
            {"brdf": "lambert", "kd": [1, 1, 1]},
        ),
    ],
)
def test_shaders(shader: str, expected: dict[str, Any]) -> None:
    assert material(shader) == expected


@pytest.mark.parametrize(
    ("mode", "transparent", "transparency", "alpha"),
    [
        ("A_ONE", "0 0 0 1", 0.25, 0.25),
        ("A_ONE", "0 0 0 0.5", 0.5, 0.25),
        ("A_ZERO", "0 0 0 0.25", 1.0, 0.75),
        ("RGB_ZERO", "0.25 0.25 0.25 1", 1.0, 0.75),
        ("RGB_ONE", "0.25 0.25 0.25 1", 1.0, 0.25),
        ("A_ONE", "1 1 1 1", 1.0, None),
        ("A_ONE", "1 1 1 1", 0.0, None),
        ("RGB_ZERO", "0 0 0 1", 1.0, None),
    ],
)
def test_opacity(mode: str, transparent: str, transparency: float, alpha: float | None) -> None:
    element = f'<transparent opaque="{mode}"><color>{transparent}</color></transparent>'
    given_material = material(f"<lambert>{element}{number('transparency', transparency)}</lambert>")
    if alpha is None:
        assert "alpha" not in given_material
    else:
        assert given_material["alpha"] == pytest.approx(alpha, abs=1e-5)
        assert given_material["alpha_mode"] == "blend"


@pytest.mark.parametrize(("text", "sides"), [("1", "both"), ("0", "front"), (None, None)])
def test_double_sided(text: str | None, sides: str | None) -> None:
    extra = f'<extra><technique profile="GOOGLEEARTH"><double_sided>{text}</double_sided></technique></extra>' if text else ""
    assert material("<lambert/>", extra=extra).get("sides") == sides


SAMPLER = """<newparam sid="surf"><surface type="2D"><init_from>img</init_from></surface></newparam>
<newparam sid="samp"><sampler2D><source>surf</source><wrap_s>MIRROR</wrap_s><magfilter>NEAREST</magfilter>
</sampler2D></newparam>"""
TEXTURED = '<lambert><diffuse><texture texture="{texture}" texcoord="UVMap"/></diffuse></lambert>'


@pytest.mark.parametrize("uri", ["one%20two.png", "./one two.png", "file:///C:/elsewhere/One Two.png"])
def test_textures_are_found_and_sampled_as_the_file_says(tmp_path: Path, uri: str) -> None:
    (tmp_path / "one two.png").write_bytes(PNG)
    image = f'<image id="img"><init_from>{uri}</init_from></image>'
    path = str(tmp_path / "one two.png")
    sampled = material(TEXTURED.format(texture="samp"), tmp_path, params=SAMPLER, images=image)
    assert sampled["kd"] == {"texture": path, "factor": [1, 1, 1], "wrap": ["mirror", "repeat"], "filter": "nearest"}
    direct = material(TEXTURED.format(texture="img"), tmp_path, images=image)
    assert direct["kd"]["texture"] == path


def test_a_texture_reads_the_set_of_uvs_that_its_material_binds(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(PNG)
    inputs = '<input semantic="VERTEX" source="#v" offset="0"/><input semantic="TEXCOORD" source="#t" offset="1" set="0"/>'
    inputs += '<input semantic="TEXCOORD" source="#u" offset="1" set="2"/>'
    given_sources = source("t", "0 0 1 0 0 1", "ST") + source("u", "5 5 6 5 5 6", "ST")
    bind = BIND.format(inputs='<bind_vertex_input semantic="UVMap" input_semantic="TEXCOORD" input_set="2"/>')
    found = contents(
        document(
            f'<triangles count="1" material="m">{inputs}<p>0 0 1 1 3 2</p></triangles>',
            NODE.format(inner=INSTANCE.format(bind=bind)),
            sources=given_sources,
            libraries=effect(TEXTURED.format(texture="img"), images='<image id="img"><init_from>a.png</init_from></image>'),
        ),
        tmp_path,
    )
    assert uvs(found)[0].min() == 5


# --- bad files -------------------------------------------------------------------------------------------------------------

BOMB = '<!DOCTYPE COLLADA [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;">]>'
EXTERNAL = '<!DOCTYPE COLLADA [<!ENTITY a SYSTEM "file:///etc/passwd">]>'


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("garbage", "line 1, column 1: the text is not XML"),
        ("<html></html>", "its XML begins with <html>, not <COLLADA>"),
        (document()[:-40], "the XML ends too early; is the file truncated"),
        (document().replace("<COLLADA", BOMB + "<COLLADA", 1), "has a document type"),
        (document().replace("<COLLADA", EXTERNAL + "<COLLADA", 1).replace("0 1 3", "&a;"), "has a document type"),
        (document().replace("0 1 3", "&a;"), "the text is not XML"),
        (document().replace("0 1 3", "0 1 9"), "geometry 'G': index 9 is out of range: it has 5 positions"),
        (document().replace("0 1 3", "0 1 -3"), "geometry 'G': index -3 is out of range"),
        (document().replace("0 1 3", "0 1 x"), "geometry 'G': <p>, line 1: 'x' is not a number"),
        (
            document().replace('count="5" stride="3"', 'count="4000000000" stride="3"'),
            "has 15 numbers, and its accessor needs 12,000",
        ),
        (document().replace('source="#v"', 'source="#w"'), "geometry 'G': has no vertices '#w'"),
        (
            document().replace('semantic="POSITION" source="#p"', 'semantic="POSITION" source="#q"'),
            "has no source '#q' of numbers",
        ),
        (document().replace('offset="0"', 'offset="two"'), "<input>: offset='two' is not a number"),
        (document(nodes='<node id="n"><instance_node url="#n"/></node>'), "node 'n' contains itself"),
        (document(nodes=NODE.format(inner="<translate>1 2</translate>")), "node 'N': <translate> does not have 3 numbers"),
        (document(nodes=NODE.format(inner="<scale>1e200 1 1</scale>" * 2)), "transform that is not finite"),
        ("<COLLADA>" + "<a>" * 600, "nested more than 512 deep"),
        (document(nodes=""), "holds no triangles"),
    ],
)
def test_a_bad_file_says_what_is_wrong_and_where(data: str, message: str) -> None:
    with pytest.raises(AssetError, match=message) as caught:
        contents(data)
    assert str(caught.value).startswith("a.dae: ")
    assert "\n" not in str(caught.value)


def test_instances_of_instances_are_counted_before_they_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dae, "MOST_INSTANCES", 1000)
    nodes = "".join(f'<node id="n{k}">' + 10 * f'<instance_node url="#n{k + 1}"/>' + "</node>" for k in range(9))
    with pytest.raises(AssetError, match="instances of nodes make more than 1,000 nodes"):
        contents(document(nodes=nodes + '<node id="n9"/>'))


@given(st.integers(0, 1 << 30), st.integers(0, 255))
@settings(max_examples=60, deadline=None)
def test_a_changed_byte_gives_a_mesh_or_one_line(position: int, value: int) -> None:
    library = effect(f"<phong>{colour('diffuse', '1 0 0 1')}{number('shininess', 9)}</phong>", SAMPLER)
    node = NODE.format(inner=f"<rotate>0 0 1 9</rotate>{INSTANCE.format(bind=BIND.format(inputs=''))}")
    data = bytearray(document(nodes=node, libraries=library).encode())
    data[position % len(data)] = value
    assert "do not fit together" not in complaint("a.dae", bytes(data))


def test_numbers_with_a_comma_as_programs_of_some_languages_write_them() -> None:
    node = NODE.format(inner=f"<translate>0,5 -1,25 0</translate>{INSTANCE.format(bind='')}")
    assert corners(contents(document(nodes=node)))[0][0].tolist() == [0.5, -1.25, 0]
