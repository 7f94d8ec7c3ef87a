"""No damaged mesh file ends in a traceback, a hang, or memory beyond 100 MB or 10 times the decoded arrays.

Of three inputs, two are truncations of a file and one is a file with a few changed bytes, or with another value in its JSON.
The files are small ones of all formats, which the proof writes. Each input is loaded and drawn at 16 x 16 pixels in a child
process; it must give a picture, or one line that names the file.
"""

from __future__ import annotations

import base64
import io
import json
import math
import random
import struct
import sys
import traceback
import warnings
import zipfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from support.child import Child, forget_peak, peak, serve

# 4,000 truncations and 2,000 mutations.
COUNT = 6000
# The time of one input [s], which a busy machine may take, and the size of the data at which its process gets a MemoryError
# [bytes]. The driver alone reserves more than 4 GB of it, most of which is never used.
SECONDS, MEMORY = 60, 8 << 30
# The memory that an input may take beyond that of a triangle [bytes], or else this many times the bytes of its arrays.
EXTRA, TIMES = 100 << 20, 10
# The most bytes of a file that a mutation changes.
CHANGED = 8
PROCESSES = 2
# The values that replace one of a glTF file: numbers at limits, wrong types, and constants of the format in wrong places.
VALUES: tuple[Any, ...] = (
    -1,
    0,
    1,
    2,
    3,
    0.5,
    1e300,
    2**31,
    2**64,
    10**400,
    "x",
    "",
    "VEC3",
    None,
    True,
    [],
    {},
    [1, 2],
    5120,
    5126,
)
# The number of columns and rows of the grid that most of the files hold.
SIDE = 8


def prove(count: int, seed: int) -> int:
    """Tries `count` inputs, prints those that break the claim, and returns their number."""
    originals = sorted(files().items())
    outcomes: Counter[str] = Counter()
    broken = 0
    with TemporaryDirectory() as name, ThreadPoolExecutor(PROCESSES) as threads:

        def share(first: int) -> list[tuple[int, str, dict[str, Any]]]:
            child = Child([sys.executable, "-m", "proofs.meshes"], SECONDS, MEMORY)
            answers = []
            try:
                for index in range(first, count, PROCESSES):
                    title, data = damaged(originals, seed, index)
                    path = Path(name) / f"{first}-{title}"
                    path.write_bytes(data)
                    answers.append((index, title, child.ask({"path": str(path)})))
            finally:
                child.close()
            return answers

        for found in threads.map(share, range(min(PROCESSES, count))):
            for index, title, answer in found:
                outcomes[answer["outcome"]] += 1
                if answer["outcome"] not in ("drawn", "refused"):
                    broken += 1
                    print(f"input {index} of seed {seed}, {title}: {answer['outcome']}: {answer['words']}", flush=True)
    print(", ".join(f"{number} {outcome}" for outcome, number in sorted(outcomes.items())))
    return broken


def damaged(originals: list[tuple[str, bytes]], seed: int, index: int) -> tuple[str, bytes]:
    """Returns the name and the bytes of an input."""
    chance = random.Random(f"{seed} {index}")
    title, data = chance.choice(originals)
    if index % 3:
        return title, data[: chance.randrange(len(data))]
    if title == "a.gltf" and chance.random() < 0.5:
        return title, _with_other_value(json.loads(data), chance)
    changed = bytearray(data)
    for _ in range(chance.randint(1, CHANGED)):
        at = chance.randrange(len(changed))
        # Text is damaged by other digits and signs as well as by any byte.
        changed[at] = chance.choice([chance.randrange(256), ord(chance.choice('0123456789-./e \n"[]{}<>'))])
    return title, bytes(changed)


def _with_other_value(header: dict[str, Any], chance: random.Random) -> bytes:
    """Returns a glTF file in which one value is replaced by another. Changed bytes rarely leave the JSON readable."""
    places: list[tuple[Any, Any]] = []
    nodes: list[Any] = [header]
    while nodes:
        node = nodes.pop()
        keys = list(node) if isinstance(node, dict) else range(len(node))
        places += [(node, key) for key in keys]
        nodes += [node[key] for key in keys if isinstance(node[key], dict | list)]
    node, key = chance.choice(places)
    node[key] = chance.choice(VALUES)
    return json.dumps(header).encode()


def files() -> dict[str, bytes]:
    """Returns name -> bytes of a small file of each kind."""
    x, y = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE))
    points = np.stack([x, y, 0.1 * np.sin(7 * x)], axis=-1).reshape(-1, 3).astype(np.float32)
    first = (np.arange(SIDE - 1) + SIDE * np.arange(SIDE - 1)[:, None]).ravel()
    quads = np.stack([first, first + 1, first + SIDE + 1, first + SIDE], axis=-1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.uint32)
    gltf, buffer = _gltf(points, triangles)
    embedded = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    text = "".join(f"v {a:.5f} {b:.5f} {c:.5f}\n" for a, b, c in points)
    faces = "".join("f " + " ".join(str(i + 1) for i in quad) + "\n" for quad in quads)
    rows = "".join(f"{a:.5f} {b:.5f} {c:.5f}\n" for a, b, c in points)
    listed = "".join("4 " + " ".join(map(str, quad)) + "\n" for quad in quads)
    return {
        "a.obj": f"mtllib none.mtl\no grid\n{text}vt 0 0\nvn 0 0 1\ns 1\nusemtl red\n{faces}f 1/1/1 2/1/1 3/1/1\n".encode(),
        "ascii.ply": _ply_header("ascii", len(points), len(quads)) + (rows + listed).encode(),
        "binary.ply": _ply_header("binary_little_endian", len(points), len(quads))
        + points.astype("<f4").tobytes()
        + b"".join(struct.pack("<B4i", 4, *quad) for quad in quads),
        "a.off": f"OFF\n{len(points)} {len(quads)} 0\n{rows}{listed}".encode(),
        "ascii.stl": _ascii_stl(points[triangles]),
        "binary.stl": bytes(80)
        + struct.pack("<I", len(triangles))
        + b"".join(struct.pack("<12fH", 0, 0, 1, *corners.ravel(), 0) for corners in points[triangles]),
        "a.gltf": json.dumps({**gltf, "buffers": [{"byteLength": len(buffer), "uri": embedded}]}).encode(),
        "a.glb": _glb({**gltf, "buffers": [{"byteLength": len(buffer)}]}, buffer),
        "a.dae": _dae(points, triangles),
        "a.3mf": _3mf(points, triangles),
    }


