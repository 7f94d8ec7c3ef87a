"""Information: the facts about a picture file that `glshade info` prints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from glshade.image.file import attributes, parts

# The prefix of the texts that glshade writes into its pictures.
OWN = "glshade:"


def picture_information(path: Path) -> dict[str, Any]:
    """Returns the facts about a picture file, from its header, as a table that can be written as JSON. Errors: AssetError."""
    found = parts(path)
    texts = attributes(path)
    return {
        "file": str(path),
        "kind": "picture",
        "format": path.suffix[1:].upper(),
        "bytes": path.stat().st_size,
        "size": list(found[0].whole),
        "parts": [
            {
                "name": part.name,
                "channels": list(part.channels),
                "size": list(part.size),
                "corner": list(part.corner),
                "numbers": "float" if part.floats else "8 bits",
            }
            for part in found
        ],
        "encoding": texts.get("oiio:ColorSpace") or ("linear" if found[0].floats else "sRGB"),
        "digest": texts.get(f"{OWN}digest"),
        "texts": {name: text for name, text in sorted(texts.items()) if name.startswith(OWN)},
        "attributes": {name: text for name, text in sorted(texts.items()) if not name.startswith(OWN)},
    }
