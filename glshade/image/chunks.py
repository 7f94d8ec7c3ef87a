"""Chunks: finds damage in a PNG file before libpng does, which would print its own message to standard error."""

from __future__ import annotations

import zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def check_chunks(data: bytes) -> None:
    """Checks that the chunks of a PNG file are whole, up to the end of its pixels. Other files pass.

    Source: W3C, Portable Network Graphics, third edition, section 5.
    Errors: OSError, with the reason as its text.
    """
    if not data.startswith(SIGNATURE):
        return
    at, has_pixels = len(SIGNATURE), False
    while at < len(data):
        size, name = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        end = at + 12 + size
        if has_pixels and name != b"IDAT":
            return
        if end > len(data):
            raise OSError("is a truncated PNG file")
        # The name of a chunk that is needed to show the picture begins with a capital letter.
        if name[:1].isupper() and zlib.crc32(data[at + 4 : end - 4]) != int.from_bytes(data[end - 4 : end], "big"):
            raise OSError("is a damaged PNG file: a checksum is wrong")
        has_pixels |= name == b"IDAT"
        at = end
    if not has_pixels:
        raise OSError("is a truncated PNG file")
