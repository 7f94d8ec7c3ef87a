"""Folders of baselines: names, variants, and what may not lie in them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.errors import GlshadeError
from glshade.golden.baselines import Baselines
from glshade.golden.names import check_key, check_name, is_no_pair, sidecar_path
from glshade.golden.sidecar import Driver, First, Sidecar, sha256_of, write_sidecar

LLVMPIPE = Driver(renderer="llvmpipe (LLVM 15.0.7, 256 bits)", version="4.5 Mesa 22.3.6", backend="egl")
OLDER = Driver(renderer="llvmpipe (LLVM 15.0.7, 256 bits)", version="4.5 Mesa 21.0.0", backend="egl")
NARROW = Driver(renderer="llvmpipe (LLVM 15.0.7, 128 bits)", version="4.5 Mesa 22.3.6", backend="egl")
SOFTPIPE = Driver(renderer="softpipe", version="3.3 Mesa 22.3.6", backend="egl")


def add(path: Path, driver: Driver | None = None, sidecar: bool = True) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(path.name.encode())
    if sidecar:
        sha256 = sha256_of(path)
        write_sidecar(path, Sidecar(sha256=sha256, first=First(sha256=sha256), driver=driver))


@pytest.mark.parametrize("name", ["ball.png", "cars/red one.exr", "Ä.png", "a/b/c/d.PNG", "icons@2x/ball.png", "a..b.png"])
def test_names(name: str, tmp_path: Path) -> None:
    check_name(name)
    assert Baselines(tmp_path).path(name) == tmp_path / name


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("/etc/ball.png", 'without ".."'),
        ("../ball.png", 'without ".."'),
        ("a/../ball.png", 'without ".."'),
        ("..\\ball.png", "backslashes"),
        ("", "is empty"),
        ("a//ball.png", "is empty"),
        ("./ball.png", 'starts with "."'),
        (".hidden.png", 'starts with "."'),
        (".glshade/first/ball.png", 'starts with "."'),
        ("a\nb.png", "control characters"),
        ("\u202egnp.png", "control characters"),
        ("ball.jpg", "a baseline is a PNG or an OpenEXR file"),
        ("ball.hdr", "a baseline is a PNG or an OpenEXR file"),
        ("ball", "a baseline is a PNG or an OpenEXR file"),
        ("ball.png.glshade.json", "a baseline is a PNG or an OpenEXR file"),
        ("ball@nvidia.png", "marks the variants"),
    ],
)
def test_names_that_are_refused(name: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(GlshadeError, match=reason):
        check_name(name)
    with pytest.raises(GlshadeError, match=reason):
        Baselines(tmp_path).path(name)


@given(st.lists(st.sampled_from([*"aZ.@/\\ ~\n\0é", "..", ".png", ".exr"]), max_size=12).map("".join))
def test_no_name_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    try:
        path = Baselines(tmp_path).path(name)
    except GlshadeError:
        return
    assert path.resolve().is_relative_to(tmp_path.resolve())
    assert path.relative_to(tmp_path).as_posix() == name
    assert path.suffix.lower() in (".png", ".exr")


@pytest.mark.parametrize("key", ["", ".", "..", ".a", "a b", "a/b", "é", "a\n", "@"])
def test_keys_that_are_refused(key: str) -> None:
    with pytest.raises(GlshadeError, match="is no key of a variant"):
        check_key(key)


def test_links_may_not_lead_out_of_the_folder(tmp_path: Path) -> None:
    root, outside = tmp_path / "root", tmp_path / "outside"
    (root / "within").mkdir(parents=True)
    outside.mkdir()
    (root / "out").symlink_to(outside)
    (root / "in").symlink_to(root / "within")
    (root / "loop").symlink_to(root / "loop")
    baselines = Baselines(root)
    assert baselines.path("in/ball.png") == root / "in/ball.png"
    with pytest.raises(GlshadeError, match="a link leads out of the folder of baselines"):
        baselines.path("out/ball.png")
    with pytest.raises(GlshadeError, match="cannot be used"):
        baselines.path("loop/ball.png")
    (root / ".glshade").symlink_to(outside)
    with pytest.raises(GlshadeError, match="a link leads out of the folder of baselines"):
        baselines.first_path("ball.png")
    # The folder itself may be a link.
    (tmp_path / "link").symlink_to(root)
    assert Baselines(tmp_path / "link").path("within/ball.png") == tmp_path / "link/within/ball.png"


def test_names_that_differ_only_in_case_are_refused(tmp_path: Path) -> None:
    add(tmp_path / "Cars/Red.png")
    baselines = Baselines(tmp_path)
    baselines.check_case("Cars/Red.png")
    baselines.check_case("Cars/Blue.png")
    baselines.check_case("Cars/Red.exr")
    baselines.check_case("other/Red.png")
    for name in ("Cars/red.png", "cars/Red.png", "cars/Blue.png"):
        with pytest.raises(GlshadeError, match="upper and lower case"):
            baselines.check_case(name)
    add(tmp_path / "e\u0301.png")
    with pytest.raises(GlshadeError, match="upper and lower case"):
        baselines.check_case("é.png")
    add(tmp_path / "ball@Mine.png")
    with pytest.raises(GlshadeError, match="upper and lower case"):
        baselines.check_case("ball.png", "mine")


def test_names_of_a_folder(tmp_path: Path) -> None:
    for name in ("z.png", "cars/red.exr", "ball.png", "ball@softpipe.png", ".glshade/first/ball.png"):
        add(tmp_path / name)
    # Pictures for screens of high resolution are often named so. They are pictures of their own, since they have no sidecar.
    add(tmp_path / "icon.png", sidecar=False)
    add(tmp_path / "icon@2x.png", sidecar=False)
    (tmp_path / "readme.txt").write_text("")
    assert list(Baselines(tmp_path).names()) == ["ball.png", "cars/red.exr", "icon.png", "icon@2x.png", "z.png"]
    assert list(Baselines(tmp_path / "absent").names()) == []
    assert is_no_pair(sidecar_path(tmp_path / "ball.png"))
    assert is_no_pair(tmp_path / "ball@softpipe.png")
    assert not is_no_pair(tmp_path / "icon@2x.png")
    assert not is_no_pair(tmp_path / "ball.png")


def test_the_nearest_variant_is_first(tmp_path: Path) -> None:
    for key, driver in (("", SOFTPIPE), ("@old", OLDER), ("@narrow", NARROW), ("@new", LLVMPIPE), ("@a", None)):
        add(tmp_path / f"ball{key}.png", driver)
    # These are variants of other baselines.
    add(tmp_path / "ball2@new.png", LLVMPIPE)
    add(tmp_path / "ball@new.exr", LLVMPIPE)
    baselines = Baselines(tmp_path)

    def keys(driver: Driver | None) -> list[str]:
        return [variant.key for variant in baselines.variants("ball.png", driver)]

    assert keys(LLVMPIPE) == ["new", "old", "narrow", "", "a"]
    assert keys(OLDER) == ["old", "new", "narrow", "", "a"]
    assert keys(SOFTPIPE)[0] == ""
    assert keys(Driver(renderer="NVIDIA GeForce RTX 3080/PCIe/SSE2"))[0] == ""
    assert keys(None) == ["", "a", "narrow", "new", "old"]
    assert baselines.variants("absent.png") == []
    assert [baselines.has_variants(name) for name in ("ball.png", "ball2.png", "absent.png")] == [True, True, False]
    # Folders that only `glshade compare` uses may hold other formats and names.
    add(tmp_path / "icon@2x.jpg", sidecar=False)
    assert [variant.path.name for variant in baselines.variants("icon@2x.jpg", LLVMPIPE)] == ["icon@2x.jpg"]
    with pytest.raises(GlshadeError, match="leads out of the folder"):
        baselines.variants("../ball.png")


def test_a_variant_whose_sidecar_cannot_be_used_is_still_there(tmp_path: Path) -> None:
    add(tmp_path / "ball.png", sidecar=False)
    add(tmp_path / "ball@softpipe.png", SOFTPIPE)
    sidecar_path(tmp_path / "ball@softpipe.png").write_text("{")
    near, far = Baselines(tmp_path).variants("ball.png", SOFTPIPE)
    assert (near.key, near.sidecar, far.key, far.sidecar) == ("softpipe", None, "", None)
    assert near.note.startswith("ball@softpipe.png.glshade.json is not used: is damaged")
    assert far.note.startswith("ball.png has no sidecar")
