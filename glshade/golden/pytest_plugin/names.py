"""Names: the name of a test's baseline, made from the test's node id."""

from __future__ import annotations

import hashlib
import re

# Every other character is replaced: some mean something to a shell, to a pattern of `glshade approve --only` or to Windows, and
# "@" marks the variants of a baseline.
_UNSAFE = re.compile(r"[^A-Za-z0-9_.+=-]")
# A file name may have 255 bytes on most file systems; the suffix, a variant's key and the sidecar's suffix are added to it.
LONGEST = 120


def default_name(node_id: str) -> str:
    """Returns the name of the baseline of a test, a relative path without a suffix.

    The folder is the path of the test's file without `.py`. The file is named after the test: classes and function joined by
    dots, then a hyphen and the parameters. `tests/test_ball.py::TestRed::test_far[small-2]` gives
    `tests/test_ball/TestRed.test_far-small-2`. In a part of the path with an unsafe character, the character becomes `_`. Such
    a part and one that is too long get a hyphen and eight digits of the node id's SHA-256 at the end, so that different tests
    have different names.
    """
    module, _, test = node_id.partition("::")
    function, bracket, parameters = test.partition("[")
    last = function.replace("::", ".") + (f"-{parameters.removesuffix(']')}" if bracket else "")
    parts = [part for part in module.removesuffix(".py").split("/") if part] + [last]
    digits = hashlib.sha256(node_id.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return "/".join(_safe(part, digits) for part in parts)


def _safe(part: str, digits: str) -> str:
    """Returns a part of a path with safe characters only, followed by the digits where that has changed the part.

    A part that starts with a dot is changed, too: it is a hidden file, or the folder above.
    """
    safe = _UNSAFE.sub("_", part)[:LONGEST]
    safe = f"_{safe[1:]}" if safe.startswith(".") else safe
    return part if safe == part else f"{safe}-{digits}"
