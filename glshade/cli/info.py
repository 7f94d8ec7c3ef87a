"""Command `glshade info`: says what mesh, picture and scene files hold, and what is not drawn as they say."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from glshade.cli._options import joint, limits
from glshade.errors import AssetError, GlshadeError, printable
from glshade.limits import Limits

# The most parts, materials or pictures' layers that get a row of their own; --json lists all.
MOST_ROWS = 12
# The exit code where a file cannot be used (docs/exit-codes.md).
UNUSABLE = 3


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Prints all facts as one JSON list.")
@joint
@limits
def command(files: tuple[Path, ...], as_json: bool, joints: list[tuple[str, str]], limits: Limits) -> None:
    """Says what each FILE holds: a mesh file, a picture or a scene file.

    For a mesh file: its parts, size, unit, closedness, winding, materials, textures, lights and cameras, and a note on all that
    is not drawn as the file says. Nothing is drawn. A file that cannot be used does not stop the others; the exit code is then
    3.
    """
    from glshade.cli import _table

    facts: list[dict[str, Any]] = []
    for path in files:
        try:
            facts.append(information(path, limits, joints))
        except GlshadeError as error:
            lines = getattr(error, "problems", ()) or str(error).splitlines()
            facts.append({"file": str(path), "error": "\n".join(map(str, lines))})
            for line in lines:
                click.echo(f"glshade: {printable(str(line))}", err=True)
        except OSError as error:
            facts.append({"file": str(path), "error": f"cannot be read: {error.strerror}"})
            click.echo(f"glshade: {printable(str(path))}: cannot be read: {error.strerror}", err=True)
    if as_json:
        _table.as_json(facts)
    else:
        good = [table for table in facts if "error" not in table]
        for number, table in enumerate(good):
            if number:
                click.echo()
            _table.title(printable(table["file"]))
            _table.table(("fact", "value"), [(name, printable(text)) for name, text in rows(table)])
    if any("error" in table for table in facts):
        raise SystemExit(UNUSABLE)


def information(path: Path, limits: Limits, joints: Sequence[tuple[str, str]] = ()) -> dict[str, Any]:
    """Returns the facts about a file, as a table that can be written as JSON.

    joints: overrides that set the joints of a robot.
    Errors: GlshadeError, OSError.
    """
    from glshade.mesh.formats import SUFFIXES

    suffix = path.suffix.lower()
    if path.is_dir():
        raise AssetError(f"{path}: is a folder, not a file")
    if suffix in SUFFIXES:
        from glshade.mesh.information import mesh_information

        return mesh_information(path, limits)
    from glshade.scene.file import TEXT_SUFFIXES

    if suffix == ".urdf":
        return robot_information(path, limits, joints)
    if joints:
        raise AssetError(f"{path}: --joint is for robots (.urdf files); this file has no joints")
    if suffix in TEXT_SUFFIXES:
        return scene_information(path, limits)
    if not path.exists():
        raise AssetError(f"{path}: no such file")
    from glshade.image.information import picture_information

    return picture_information(path)


def robot_information(path: Path, limits: Limits, joints: Sequence[tuple[str, str]]) -> dict[str, Any]:
    """Returns the facts about a robot at values of its joints. Errors: SceneError, MissingLibrary."""
    from dataclasses import asdict

    from glshade.scene.joints import split
    from glshade.scene.robot import Robot

    facts = scene_information(path, limits, joints)
    states = [asdict(state) for state in Robot(path, split(joints, path)[0], limits).joints]
    # JSON has no infinite numbers.
    states = [{key: None if value in (math.inf, -math.inf) else value for key, value in state.items()} for state in states]
    return {**facts, "kind": "robot", "joints": states}


def scene_information(path: Path, limits: Limits, overrides: Sequence[tuple[str, str]] = ()) -> dict[str, Any]:
    """Returns the facts about a scene file. Errors: SceneError."""
    from glshade.scene.file import SceneFile

    scene = SceneFile(path, overrides, limits).scene()
    return {
        "file": str(path),
        "kind": "scene",
        "description": scene.description,
        "size": list(scene.film.size),
        "objects": len(scene.objects),
        "meshes": sorted({str(item.mesh) for item in scene.objects if isinstance(item.mesh, Path)}),
        "materials": list(scene.materials),
        "lights": None if scene.lights is None else [light.type for light in scene.lights],
        "camera": scene.camera.type,
        "cameras": list(scene.cameras),
        "tracks": len(scene.animation),
    }


def rows(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yields (name, text) of each row of a file's table."""
    kinds = {"mesh": _mesh_rows, "picture": _picture_rows, "scene": _scene_rows, "robot": _robot_rows}
    yield from ((name, text) for name, text in kinds[facts["kind"]](facts) if text)


