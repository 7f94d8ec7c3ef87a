"""Materials of glTF files: each property and extension becomes what the specification says, or a warning names it."""

from __future__ import annotations

import base64
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade import Image, Renderer, Scene, verify
from glshade.brdfs import BRDFS
from glshade.errors import AssetError
from glshade.mesh.file import AssetWarning
from glshade.mesh.reading import gltf_material
from glshade.mesh.reading.file import MeshFile
from glshade.textures.texture import Texture

TEXTURE = {"index": 0}
TURNED = {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.25, 0.5], "rotation": 0.5, "scale": [2, 3]}}}
MIB = 1 << 20
MAPS = ["normalTexture", "occlusionTexture", "emissiveTexture"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a picture of 2 x 2 pixels."""
    path = tmp_path_factory.mktemp("gltf")
    Image(np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], dtype=np.uint8)).save(path / "a.png")
    return path


def header(**more: Any) -> dict[str, Any]:
    """Returns the JSON of a file with one texture. more: replaces its lists."""
    return {"textures": [{"source": 0}], "images": [{"uri": "a.png"}], **more}


def converted(folder: Path, tree: dict[str, Any] | None = None, **material: Any) -> tuple[dict[str, Any], str]:
    """Returns the table of a material, which its model accepts, and the warnings as one text."""
    file = MeshFile(folder / "a.gltf", folder, b"x" * MIB, folders=frozenset({folder.resolve()}))
    table = gltf_material.material(file, header() if tree is None else tree, [], {"name": "it", **material}, "materials[3]")
    BRDFS[table["brdf"]].model_validate(table)
    return table, "\n".join(line.removeprefix(f"{file.path}: ") for line in file.contents.warnings)


def silent(folder: Path, tree: dict[str, Any] | None = None, **material: Any) -> dict[str, Any]:
    """Returns the table of a material that is converted without a warning."""
    table, warnings = converted(folder, tree, **material)
    assert not warnings
    return table


def pbr(**keys: Any) -> dict[str, Any]:
    return {"pbrMetallicRoughness": keys}


def extension(name: str, **keys: Any) -> dict[str, Any]:
    return {"extensions": {name: keys}}


class TestModel:
    """The parameters of the reflectance model."""

    def test_the_defaults(self, folder: Path) -> None:
        """A primitive without a material is white, metallic and rough, and shows its front alone."""
        plain = {"brdf": "ggx", "kd": [1.0, 1.0, 1.0], "metallic": 1.0, "roughness": 1.0, "sides": "front"}
        assert silent(folder) == plain

    def test_metallic_and_roughness(self, folder: Path) -> None:
        plain = silent(folder, **pbr(metallicFactor=0, roughnessFactor=0.25))
        assert (plain["metallic"], plain["roughness"]) == (0.0, 0.25)
        packed = silent(folder, **pbr(metallicRoughnessTexture=TEXTURE, metallicFactor=0.5, baseColorTexture=TEXTURE))
        picture = {"texture": str(folder / "a.png"), "wrap": ["repeat", "repeat"]}
        assert packed["kd"] == {**picture, "factor": [1.0, 1.0, 1.0]}
        assert packed["metallic"] == {**picture, "factor": 0.5, "channel": "b"}
        assert packed["roughness"] == {**picture, "factor": 1.0, "channel": "g"}
        dielectric = silent(folder, **pbr(metallicRoughnessTexture=TEXTURE, metallicFactor=0))
        assert dielectric["metallic"] == 0, "what is multiplied by 0 needs no picture"

    def test_reflectance_at_normal_incidence(self, folder: Path) -> None:
        assert silent(folder, **extension("KHR_materials_ior", ior=2.0))["f0"] == pytest.approx([1 / 9] * 3)
        assert silent(folder, **extension("KHR_materials_ior"))["f0"] == pytest.approx([0.04] * 3)
        assert silent(folder, **extension("KHR_materials_ior", ior=0))["f0"] == pytest.approx([1.0] * 3)
        tinted = silent(folder, **extension("KHR_materials_specular", specularColorFactor=[1, 0.5, 50]))
        assert tinted["f0"] == pytest.approx([0.04, 0.02, 1.0])
        textured = silent(folder, **extension("KHR_materials_specular", specularColorTexture=TEXTURE))
        assert textured["f0"]["factor"] == pytest.approx([0.04] * 3)
        weak, warnings = converted(folder, **extension("KHR_materials_specular", specularFactor=0.5))
        assert weak["f0"] == pytest.approx([0.02] * 3)
        assert "at normal incidence alone" in warnings

    def test_no_specular_reflection_at_all(self, folder: Path) -> None:
        """A specular strength of 0 leaves the diffuse light alone, also at grazing angles."""
        table = silent(folder, **pbr(metallicFactor=0), **extension("KHR_materials_specular", specularFactor=0))
        assert table["brdf"] == "lambert"

    def test_specular_and_glossiness(self, folder: Path) -> None:
        """The model is used even where the file gives the other one too."""
        old = {"diffuseFactor": [0.8, 0.4, 0.2, 1], "specularFactor": [0.5, 0.25, 0], "glossinessFactor": 0.75}
        glossy = silent(folder, **extension(gltf_material.SPECULAR_GLOSSINESS, **old), **pbr(baseColorFactor=[0, 1, 0, 1]))
        expected = {"brdf": "ggx", "kd": [0.4, 0.2, 0.1], "metallic": 0.0, "roughness": 0.25, "f0": [0.5, 0.25, 0.0]}
        assert glossy == {**expected, "sides": "front"}

    def test_a_texture_of_specular_and_glossiness(self, folder: Path) -> None:
        keys = {"diffuseFactor": [0, 0, 0, 1], "specularGlossinessTexture": TEXTURE, "glossinessFactor": 0.75}
        table = silent(folder, **extension(gltf_material.SPECULAR_GLOSSINESS, **keys))
        assert table["f0"]["factor"] == [1.0, 1.0, 1.0]
        roughness = table["roughness"]
        assert (roughness["channel"], roughness["factor"], roughness["add"]) == ("a", -0.75, 1.0)
        keys["diffuseFactor"] = [0.5, 0, 0, 1]
        _, warnings = converted(folder, **extension(gltf_material.SPECULAR_GLOSSINESS, **keys))
        assert "pbrSpecularGlossiness is approximate" in warnings

    def test_anisotropy(self, folder: Path) -> None:
        """The widths are the extension's: mix(alpha, 1, strength^2) along the tangent, alpha across."""
        keys: dict[str, Any] = {"anisotropyStrength": 0.5, "anisotropyRotation": np.pi / 6}
        found = silent(folder, **pbr(roughnessFactor=0.6), **extension("KHR_materials_anisotropy", **keys))
        assert found["tangent_direction"] == pytest.approx(30)
        aspect = np.sqrt(1 - 0.9 * found["anisotropy"])
        alpha = found["roughness"] ** 2
        assert (alpha / aspect, alpha * aspect) == pytest.approx((0.36 + 0.64 * 0.25, 0.36))
        keys["anisotropyTexture"] = TEXTURE
        found, warnings = converted(folder, **pbr(roughnessFactor=0.6), **extension("KHR_materials_anisotropy", **keys))
        assert found["tangent_direction"]["rotate"] == pytest.approx(30)
        assert found["anisotropy"]["channel"] == "b"
        assert "KHR_materials_anisotropy is approximate" in warnings
        assert "tangent_direction" not in silent(folder, **extension("KHR_materials_anisotropy", anisotropyRotation=1.0))

    def test_emission(self, folder: Path) -> None:
        strong = extension("KHR_materials_emissive_strength", emissiveStrength=4)
        assert silent(folder, emissiveFactor=[1, 0.5, 0], **strong)["emission"] == [4.0, 2.0, 0.0]
        textured = silent(folder, emissiveFactor=[1, 1, 1], emissiveTexture=TEXTURE, **strong)
        assert textured["emission"]["factor"] == [4.0, 4.0, 4.0]
        assert "emission" not in silent(folder, emissiveTexture=TEXTURE), "the factor is 0 by default"

    def test_emission_whose_picture_is_missing_is_dark(self, folder: Path) -> None:
        tree = header(images=[{"uri": "none.png"}])
        table, warnings = converted(folder, tree, emissiveFactor=[1, 1, 1], emissiveTexture=TEXTURE)
        assert "emission" not in table
        assert "texture 'none.png' not found" in warnings

    def test_occlusion(self, folder: Path) -> None:
        table = silent(folder, occlusionTexture={"index": 0, "strength": 0.5})
        assert table["occlusion"]["strength"] == 0.5
        assert "occlusion" not in silent(folder, occlusionTexture={"index": 0, "strength": 0})

    def test_unlit(self, folder: Path) -> None:
        """An unlit material has its base colour and its opacity alone."""
        base = pbr(baseColorFactor=[0.1, 0.2, 0.3, 0.4])
        table = silent(folder, **base, alphaMode="BLEND", emissiveFactor=[1, 1, 1], **extension("KHR_materials_unlit"))
        expected = {"brdf": "lambert", "kd": [0.1, 0.2, 0.3], "unlit": True, "alpha": 0.4, "alpha_mode": "blend"}
        assert table == {**expected, "sides": "front"}

    @pytest.mark.parametrize(
        ("name", "keys"),
        [
            ("KHR_materials_clearcoat", {"clearcoatFactor": 1}),
            ("KHR_materials_sheen", {"sheenColorFactor": [0, 0, 0.5]}),
            ("KHR_materials_transmission", {"transmissionFactor": 0.5}),
            ("KHR_materials_volume", {"thicknessFactor": 1}),
            ("KHR_materials_iridescence", {"iridescenceFactor": 1}),
            ("KHR_materials_dispersion", {"dispersion": 0.1}),
            ("EXT_something_new", {}),
        ],
    )
    def test_what_is_not_drawn_is_named(self, name: str, keys: dict[str, Any], folder: Path) -> None:
        _, warnings = converted(folder, **extension(name, **keys))
        assert warnings == f"material 'it': drawn without {name}, which glshade does not have"
        if keys:
            assert silent(folder, **extension(name)), "a strength of 0 leaves out nothing"

    def test_a_material_without_a_name_is_named_by_its_place(self, folder: Path) -> None:
        _, warnings = converted(folder, name="", **extension("EXT_something_new"))
        assert warnings.startswith("materials[3]: drawn without EXT_something_new")


class TestCoverage:
    """Opacity and sides."""

    def test_the_sides(self, folder: Path) -> None:
        assert silent(folder, doubleSided=False)["sides"] == "front"
        assert silent(folder, doubleSided=True)["sides"] == "both"

    def test_the_modes(self, folder: Path) -> None:
        half = pbr(baseColorFactor=[1, 1, 1, 0.5])
        assert "alpha" not in silent(folder, **half)
        masked = silent(folder, **half, alphaMode="MASK")
        assert (masked["alpha"], masked["alpha_mode"], masked["alpha_cutoff"]) == (0.5, "mask", 0.5)
        blended = silent(folder, **half, alphaMode="BLEND")
        assert (blended["alpha"], blended["alpha_mode"], "alpha_cutoff" in blended) == (0.5, "blend", False)

    def test_an_unknown_mode_is_opaque(self, folder: Path) -> None:
        table, warnings = converted(folder, alphaMode="DITHER")
        assert "alpha_mode" not in table
        assert warnings == "materials[3].alphaMode is 'DITHER', which does not exist; drawn opaque"


class TestTextures:
    """Samplers, transforms and pictures."""

    def kd(self, folder: Path, sampler: dict[str, Any]) -> dict[str, Any]:
        tree = header(textures=[{"source": 0, "sampler": 0}], samplers=[sampler])
        found: dict[str, Any] = silent(folder, tree, **pbr(baseColorTexture=TEXTURE))["kd"]
        return found

    def test_samplers(self, folder: Path) -> None:
        assert self.kd(folder, {"wrapS": 33071, "wrapT": 33648})["wrap"] == ["clamp", "mirror"]
        assert self.kd(folder, {"magFilter": 9728, "minFilter": 9984})["filter"] == "nearest"
        for smooth in ({}, {"magFilter": 9729, "minFilter": 9728}, {"minFilter": 9987}):
            assert "filter" not in self.kd(folder, smooth)
        tree = header(textures=[{"source": 0, "sampler": 0}], samplers=[{"wrapS": 1}])
        table, warnings = converted(folder, tree, **pbr(baseColorTexture=TEXTURE))
        assert table["kd"]["wrap"] == ["repeat", "repeat"]
        assert warnings == "samplers[0].wrapS is 1, which is no wrap mode; the texture repeats"

    @given(
        offset=st.tuples(*[st.floats(-3, 3)] * 2),
        rotation=st.floats(-7, 7),
        scale=st.tuples(*[st.floats(0.01, 4) | st.floats(-4, -0.01)] * 2),
        uv=st.tuples(*[st.floats(-2, 2)] * 2),
    )
    def test_transforms(
        self, folder: Path, offset: tuple[float, float], rotation: float, scale: tuple[float, float], uv: tuple[float, float]
    ) -> None:
        """The picture is read where the specification's matrix leads, although v points up in a scene file."""
        keys = {"offset": list(offset), "rotation": rotation, "scale": list(scale)}
        info = {"index": 0, "extensions": {"KHR_texture_transform": keys}}
        placement = np.array(Texture.model_validate(silent(folder, **pbr(baseColorTexture=info))["kd"]).placement)
        cos, sin = math.cos(rotation), math.sin(rotation)
        expected = np.array(offset) + np.array([[cos, sin], [-sin, cos]]) @ (np.array(scale) * uv)
        at = placement @ [uv[0], 1 - uv[1], 1.0]
        assert [at[0], 1 - at[1]] == pytest.approx(expected, abs=1e-9)

    def test_a_transform_without_effect_leaves_no_keys(self, folder: Path) -> None:
        info = {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0, 0], "rotation": 0, "scale": [1, 1]}}}
        assert set(silent(folder, **pbr(baseColorTexture=info))["kd"]) == {"texture", "wrap", "factor"}

    def test_a_scale_of_0_shows_one_texel(self, folder: Path) -> None:
        info = {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [0, 0], "offset": [0.25, 0.25]}}}
        placement = np.array(Texture.model_validate(silent(folder, **pbr(baseColorTexture=info))["kd"]).placement)
        for uv in ([0, 0], [1, 1]):
            assert placement @ [*uv, 1.0] == pytest.approx([0.25, 0.75], abs=1e-5)

    def test_each_texture_has_its_own_transform(self, folder: Path) -> None:
        table = silent(folder, **pbr(baseColorTexture=TURNED), normalTexture=TEXTURE)
        assert table["kd"]["uv_scale"] == [2.0, 3.0]
        assert "uv_scale" not in table["normal_map"]

    def test_a_transform_may_name_other_coordinates(self, folder: Path) -> None:
        info = {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}}
        material = {"name": "it", **pbr(baseColorTexture=info)}
        assert gltf_material.uv_set({"materials": [material]}, {"material": 0}) == 1

    def test_textures_of_other_coordinates(self, folder: Path) -> None:
        other = {"index": 0, "texCoord": 1}
        table, warnings = converted(folder, **pbr(metallicRoughnessTexture=other, baseColorTexture=TEXTURE))
        assert (table["metallic"], table["roughness"]) == (1.0, 1.0)
        assert (
            warnings == "metallic roughness uses other texture coordinates than the material's first texture; drawn without it"
        )

    def test_webp_is_read(self, folder: Path) -> None:
        tree = header(textures=[{"extensions": {"EXT_texture_webp": {"source": 0}}}])
        assert silent(folder, tree, **pbr(baseColorTexture=TEXTURE))["kd"]["texture"] == str(folder / "a.png")

    def test_a_format_that_cannot_be_read_is_named(self, folder: Path) -> None:
        tree = header(textures=[{"extensions": {"KHR_texture_basisu": {"source": 0}}}])
        table, warnings = converted(folder, tree, **pbr(baseColorTexture=TEXTURE))
        assert table["kd"] == [1.0, 1.0, 1.0]
        assert warnings == "textures[0] is stored with KHR_texture_basisu alone, which cannot be read; drawn without it"
        tree["textures"][0]["source"] = 0
        assert silent(folder, tree, **pbr(baseColorTexture=TEXTURE)), "the other picture takes its place"


