"""MTL files: each statement becomes a key of a material, or a warning that names it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade import Image
from glshade.brdfs import BRDFS
from glshade.image.file import read
from glshade.mesh.reading.contents import EMBEDDED, Contents
from tests.support.mesh_contents import PNG, read_mesh

OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"


def contents_of(folder: Path, statements: str) -> Contents:
    """Returns the contents of an OBJ file whose material has these statements."""
    (folder / "a.mtl").write_text(f"newmtl m\n{statements}\n")
    for name in ("a b.png", "c.png"):
        if not (folder / name).exists():
            (folder / name).write_bytes(PNG)
    return read_mesh("a.obj", OBJ, folder)


def material_of(folder: Path, statements: str) -> tuple[dict[str, Any], str]:
    """Returns the material, which a scene accepts, and the warnings."""
    found = contents_of(folder, statements)
    material = found.parts[0]["material"]
    placed = {
        key: {**value, "texture": "embedded.png"}
        if isinstance(value, dict) and value["texture"].startswith(EMBEDDED)
        else value
        for key, value in material.items()
    }
    BRDFS[material["brdf"]].model_validate(placed)
    return material, "\n".join(found.warnings)


def quiet(folder: Path, statements: str) -> dict[str, Any]:
    """Returns the material of statements that give no warning."""
    material, warnings = material_of(folder, statements)
    assert not warnings
    return material


# --- Models ----------------------------------------------------------------------------------------------------------


def test_the_illumination_models(tmp_path: Path) -> None:
    statements = "Kd 0.5 0.25 1\nKs 1 1 1\nNs 20\n"
    kd = [0.5, 0.25, 1]
    assert quiet(tmp_path, f"{statements}illum 0") == {"brdf": "lambert", "kd": kd, "unlit": True}
    assert quiet(tmp_path, f"{statements}illum 1") == {"brdf": "lambert", "kd": kd}
    assert quiet(tmp_path, f"{statements}illum 2") == {"brdf": "phong", "kd": kd, "ks": [1, 1, 1], "exponent": 20}
    for illum in range(3, 11):
        material, warnings = material_of(tmp_path, f"{statements}illum {illum}")
        assert material["brdf"] == "phong"
        assert f"illum {illum} asks for" in warnings


def test_emission(tmp_path: Path) -> None:
    picture = str(tmp_path / "c.png")
    assert quiet(tmp_path, "Ke 1 2 0.5")["emission"] == [1, 2, 0.5]
    assert "emission" not in quiet(tmp_path, "Ke 0 0 0")
    assert quiet(tmp_path, "map_Ke c.png")["emission"] == {"texture": picture, "factor": [1, 1, 1]}
    assert quiet(tmp_path, "Ke 2 2 2\nmap_Ke c.png")["emission"] == {"texture": picture, "factor": [2, 2, 2]}


def test_physically_based_statements_are_those_of_gltf(tmp_path: Path) -> None:
    assert quiet(tmp_path, "Kd 1 0 0\nPr 0.25\nPm 1\nNs 3\nKs 1 1 1\nillum 3") == {
        "brdf": "ggx",
        "kd": [1, 0, 0],
        "metallic": 1,
        "roughness": 0.25,
    }
    material = quiet(
        tmp_path, "map_Pr -imfchan g c.png\nmap_Pm a b.png\nPm 0.5\nNi 2\naniso 0.5\nanisor 0.25\nPc 0\nPs 0.0\nPcr 0.1"
    )
    assert material["roughness"] == {"texture": str(tmp_path / "c.png"), "factor": [1, 1, 1], "channel": "g"}
    assert material["metallic"] == {"texture": str(tmp_path / "a b.png"), "factor": [0.5] * 3}
    np.testing.assert_allclose(material["f0"], 1 / 9)
    assert (material["anisotropy"], material["tangent_direction"]) == (0.5, 90)
    assert "pc, ps not used" in material_of(tmp_path, "Pr 0.5\nPc 0.5\nPs 1")[1]


def test_textures_of_the_highlight(tmp_path: Path) -> None:
    picture = str(tmp_path / "c.png")
    material = quiet(tmp_path, "Ks 0.5 0.5 0.5\nNs 8\nmap_Ks c.png\nmap_Ns -imfchan m c.png")
    assert material["ks"] == {"texture": picture, "factor": [0.5] * 3}
    assert material["exponent"] == {"texture": picture, "factor": [8, 8, 8], "channel": "a"}
    assert quiet(tmp_path, "Ns 8\nmap_Ks c.png")["ks"] == {"texture": picture, "factor": [1, 1, 1]}
    assert quiet(tmp_path, "Ka 1 1 1\nmap_Ka c.png\nmap_Kd a b.png")["ka"]["texture"] == picture
    assert quiet(tmp_path, "Ka 1 1 1\nmap_Ka c.png\nmap_Kd c.png")["ka"] == [1, 1, 1]


# --- Numbers ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("statements", "key", "value", "warning"),
    [
        ("Ks 1 1 1\nNs 1e9", "exponent", 1e8, "'ns 1e+09' is outside the range from 0 to 1e+08"),
        ("Ks 1 1 1\nNs -5", "brdf", "lambert", "'ns -5' is outside"),
        ("Kd -0.5 0.5 2", "kd", [0, 0.5, 2], "the colour kd = -0.5 0.5 2 is outside"),
        ("Kd nan 0 0", "kd", [0.8] * 3, "'kd nan 0 0' is not a number"),
        ("Kd 1 x 0", "kd", [0.8] * 3, "'kd 1 x 0' is not a number"),
        ("Kd spectral file.rfl 1", "kd", [0.8] * 3, "'kd spectral' names a spectrum"),
        ("Pr 1.5", "roughness", 1, "'pr 1.5' is outside the range from 0 to 1"),
        ("Pr 1\nKd 2 0.5 0", "kd", [1, 0.5, 0], "above 1"),
        ("d -halo 0.5", "alpha", 0.5, "halo"),
        ("d 1.5", "kd", [0.8] * 3, "'d 1.5' is outside"),
        ("Tf 0.5 1 1\nd 0.5", "alpha", 0.5, "Tf"),
        ("refl -type sphere c.png", "brdf", "lambert", "refl not used"),
        ("unknown 1", "brdf", "lambert", "unknown not used"),
    ],
)
def test_what_cannot_be_drawn_is_named(tmp_path: Path, statements: str, key: str, value: Any, warning: str) -> None:
    material, warnings = material_of(tmp_path, statements)
    assert material[key] == value
    assert warnings.startswith("a.obj: material 'm': ")
    assert warning in warnings
    assert "\n" not in warnings


def test_colours_may_be_one_number_or_xyz(tmp_path: Path) -> None:
    assert quiet(tmp_path, "Kd 0.5")["kd"] == [0.5] * 3
    # The white of Rec. 709, D65.
    np.testing.assert_allclose(quiet(tmp_path, "Kd xyz 0.4752 0.5 0.5444")["kd"], 0.5, atol=1e-3)
    assert quiet(tmp_path, "Kd 0.5 0.5 0.5 # comment\nNi 1.45\nTf 1 1 1\nsharpness 60")["kd"] == [0.5] * 3


def test_statements_before_the_first_material_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("Kd 1 0 0\nnewmtl m\nKd 0 1 0\n")
    found = read_mesh("a.obj", OBJ, tmp_path)
    assert found.parts[0]["material"]["kd"] == [0, 1, 0]
    assert "before the first 'newmtl'" in found.warnings[0]


# --- Options of textures ---------------------------------------------------------------------------------------------


def test_options_place_the_picture(tmp_path: Path) -> None:
    options = "-blendu on -s 2 3 1 -o 0.5 -0.25 -t 0 0 0 -clamp on -boost 0 -mm 0.25 0.5"
    assert quiet(tmp_path, f"Kd 1 1 0.5\nmap_Kd {options} a b.png")["kd"] == {
        "texture": str(tmp_path / "a b.png"),
        "factor": [0.5, 0.5, 0.25],
        "uv_offset": [0.5, -0.25],
        "uv_scale": [2, 3],
        "wrap": ["clamp", "clamp"],
        "add": [0.25, 0.25, 0.125],
    }
    assert quiet(tmp_path, "map_Kd -s 2 a b.png")["kd"]["uv_scale"] == [2, 1]
    assert quiet(tmp_path, "bump -o 0.5 -bm 2 c.png")["bump_map"] == {
        "texture": str(tmp_path / "c.png"),
        "uv_offset": [0.5, 0],
        "height": 0.1,
    }


@pytest.mark.parametrize(
    "option",
    [
        "-blendu off",
        "-boost 2",
        "-cc on",
        "-texres 256",
        "-t 0.5",
        "-type sphere",
        "-s 0 1 1",
        "-mm 0 nan",
        "-imfchan z",
        "-o x",
    ],
)
def test_options_that_cannot_be_drawn_are_named(tmp_path: Path, option: str) -> None:
    material, warnings = material_of(tmp_path, f"map_Kd {option} c.png")
    if option != "-o x":
        assert material["kd"] == {"texture": str(tmp_path / "c.png"), "factor": [1, 1, 1]}
    assert f"map_kd: '{option.split()[0]}" in warnings


# --- Opacity ---------------------------------------------------------------------------------------------------------


def save(path: Path, pixels: Any) -> None:
    Image(np.array(pixels, dtype=np.uint8)).save(path)


def embedded(found: Contents, folder: Path) -> Any:
    """Returns the stored values of the base colour's picture, which is part of the contents."""
    name = found.parts[0]["material"]["kd"]["texture"].removeprefix(EMBEDDED)
    (folder / name).write_bytes(found.images[name])
    return np.round(read(folder / name, "linear")[0] * 255)


