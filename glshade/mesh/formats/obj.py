"""OBJ: the Wavefront format with its MTL files.

The text is rewritten line by line in a strict form, which trimesh then parses.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from glshade.arrays import Float64
from glshade.limits import MOST_LIBRARIES
from glshade.mesh.reading import mtl
from glshade.mesh.reading.colours import srgb_to_linear, with_alpha
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.file import OUTSIDE, MeshFile, is_file, short, text_of
from glshade.mesh.reading.parser import parse, triangles
from glshade.mesh.reading.polygon import triangulated


@dataclass
class _Faces:
    """The triangles with one object name, one material and one form of corner (v, v/vt, v//vn or v/vt/vn).

    lines: the corners of each triangle, as text.
    numbers: the number of the line in the file from which each triangle comes, for messages.
    """

    lines: list[str] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)


# The number of "/" and the number of "//" in three corners -> the form of the corners.
_FORMS = {(0, 0): "v", (3, 0): "v/vt", (6, 3): "v//vn", (6, 0): "v/vt/vn"}


def read(file: MeshFile) -> None:
    """Adds a part for each object, material and form of corner in an OBJ file. Errors: AssetError."""
    text = text_of(file.data).replace("\\\n", " ")
    attributes: dict[str, list[str]] = {"v": [], "vt": [], "vn": []}
    groups: dict[tuple[str, str | None, str], _Faces] = {}
    libraries: list[str] = []
    name, material = "", None
    for number, line in enumerate(text.split("\n"), 1):
        word, _, rest = line.strip().replace("\t", " ").partition(" ")
        if word in attributes:
            attributes[word].append(rest.partition("#")[0])
        elif word == "f":
            for form, corners in _corners(file, number, rest.partition("#")[0].strip(), attributes):
                faces = groups.setdefault((name, material, form), _Faces())
                faces.lines.append(corners)
                faces.numbers.append(number)
        elif word == "usemtl":
            material = rest.strip()
        elif word == "o":
            name = rest.strip()
        elif word == "mtllib":
            libraries.append(rest.strip())
    if not attributes["v"]:
        raise file.fail("holds no vertices" if groups else "holds no vertices: not an OBJ file?")
    if not groups:
        raise file.fail("holds only points, no triangles")
    groups = _in_range(file, attributes, groups)

    # trimesh gets triangles, absolute indices, and one form of corner in each object, because its parser counts negative
    # indices from the end of the file and assumes that all faces of an object have the form of the first.
    strict = [f"{key} {line}" for key, lines in attributes.items() for line in lines]
    for index, faces in enumerate(groups.values()):
        strict.append(f"o {index}")
        strict += [f"f {line}" for line in faces.lines]
    options = {"skip_materials": True, "group_material": False, "split_objects": True}
    geometries = parse("obj", "\n".join(strict).encode(), **options)["geometry"]
    materials = _materials_of(file, libraries) if any(key[1] for key in groups) else {}

    several_materials = len({key[:2] for key in groups}) > len({key[0] for key in groups})
    for index, (name, material, form) in enumerate(groups):
        geometry = geometries[str(index)]
        title = name or (material if several_materials else "") or file.path.stem
        if name and several_materials and material:
            title = f"{name}.{material}"
        colours = None
        if geometry.get("vertex_colors") is not None:
            raw = np.asarray(geometry["vertex_colors"], dtype=np.float64)
            raw = raw / 255 if raw.max() > 1 else raw
            colours = with_alpha(srgb_to_linear(raw))  # programs write sRGB-encoded bytes here, or those divided by 255
        if material and materials and material not in materials:
            file.warn(f"material '{material}' is in no material file; drawn without it")
        mesh = file.build(
            "",
            geometry["vertices"],
            triangles(geometry["faces"]),
            normals=geometry.get("vertex_normals") if "vn" in form else None,
            uvs=geometry["visual"].uv if "vt" in form else None,
            colours=colours,
        )
        file.contents.add(title, mesh, materials.get(material) if material else None)


def _corners(file: MeshFile, number: int, corners: str, attributes: dict[str, list[str]]) -> Iterator[tuple[str, str]]:
    """Yields the form and the corners of each triangle of a face, with indices counted from the start of the file.

    number: the number of the line, for messages.
    corners: the text of the line without its first word.
    attributes: the lines "v", "vt" and "vn" that were read so far, by their first word.

    Errors: AssetError.
    """
    if corners.count(" ") == 2 and "-" not in corners and "/ " not in corners and corners[-1] != "/":
        form = _FORMS.get((corners.count("/"), corners.count("//")))
        if form is not None:
            yield form, corners
            return
    tokens = corners.split()
    if len(tokens) < 3:
        raise file.fail(f"line {number}: a face needs three corners: 'f {corners}'")
    counts = [len(attributes[key]) for key in ("v", "vt", "vn")]
    resolved = []
    for token in tokens:
        try:
            given = [int(part) if part else 0 for part in token.split("/")]
        except ValueError:
            raise file.fail(f"line {number}: '{token}' is not a corner of a face") from None
        given = [index + count + 1 if index < 0 else index for index, count in zip(given, counts, strict=False)]
        if min(given) < 0 or given[0] == 0:
            raise file.fail(f"line {number}: face index out of range in '{token}'")
        resolved.append([*given, 0, 0][:3])
    has_uv, has_normal = all(r[1] for r in resolved), all(r[2] for r in resolved)
    form = "v/vt/vn" if has_uv and has_normal else "v/vt" if has_uv else "v//vn" if has_normal else "v"
    written = {
        "v": "{0}",
        "v/vt": "{0}/{1}",
        "v//vn": "{0}//{2}",
        "v/vt/vn": "{0}/{1}/{2}",
    }[form]
    texts = [written.format(*r) for r in resolved]
    order = [(0, 1, 2)]
    if len(tokens) > 3:
        outline: Float64 | None = None
        if max(r[0] for r in resolved) <= counts[0]:
            outline = np.array([attributes["v"][r[0] - 1].split()[:3] for r in resolved], dtype=np.float64)
        order = triangulated(outline) if outline is not None else [(0, k, k + 1) for k in range(1, len(tokens) - 1)]
    for a, b, c in order:
        yield form, f"{texts[a]} {texts[b]} {texts[c]}"


def _in_range(
    file: MeshFile, attributes: dict[str, list[str]], groups: dict[tuple[str, str | None, str], _Faces]
) -> dict[tuple[str, str | None, str], _Faces]:
    """Returns the groups. References to uvs or normals that the file does not hold are removed, with a warning for the group.

    Errors: AssetError, with the number of the line, for a vertex that the file does not hold.
    """
    result: dict[tuple[str, str | None, str], _Faces] = {}
    for (name, material, form), faces in groups.items():
        kinds = [kind for kind in form.split("/") if kind]
        try:
            flat = np.fromstring(" ".join(faces.lines).replace("/", " "), dtype=np.int64, sep=" ")
            table = flat.reshape(len(faces.lines), 3, len(kinds))
        except ValueError:
            numbered = zip(faces.numbers, faces.lines, strict=True)
            number, line = next((n, x) for n, x in numbered if not re.fullmatch(r"[\d/ ]+", x))
            raise file.fail(f"line {number}: 'f {line}' is not a face") from None
        for column, kind in enumerate(kinds):
            indices = table[:, :, column]
            wrong = ((indices < 1) | (indices > len(attributes[kind]))).any(axis=1)
            if not wrong.any():
                continue
            first = int(wrong.argmax())
            message = f"line {faces.numbers[first]}: '{kind}' index out of range: the file has {len(attributes[kind])}"
            if kind == "v":
                raise file.fail(message)
            file.warn(f"{message}; drawn without {'texture coordinates' if kind == 'vt' else 'normals'} there")
            form = {"v/vt": "v", "v//vn": "v", "v/vt/vn": "v//vn" if kind == "vt" else "v/vt"}[form]
        if form == "/".join(kinds) or (form == "v//vn" and kinds == ["v", "vn"]):
            lines = faces.lines
        else:
            left = [kinds.index(kind) for kind in form.split("/") if kind]
            glue = "//" if form == "v//vn" else "/"
            lines = [" ".join(glue.join(str(corner[k]) for k in left) for corner in row) for row in table.tolist()]
        merged = result.setdefault((name, material, form), _Faces())
        merged.lines += lines
        merged.numbers += faces.numbers
    return result


def _materials_of(file: MeshFile, libraries: list[str]) -> dict[str, Material]:
    """Returns the materials by name. libraries: the text of each "mtllib" line without its first word."""
    materials: dict[str, Material] = {}
    seen: set[Path] = set()
    for line in libraries:
        # The whole line may be one name with spaces, or several names.
        names = [line] if is_file(file.beside(line)) else line.split()
        for name in names:
            path = file.beside(name)
            if path in seen:
                continue
            seen.add(path)
            if len(seen) > MOST_LIBRARIES:
                raise file.fail(f"names more than {MOST_LIBRARIES} material files")
            data = None if (outside := file.is_outside(path)) else file.read(path)
            if data is None:
                file.warn(f"material file '{short(name)}' {OUTSIDE if outside else 'not found'}; drawn without its materials")
            else:
                materials = mtl.materials(file, text_of(data)) | materials
    return materials