class TestFaults:
    """Numbers outside their ranges are clamped; everything that has no meaning is an error that names the place."""

    @pytest.mark.parametrize(
        ("material", "key", "value", "warning"),
        [
            (pbr(baseColorFactor=[1.0000002, 1, 1, 1]), "kd", [1.0, 1.0, 1.0], "baseColorFactor is 1.0000002, more than 1"),
            (pbr(roughnessFactor=1.0001), "roughness", 1.0, "roughnessFactor is 1.0001, more than 1; 1 is used"),
            (pbr(metallicFactor=-0.5), "metallic", 0.0, "metallicFactor is -0.5, less than 0; 0 is used"),
            ({"alphaMode": "MASK", "alphaCutoff": 1.1}, "alpha_cutoff", 1.0, "alphaCutoff is 1.1, more than 1; 1 is used"),
            ({"emissiveFactor": [2, 0, 0]}, "emission", [1.0, 0.0, 0.0], "emissiveFactor is 2.0, more than 1; 1 is used"),
            (extension("KHR_materials_ior", ior=0.5), "f0", [0.0, 0.0, 0.0], "ior is 0.5, less than 1; 1 is used"),
        ],
    )
    def test_clamped(self, material: dict[str, Any], key: str, value: Any, warning: str, folder: Path) -> None:
        table, warnings = converted(folder, **material)
        assert table[key] == value
        assert warning in warnings
        assert warnings.startswith("materials[3].")

    @pytest.mark.parametrize(
        ("material", "message"),
        [
            (
                pbr(baseColorFactor=[1, 1, 1]),
                "pbrMetallicRoughness.baseColorFactor must be a list of 4 finite numbers, not [1, 1, 1]",
            ),
            (pbr(baseColorFactor="red"), 'pbrMetallicRoughness.baseColorFactor must be a list of 4 finite numbers, not "red"'),
            (pbr(roughnessFactor=math.nan), "pbrMetallicRoughness.roughnessFactor must be a finite number, not NaN"),
            (pbr(metallicFactor=True), "pbrMetallicRoughness.metallicFactor must be a finite number, not true"),
            ({"pbrMetallicRoughness": []}, None),
            ({"pbrMetallicRoughness": [1]}, "pbrMetallicRoughness must be an object, not [1]"),
            ({"alphaMode": 3}, "alphaMode must be a text, not 3"),
            ({"normalTexture": {}}, "normalTexture.index must be the index of a texture, not null"),
            ({"normalTexture": {"index": -1}}, "normalTexture.index must be an index: a whole number from 0, not -1"),
            (
                extension("KHR_materials_ior", ior="glass"),
                'extensions.KHR_materials_ior.ior must be a finite number, not "glass"',
            ),
        ],
    )
    def test_refused_with_the_place(self, material: dict[str, Any], message: str | None, folder: Path) -> None:
        with pytest.raises(AssetError) as caught:
            converted(folder, **material)
        if message is not None:
            assert str(caught.value) == f"{folder / 'a.gltf'}: materials[3].{message}"

    @pytest.mark.parametrize(
        ("tree", "message"),
        [
            (header(textures=[]), "textures[0] does not exist; the file has 0 textures"),
            (header(images=[]), "images[0] does not exist; the file has 0 images"),
            (header(textures=[{"source": 0, "sampler": 4}]), "samplers[4] does not exist; the file has 0 samplers"),
            (header(images=[{"bufferView": 2}]), "bufferViews[2] does not exist; the file has 0 bufferViews"),
            (header(images=[{}]), "images[0] has neither a uri nor a bufferView"),
            (header(textures=[7]), "textures[0] must be an object, not 7"),
        ],
    )
    def test_references_out_of_range(self, tree: dict[str, Any], message: str, folder: Path) -> None:
        with pytest.raises(AssetError) as caught:
            converted(folder, tree, **pbr(baseColorTexture=TEXTURE))
        assert str(caught.value) == f"{folder / 'a.gltf'}: {message}"

    @given(
        value=st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=3) | st.just([]) | st.just({}),
        key=st.sampled_from(
            [*MAPS, "pbrMetallicRoughness", "emissiveFactor", "alphaMode", "alphaCutoff", "doubleSided", "extensions", "name"]
        ),
    )
    def test_any_value_is_read_or_refused_in_one_line(self, key: str, value: Any, folder: Path) -> None:
        try:
            converted(folder, **{key: value})
        except AssetError as error:
            (line,) = error.problems
            assert line.startswith(f"{folder / 'a.gltf'}: materials[3]."), line


