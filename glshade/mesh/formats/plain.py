"""Plain: STL and OFF, which hold triangles and nothing else that is read."""

from __future__ import annotations

from glshade.mesh.formats.file import File
from glshade.mesh.formats.parser import parse, triangles


def read(file: File) -> None:
    """STL and OFF. STL's normals belong to faces and follow from them; they are not read."""
    parsed = parse(file.path.suffix[1:].lower(), file.data)
    geometries = parsed.get("geometry") or {file.path.stem: parsed}
    for name, geometry in geometries.items():
        if len(geometry.get("vertices", ())) and not len(geometry.get("faces", ())):
            raise file.fail("holds only points, no triangles")
        if len(geometry.get("faces", ())):
            mesh = file.build("", geometry["vertices"], triangles(geometry["faces"]))
            file.contents.add(name or file.path.stem, mesh)
