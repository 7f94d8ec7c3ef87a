"""Chunks: finds damage in a PNG file before libpng does, which would print its own message to standard error."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from contextlib import suppress

SIGNATURE = b"\x89PNG\r\n\x1a\n"
# The number of bytes that are unpacked at once [bytes].
MOST_UNPACKED = 1 << 20


def check_chunks(data: bytes) -> None:
    """Checks that the chunks of a PNG file are whole, up to the end of its pixels. Other files pass.

    Source: W3C, Portable Network Graphics, third edition, section 5.
    Errors: OSError, with the reason as its text.
    """
    if not data.startswith(SIGNATURE):
        return
    at, pixels = len(SIGNATURE), list[bytes]()
    while at + 8 <= len(data):
        size, name = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        end = at + 12 + size
        if pixels and name != b"IDAT":
            return
        if end > len(data):
            raise OSError("is a truncated PNG file")
        # The name of a chunk that is needed to show the picture begins with a capital letter.
        if name[:1].isupper() and zlib.crc32(data[at + 4 : end - 4]) != int.from_bytes(data[end - 4 : end], "big"):
            raise OSError("is a damaged PNG file: a checksum is wrong")
        if name == b"IDAT":
            pixels.append(data[at + 8 : end - 4])
        at = end
    # The file ends between two chunks.
    if not _is_complete(pixels):
        raise OSError("is a truncated PNG file")


def _is_complete(pixels: Iterable[bytes]) -> bool:
    """Returns whether the contents of consecutive IDAT chunks hold compressed data to its end."""
    unpacker = zlib.decompressobj()
    with suppress(zlib.error):
        for packed in pixels:
            while packed and not unpacker.eof:
                unpacker.decompress(packed, MOST_UNPACKED)
                packed = unpacker.unconsumed_tail
    return unpacker.eof