def square(uvs: bool = True, **material: Any) -> dict[str, Any]:
    """Returns the JSON of a glTF file with a square of one material, and its buffer within."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype="<f4")
    # In glTF v = 0 is the top of the picture.
    at = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], dtype="<f4")
    data = corners.tobytes() + at.tobytes() + np.array([0, 1, 2, 0, 2, 3], dtype="<u2").tobytes()
    attributes = {"POSITION": 0} | ({"TEXCOORD_0": 1} if uvs else {})
    views = [(0, 48), (48, 32), (80, 12)]
    return {
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "material": 0}]}],
        "nodes": [{"mesh": 0, "name": "square"}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": size} for start, size in views],
        "buffers": [
            {"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}
        ],
        "materials": [{"name": "it", **material}],
        **header(),
    }


FRONT: dict[str, Any] = {"type": "orthographic", "eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}


def scene(path: Path, size: int = 8, **camera: Any) -> Scene:
    """Returns a scene that shows a square, from the front, by ambient light of 1."""
    film = {"size": (size, size)}
    lights = [{"type": "ambient"}]
    return Scene.model_validate({"film": film, "camera": {**FRONT, **camera}, "objects": [{"mesh": path}], "lights": lights})


def shown(renderer: Renderer, what: Scene) -> Any:
    """Returns the pixels of a scene, linear float32."""
    return renderer.render(what, dtype="float32").pixels.copy()


def saved(folder: Path, name: str, tree: dict[str, Any]) -> Path:
    path = folder / name
    path.write_text(json.dumps(tree))
    return path


class TestPictures:
    """Whole files, drawn."""

    def test_a_nearest_sampler_shows_squares(self, folder: Path, renderer: Renderer) -> None:
        """The four texels of a picture fill the quarters of a square, without any blending between them."""
        tree = square(**pbr(baseColorTexture=TEXTURE, metallicFactor=0))
        tree["textures"], tree["samplers"] = [{"source": 0, "sampler": 0}], [{"magFilter": 9728}]
        found = verify(scene(saved(folder, "nearest.gltf", tree)), renderer=renderer)
        assert found.verdict == "verified", str(found)
        colours = np.array([[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 1]]]).repeat(4, axis=0).repeat(4, axis=1)
        assert found.picture[..., :3] == pytest.approx(colours, abs=1e-6)

    def test_a_transform_moves_the_picture(self, folder: Path, renderer: Renderer) -> None:
        """With an offset of half a picture along u, the halves change places."""
        info = {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}}
        tree = square(**pbr(baseColorTexture=info, metallicFactor=0))
        tree["textures"], tree["samplers"] = [{"source": 0, "sampler": 0}], [{"magFilter": 9728}]
        pixels = shown(renderer, scene(saved(folder, "moved.gltf", tree), 2))
        expected = np.array([[[0, 1, 0], [1, 0, 0]], [[1, 1, 1], [0, 0, 1]]])
        assert pixels[..., :3] == pytest.approx(expected, abs=1e-6)

    def test_the_back_of_a_single_sided_square_is_culled(self, folder: Path, renderer: Renderer) -> None:
        for both in (False, True):
            path = saved(folder, f"sides{both}.gltf", square(doubleSided=both, **pbr(baseColorFactor=[1, 1, 1, 1])))
            for eye, seen in (([0, 0, 5], True), ([0, 0, -5], both)):
                assert (shown(renderer, scene(path, eye=eye))[4, 4, 0] > 0.5) == seen

    def test_a_part_without_coordinates_is_drawn_plain(self, folder: Path, renderer: Renderer) -> None:
        path = saved(folder, "plain.gltf", square(uvs=False, **pbr(baseColorTexture=TEXTURE, baseColorFactor=[1, 0.5, 0, 1])))
        with pytest.warns(AssetWarning, match=r"square has no texture coordinates; drawn without the textures of its material"):
            pixels = shown(renderer, scene(path))
        assert pixels[4, 4, :3] == pytest.approx([1, 0.5, 0])

    @pytest.mark.parametrize("embedded", [False, True])
    def test_a_picture_that_cannot_be_decoded_is_drawn_plain(self, folder: Path, embedded: bool, renderer: Renderer) -> None:
        tree = square(**pbr(baseColorTexture=TEXTURE, baseColorFactor=[1, 0.5, 0, 1]))
        broken = (folder / "a.png").read_bytes()[:40]
        (folder / "broken.png").write_bytes(broken)
        data = "data:image/png;base64," + base64.b64encode(broken).decode()
        tree["images"] = [{"uri": data if embedded else "broken.png"}]
        path = saved(folder, f"broken{embedded}.gltf", tree)
        named = "an embedded picture" if embedded else r"texture 'broken\.png'"
        with pytest.warns(AssetWarning, match=rf"{named} cannot be read as a picture: .*; drawn without it"):
            pixels = shown(renderer, scene(path))
        assert pixels[4, 4, :3] == pytest.approx([1, 0.5, 0])

    def test_a_repaired_picture_is_drawn(self, folder: Path, renderer: Renderer) -> None:
        tree = square(**pbr(baseColorTexture=TEXTURE))
        tree["images"] = [{"uri": "later.png"}]
        (folder / "later.png").write_bytes(b"nothing")
        path = saved(folder, "later.gltf", tree)
        with pytest.warns(AssetWarning, match="drawn without it"):
            assert np.ptp(shown(renderer, scene(path))[..., 0]) == 0
        (folder / "later.png").write_bytes((folder / "a.png").read_bytes())
        assert np.ptp(shown(renderer, scene(path))[..., 0]) > 0.5