def _ply_header(form: str, vertices: int, faces: int) -> bytes:
    return (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()


def _ascii_stl(corners: Any) -> bytes:
    facets = (
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {a:.5f} {b:.5f} {c:.5f}\n" for a, b, c in triangle)
        + "endloop\nendfacet\n"
        for triangle in corners
    )
    return f"solid grid\n{''.join(facets)}endsolid grid\n".encode()


def _gltf(points: Any, triangles: Any) -> tuple[dict[str, Any], bytes]:
    """Returns the JSON without its buffers, and the bytes of the only buffer."""
    buffer = points.astype("<f4").tobytes() + triangles.astype("<u4").tobytes()
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1], "translation": [1, 2, 3]}, {"mesh": 0, "rotation": [0, 0, 0, 1]}],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.2, 1], "roughnessFactor": 0.5}, "alphaMode": "MASK"}
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "bufferViews": [
            {"buffer": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": triangles.nbytes},
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(points),
                "type": "VEC3",
                "min": points.min(axis=0).tolist(),
                "max": points.max(axis=0).tolist(),
            },
            {"bufferView": 1, "componentType": 5125, "count": triangles.size, "type": "SCALAR"},
        ],
    }
    return header, buffer


def _glb(header: dict[str, Any], buffer: bytes) -> bytes:
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _dae(points: Any, triangles: Any) -> bytes:
    numbers = " ".join(f"{value:.5f}" for value in points.ravel())
    corners = " ".join(map(str, triangles.ravel()))
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="{points.size}">{numbers}</float_array><technique_common>
<accessor source="#a" count="{len(points)}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(triangles)}"><input semantic="VERTEX" source="#v" offset="0"/><p>{corners}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>""".encode()


def _3mf(points: Any, triangles: Any) -> bytes:
    vertices = "".join(f'<vertex x="{a:.5f}" y="{b:.5f}" z="{c:.5f}"/>' for a, b, c in points)
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in triangles)
    model = f"""<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources><object id="1" type="model"><mesh><vertices>{vertices}</vertices><triangles>{faces}</triangles></mesh></object>
</resources><build><item objectid="1"/></build></model>"""
    relation = (
        '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        '<Relationship Target="/3D/3dmodel.model" Id="r" '
        'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
    )
    archive = io.BytesIO()
    # Nothing is compressed, so that damage reaches the XML behind the archive's checksums as well.
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as packed:
        packed.writestr("_rels/.rels", relation)
        packed.writestr("3D/3dmodel.model", model)
    return archive.getvalue()


def answer(path: Path, renderer: Any, triangle: int) -> dict[str, Any]:
    """Loads and draws a file, and returns the outcome and its words. triangle: the memory that a triangle takes [bytes]."""
    import glshade
    from glshade.mesh.file import load

    before = forget_peak()
    arrays = 0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            scene = glshade.load(path)
            arrays = load(path).nbytes
            film = scene.film.model_copy(update={"size": (16, 16)})
            pixels = renderer.render(scene.model_copy(update={"film": film}), dtype="float32").pixels
            finite = bool(np.isfinite(pixels).all())
            result = {"outcome": "drawn" if finite else "not finite", "words": ""}
        except glshade.GlshadeError as error:
            lines = str(error).splitlines()
            clear = len(lines) == 1 and lines[0].startswith(str(path)) and lines[0].isprintable()
            result = {"outcome": "refused" if clear and "do not fit together" not in lines[0] else "unclear", "words": lines}
        except Exception:
            result = {"outcome": "traceback", "words": traceback.format_exc(limit=-6)}
    leaked = [str(w.message) for w in caught if not issubclass(w.category, UserWarning)]
    if leaked and result["outcome"] in ("drawn", "refused"):
        result = {"outcome": "warning", "words": leaked[0]}
    used = peak() - before
    if used > triangle + max(EXTRA, TIMES * arrays):
        return {"outcome": "memory", "words": f"{used / 1e6:.0f} MB"}
    return result


def main() -> None:
    """Answers the questions of a child process, after it has drawn a triangle."""
    import glshade

    with TemporaryDirectory() as name, glshade.Renderer() as renderer:
        path = Path(name) / "triangle.obj"
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        before = forget_peak()
        assert answer(path, renderer, math.inf)["outcome"] == "drawn"  # type: ignore[arg-type]
        triangle = peak() - before
        serve(lambda question: answer(Path(question["path"]), renderer, triangle))


if __name__ == "__main__":
    main()