def test_a_picture_of_opacity_becomes_the_alpha_of_the_base_colour(tmp_path: Path) -> None:
    save(tmp_path / "a b.png", [[[200, 100, 50]]])
    save(tmp_path / "c.png", [[[0, 0, 0], [255, 255, 255]]])
    found = contents_of(tmp_path, "map_Kd -s 2 2 a b.png\nmap_d -s 2 2 c.png")
    material = found.parts[0]["material"]
    assert (material["alpha_mode"], material["alpha"], material["kd"]["uv_scale"]) == ("mask", 1, [2, 2])
    np.testing.assert_array_equal(embedded(found, tmp_path), [[[200, 100, 50, 0], [200, 100, 50, 255]]])
    assert not found.warnings
    assert {str(tmp_path / "a b.png"), str(tmp_path / "c.png")} <= found.dependencies.keys()


def test_a_picture_of_opacity_without_one_of_colours(tmp_path: Path) -> None:
    save(tmp_path / "c.png", [[[64, 64, 64], [128, 128, 128]]])
    found = contents_of(tmp_path, "Kd 1 0.5 0\nmap_d c.png\nd 0.5")
    material = found.parts[0]["material"]
    assert (material["alpha_mode"], material["alpha"], material["kd"]["factor"]) == ("blend", 0.5, [1, 0.5, 0])
    np.testing.assert_array_equal(embedded(found, tmp_path), [[[255, 255, 255, 64], [255, 255, 255, 128]]])


def test_the_alpha_of_the_picture_of_colours_may_be_the_opacity(tmp_path: Path) -> None:
    save(tmp_path / "c.png", [[[10, 20, 30, 0], [40, 50, 60, 255]]])
    assert "alpha_mode" not in quiet(tmp_path, "map_Kd c.png")
    found = contents_of(tmp_path, "map_Kd c.png\nmap_d c.png")
    np.testing.assert_array_equal(embedded(found, tmp_path), [[[10, 20, 30, 0], [40, 50, 60, 255]]])


def test_a_broken_picture_of_opacity_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "c.png").write_bytes(PNG[:40])
    material, warnings = material_of(tmp_path, "Kd 1 0 0\nmap_d c.png")
    assert material == {"brdf": "lambert", "kd": [1, 0, 0]}
    assert "texture 'c.png' cannot be decoded; drawn without it" in warnings
