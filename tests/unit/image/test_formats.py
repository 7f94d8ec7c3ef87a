"""Picture formats: a new file in glshade/image/formats is a new format, without an edit of anything else."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade as package
from glshade import GlshadeError
from glshade.glsl import shaders
from glshade.image.file import format_of
from glshade.image.formats import FORMATS, PictureFormat

# CONTRIBUTING.md quotes this file.
TGA = '''
"""TGA: Truevision's format, 8 bits a channel."""

from glshade.image.formats import PictureFormat


class Tga(PictureFormat):
    """Truevision TGA, whose description holds 323 characters."""

    description_size = 323
'''
# A format that OpenImageIO does not know.
NPY = """
import numpy as np
from glshade.image.contents import PictureContents
from glshade.image.formats import PictureFormat


class Npy(PictureFormat):
    floats = True
    metadata = "nowhere"

    def write(self, path, contents):
        with open(path, "wb") as file:
            np.save(file, contents.pixels)

    def read(self, path):
        return PictureContents(np.load(path), encoding="linear", premultiplied=True)
"""
SCENE = """
film = { size = [8, 6], background = [0.2, 0.4, 0.6, 0.5] }
objects = [ { shape = "sphere" } ]
"""


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A folder with a copy of the package and its shaders, the two new formats in it, and a scene."""
    shutil.copytree(Path(package.__file__).parent, tmp_path / "glshade", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(Path(shaders.__file__).parent.parent.parent / "shaders", tmp_path / "shaders")
    (tmp_path / "glshade/image/formats/tga.py").write_text(TGA)
    (tmp_path / "glshade/image/formats/npy.py").write_text(NPY)
    (tmp_path / "s.toml").write_text(SCENE)
    return tmp_path


WRITTEN_AND_READ = """
import json
import numpy as np
from glshade.image import Image
from glshade.image.file import attributes, read
codes = np.arange(5 * 4 * 4, dtype=np.uint8).reshape(5, 4, 4)
Image(codes, "srgb").save("x.tga")
pixels, has_alpha = read("x.tga", "linear")
assert has_alpha
assert np.array_equal(np.rint(pixels * 255), codes)
for size in (1, 64, 252, 253, 300):
    texts = {"digest": "0123" * 12, "note": "n" * size}
    Image(codes, "srgb", texts).save("x.tga")
    # {"digest":"...","note":"..."} is 71 characters longer than the note.
    assert len(json.dumps(texts, separators=(",", ":"))) == 71 + size
    if 71 + size > 323:
        del texts["note"]
    assert attributes("x.tga") == texts, size
floats = np.random.default_rng(0).random((5, 4, 3)).astype(np.float32)
Image(floats).save("x.npy")
assert np.array_equal(read("x.npy")[0][..., :3], floats)
print("the same")
"""


def test_a_new_format_is_written_and_read(copied: Path, python: Any) -> None:
    assert python(WRITTEN_AND_READ, cwd=copied, PYTHONPATH=str(copied)) == "the same"


@pytest.mark.parametrize("samples", [1, 4])
def test_the_command_line_offers_a_new_format_and_resume_knows_its_pictures(samples: int, copied: Path, glshade: Any) -> None:
    def run(*arguments: str) -> Any:
        return glshade("render", *arguments, cwd=copied, PYTHONPATH=str(copied))

    assert ".tga" in run("s.toml", "-o", "x.xyz").stderr
    assert "tga" in run("--help").stdout
    command = ("s.toml", "-o", "x.tga", "--samples", str(samples), "--resume")
    first = run(*command)
    assert (first.stdout, first.returncode) == ("x.tga\n", 0), first.stderr
    again = run(*command)
    assert (again.stdout, again.returncode) == ("", 0), again.stderr
    # The file has no room for layers, so they go to a second file.
    assert run("s.toml", "-o", "y.tga", "--aov", "depth").returncode == 0
    assert (copied / "y.aovs.exr").exists()


def test_a_format_is_imported_when_it_is_needed(python: Any) -> None:
    code = """
import sys
from glshade.image.file import SUFFIXES, format_of
loaded = lambda: sorted(name for name in sys.modules if name.startswith(("glshade.image.formats.", "OpenImageIO", "numpy")))
assert ".exr" in SUFFIXES and loaded() == [], loaded()
format_of("x.png")
print(*loaded())
"""
    assert python(code) == "glshade.image.formats.png"


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_a_format_is_a_class_named_after_its_suffix(name: str) -> None:
    assert issubclass(FORMATS[name], PictureFormat)
    assert isinstance(format_of(f"folder.1/x.{name.upper()}"), FORMATS[name])


@pytest.mark.parametrize("name", ["x.xyz", "x", ".png"])
def test_other_suffixes_have_no_format(name: str) -> None:
    with pytest.raises(GlshadeError, match="cannot write"):
        format_of(name)


def test_half_a_description_says_nothing(tmp_path: Path) -> None:
    """A program may have shortened the description, or written its own."""
    import OpenImageIO as oiio

    from glshade.image.file import attributes

    for description in ('{"glshade:digest":"01', "a holiday", "[1]", "3"):
        spec = oiio.ImageSpec(1, 1, 3, "uint8")
        spec.attribute("ImageDescription", description)
        output = oiio.ImageOutput.create(str(tmp_path / "x.tif"))
        output.open(str(tmp_path / "x.tif"), spec)
        output.write_image(np.zeros((1, 1, 3), dtype=np.uint8))
        output.close()
        assert attributes(tmp_path / "x.tif") == {}