def _mesh_rows(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    parts = facts["parts"]
    low, high = facts["bounds"]
    unit = facts["unit"]
    yield "format", f"{facts['format']}, {facts['bytes']:,} bytes"
    yield (
        "holds",
        ", ".join(_counted(facts[name], name) for name in ("triangles", "lines", "points", "vertices") if facts[name]),
    )
    yield "lowest corner", _numbers(low)
    yield "highest corner", _numbers(high)
    guess = " (a guess: the format has no unit)" if unit["guess"] else ""
    yield "size", f"{_numbers([b - a for a, b in zip(low, high, strict=True)], ' x ')} {unit['name']}s{guess}"
    if facts["closed"] is not None:
        opened = "closed" if facts["closed"] else f"open, with {_counted(facts['open_edges'], 'open edges')}"
        yield "surface", f"{opened}; winding: {facts['winding']}"
    for name in ("normals", "uvs", "colours", "tangents"):
        having = sum(part[name] for part in parts)
        yield name, "all parts" if having == len(parts) else f"{having} of {len(parts)} parts" if having else "none"
    yield from _some("part", [_part_text(part) for part in parts])
    yield from _some("material", [_material_text(material) for material in facts["materials"]])
    yield "extensions", ", ".join(f"{name}{' (required)' if needed else ''}" for name, needed in facts["extensions"].items())
    yield "lights", f"{', '.join(facts['lights'])} (drawn with --file-lights)" if facts["lights"] else ""
    yield "cameras", f"{', '.join(facts['cameras'])} (drawn with --camera NAME)" if facts["cameras"] else ""
    yield from _some("note", facts["warnings"] or ["none"])


def _part_text(part: Mapping[str, Any]) -> str:
    """Returns the name of a part, and the numbers of the things that it is made of."""
    return f"{part['name']}: " + ", ".join(_counted(part[n], n) for n in ("triangles", "lines", "points") if part[n])


def _material_text(material: Mapping[str, Any]) -> str:
    """Returns the model of a material, the number of its parts, and its textures with their sizes."""
    text = f"{material['brdf']}, on {_counted(material['parts'], 'parts')}"
    for texture in material["textures"]:
        size = "x".join(map(str, texture["size"])) if texture["size"] else "unreadable"
        text += f"; {texture['key']} = {texture['file']} {size}"
    return text


def _picture_rows(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "format", f"{facts['format']}, {facts['bytes']:,} bytes"
    yield "size", "{} x {} pixels".format(*facts["size"])
    layers = [f"{part['name'] or 'picture'}: {' '.join(part['channels'])} ({part['numbers']})" for part in facts["parts"]]
    yield from _some("channels", layers)
    yield "colours", facts["encoding"]
    yield from facts["texts"].items()
    yield from facts["attributes"].items()


def _scene_rows(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "format", "scene file"
    yield "description", facts["description"]
    yield "size", "{} x {} pixels".format(*facts["size"])
    yield "objects", str(facts["objects"])
    yield from _some("mesh", facts["meshes"])
    yield "materials", ", ".join(facts["materials"])
    yield "lights", "the default lights" if facts["lights"] is None else ", ".join(facts["lights"]) or "none"
    yield "cameras", ", ".join([facts["camera"], *facts["cameras"]])
    yield "animation", _counted(facts["tracks"], "tracks") if facts["tracks"] else ""


def _robot_rows(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "format", "robot (URDF)"
    yield "description", facts["description"]
    yield "objects", str(facts["objects"])
    yield from _some("mesh", facts["meshes"])
    yield from _some("joint", [_joint_text(joint) for joint in facts["joints"]])


def _joint_text(joint: Mapping[str, Any]) -> str:
    """Returns the name, the type, the value and the limits of a joint."""
    text = f"{joint['name']}: {joint['kind']}"
    if joint["mimics"]:
        return f"{text}, {joint['value']:.6g}, follows {joint['mimics']}"
    if joint["kind"] not in ("revolute", "continuous", "prismatic"):
        return text
    limited = joint["low"] is not None
    return f"{text}, {joint['value']:.6g}" + (f", from {joint['low']:.6g} to {joint['high']:.6g}" if limited else "")


def _some(name: str, texts: list[str]) -> Iterator[tuple[str, str]]:
    """Yields a row for each of the first texts, and a last row with the number of those left out."""
    for number, text in enumerate(texts[:MOST_ROWS]):
        yield (name if number == 0 else ""), text
    if len(texts) > MOST_ROWS:
        yield "", f"and {len(texts) - MOST_ROWS:,} more (--json lists all)"


def _counted(number: int, noun: str) -> str:
    """Returns a number with its noun, which is given in the plural: "1 triangle", "12 vertices"."""
    singular = {"vertices": "vertex"}.get(noun, noun.removesuffix("s"))
    return f"{number:,} {singular if number == 1 else noun}"


def _numbers(values: list[float], between: str = " ") -> str:
    """Returns numbers with six digits."""
    return between.join(f"{value:.6g}" for value in values)
