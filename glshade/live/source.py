"""Source: the files that an object's shader program is made from, as JSON types."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from glshade.assembly.instance import Instance
from glshade.errors import SceneError
from glshade.glsl.generator import generate
from glshade.glsl.shaders import Shaders
from glshade.glsl.source import Stage
from glshade.radiance.readying import ready
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.spirv.surface import shading_stage, text_plan

Table = dict[str, Any]


def source_files(scene: Scene, number: int, shaders: Shaders, shading: Rate | None = None) -> tuple[str, list[Table]]:
    """Returns the name of an object, and a table for each file of its program: "file", "name" and "lines".

    The program is the one that is traced: it writes linear light, and no opacity. The file of the model comes first.
    number: the index of the object in the scene.
    shading: optional; replaces the shading rate of every object.
    Errors: SceneError where the object has no program; ShaderError.
    """
    assembly = ready(scene, shading)
    instance = next((instance for instance in assembly.instances if instance.number == number), None)
    if instance is None:
        raise SceneError(f"objects[{number}]: nothing of this object is drawn, so it has no program")
    source = generate(text_plan(instance, assembly), shaders)
    first, _ = shading_stage(source, instance.rate)
    files: dict[str, list[str]] = {}
    for stage in (first, *source.stages):
        for file in dict.fromkeys(file for file, _ in stage.lines):
            if file not in files:
                files[file] = list(shaders.lines(file)) or _generated(stage, file)
    model = _model_file(instance, shaders)
    order = sorted(files, key=lambda file: file != model)
    return instance.name, [{"file": file, "name": short_name(file), "lines": files[file]} for file in order]


def short_name(file: str) -> str:
    """Returns the name of a shader file with its folder, such as brdf/ggx.glsl. The file of generated text keeps its name."""
    return "/".join(Path(file).parts[-2:])


def _model_file(instance: Instance, shaders: Shaders) -> str:
    """Returns the path of the file that holds an instance's model."""
    found = shaders.find(f"brdf/{instance.material.brdf}.glsl")
    return str(found.path) if found else ""


def _generated(stage: Stage, file: str) -> list[str]:
    """Returns the lines of a stage that were generated into a place. Its includes are lines without a text."""
    texts = stage.text.splitlines()
    numbers = {number: texts[index] for index, (name, number) in enumerate(stage.lines) if name == file}
    return [numbers.get(number, "") for number in range(1, max(numbers) + 1)]
