"""Chunks of PNG files: damage is found before the library that decodes the pixels sees the file."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade import Image
from glshade.image.chunks import SIGNATURE, check_chunks


@pytest.fixture(scope="module")
def png(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The bytes of a PNG file with noise."""
    path = tmp_path_factory.mktemp("png") / "a.png"
    Image(np.random.default_rng(0).integers(0, 256, (9, 9, 3)).astype(np.uint8)).save(path)
    return path.read_bytes()


def test_whole_files_pass(png: bytes) -> None:
    check_chunks(png)
    check_chunks(png + b"more than the picture")
    check_chunks(png[:-5])
    check_chunks(b"\xff\xd8 is no PNG file")


@given(share=st.floats(0, 1, exclude_max=True))
def test_every_file_that_ends_within_its_pixels_is_refused(png: bytes, share: float) -> None:
    # Behind the pixels lies the chunk IEND, of 12 bytes. A file without it can be decoded.
    end = len(SIGNATURE) + int(share * (len(png) - 12 - len(SIGNATURE)))
    with pytest.raises(OSError, match="is a truncated PNG file"):
        check_chunks(png[:end])


def test_files_that_end_between_two_chunks_of_pixels_are_refused() -> None:
    """Pixels may lie in several chunks, and a file may be cut just behind one of them."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return len(data).to_bytes(4, "big") + name + data + zlib.crc32(name + data).to_bytes(4, "big")

    packed = zlib.compress(bytes(range(256)))
    begin = SIGNATURE + chunk(b"IHDR", bytes(13))
    half, rest = chunk(b"IDAT", packed[:99]), chunk(b"IDAT", packed[99:])
    check_chunks(begin + half + rest)
    for end in range(len(rest)):
        with pytest.raises(OSError, match="is a truncated PNG file"):
            check_chunks(begin + half + rest[:end])


@given(data=st.data())
def test_a_changed_pixel_is_found(png: bytes, data: st.DataObject) -> None:
    start = png.index(b"IDAT") + 4
    size = int.from_bytes(png[start - 8 : start - 4], "big")
    at = start + data.draw(st.integers(0, size - 1))
    changed = png[:at] + bytes([png[at] ^ (1 << data.draw(st.integers(0, 7)))]) + png[at + 1 :]
    with pytest.raises(OSError, match="a checksum is wrong"):
        check_chunks(changed)


def test_a_damaged_text_does_not_matter(png: bytes) -> None:
    """A chunk whose name begins with a small letter may be left out."""
    at = png.index(b"tEXt") + 6
    check_chunks(png[:at] + bytes([png[at] ^ 1]) + png[at + 1 :])


def test_the_command_says_it_in_its_own_words(png: bytes, tmp_path: Path, glshade: object) -> None:
    """A mesh whose picture is broken is drawn without it, and the library's own message does not appear."""
    (tmp_path / "a.png").write_bytes(png[: len(png) // 2])
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 0.5 0\nmap_Kd a.png\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
    )
    done = glshade("render", tmp_path / "a.obj", "-o", tmp_path / "out.png", cwd=tmp_path)  # type: ignore[operator]
    assert done.returncode == 0, done.stderr
    assert "texture 'a.png' cannot be read as a picture: is a truncated PNG file; drawn without it" in done.stderr
    assert "libpng" not in done.stderr
