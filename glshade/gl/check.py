"""Check: compiles the programs that scenes and shader files are part of, and collects all of their errors."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Literal

from glshade.assembly.part import Part
from glshade.brdfs import BRDFS
from glshade.errors import SceneError, ShaderError
from glshade.gl.context import Context
from glshade.gl.diagnosis import diagnose, distinct
from glshade.glsl.coverage import covering_plans
from glshade.glsl.generator import encoder, generate
from glshade.glsl.plan import ProgramPlan
from glshade.glsl.planner import plan
from glshade.glsl.shaders import Shaders
from glshade.glsl.source import Source
from glshade.problem import Problem
from glshade.radiance.readying import ready
from glshade.scene.file import load
from glshade.scene.models import Folders, paths, use_models, use_shader_models
from glshade.scene.problems import problems_of
from glshade.scene.scene import Scene

# Makes the source of a program, or raises ShaderError if an include cannot be resolved.
Maker = Callable[[], Source]
ENCODINGS: tuple[Literal["linear", "srgb"], ...] = ("linear", "srgb")
# The parts of a picture that layers are made of, besides the light of each lamp.
LAYERS: tuple[Literal["lit", "specular", "emission", "albedo", "depth", "uv", "normal"], ...] = (
    *("lit", "specular", "emission", "albedo"),
    *("depth", "uv", "normal"),
)
SHADER_SUFFIXES = (".glsl", ".vert", ".frag")


@dataclass
class Check:
    """The result of a check.

    problems: the errors, each once, by file and line.
    programs: the number of programs that were compiled.
    unused: the paths of shader files that no program contains.
    """

    problems: list[Problem] = field(default_factory=list)
    programs: int = 0
    unused: list[str] = field(default_factory=list)

    @property
    def exit_code(self) -> int:
        """The exit code of the command: 0 without errors, 3 if all errors are in scenes or their files, else 4."""
        if not self.problems:
            return 0
        in_scenes = all(problem.stage in ("scene", "mesh", "texture") for problem in self.problems)
        return SceneError.exit_code if in_scenes else ShaderError.exit_code

    def as_dict(self) -> dict[str, Any]:
        """Returns the result as JSON types."""
        return {
            "programs": self.programs,
            "problems": [problem.as_dict() for problem in self.problems],
            "unused": self.unused,
        }


def check_files(
    context: Context, files: Sequence[str | Path], shaders: Folders | None = None, models: Folders | None = None
) -> Check:
    """Compiles every program that the files are part of.

    context: the context to compile in.
    files: scenes, mesh files and shader files. If there are none, the programs use all models, at all shading rates, with all
        kinds of light.
    shaders: optional; the user's shader folders, as for Renderer.
    models: optional; the user's model folders, as for Renderer.
    Errors: ShaderError for a shader folder that does not exist.
    """
    checker = _Checker(context)
    for read, folders in ((use_models, models), (use_shader_models, shaders)):
        try:
            read(folders)
        except (SceneError, ShaderError) as error:
            checker.result.problems += problems_of(error)
    found = Shaders(paths(shaders))
    in_glsl = [path for path in map(Path, files) if path.suffix.lower() in SHADER_SUFFIXES]
    for path in map(Path, files):
        if path not in in_glsl:
            checker.scene_file(path, found)
    if in_glsl or not files:
        wanted = {os.path.realpath(path) for path in in_glsl}
        seen = checker.programs(_covering(_models_of(in_glsl, found), found), wanted)
        own = in_glsl or [path for folder in (*found.own, *found.models) for path in sorted(folder.rglob("*"))]
        checker.result.unused = [
            str(path) for path in own if path.suffix in SHADER_SUFFIXES and os.path.realpath(path) not in seen
        ]
    return checker.finished()


def problems_of_scene(context: Context, scene: Scene, shaders: Shaders) -> list[Problem]:
    """Returns all errors of the programs of a scene and of its layers, each once, by file and line.

    context: the context to compile in.
    scene: the scene.
    shaders: the shader files.
    Errors: SceneError.
    """
    checker = _Checker(context)
    checker.programs(_of_scene(scene, shaders))
    return checker.finished().problems


class _Checker:
    """Compiles programs, each text once, and collects the errors.

    result: the result so far.
    """

    def __init__(self, context: Context) -> None:
        self.result = Check()
        self._context = context
        self._compiled: set[Source] = set()

    def scene_file(self, path: Path, shaders: Shaders) -> None:
        """Loads a scene and compiles its programs. A model whose struct is at fault makes loading fail again."""
        try:
            self.programs(_of_scene(load(path), shaders))
        except (SceneError, ShaderError) as error:
            self.result.problems += problems_of(error)

    def programs(self, makers: Iterable[Maker], wanted: set[str] | frozenset[str] = frozenset()) -> set[str]:
        """Compiles programs, and returns the real paths of all shader files that they contain.

        makers: a function for each program that makes its source.
        wanted: the real paths of shader files; only programs that contain one of them are compiled. Empty for all programs.
        """
        seen: set[str] = set()
        for make in makers:
            try:
                source = make()
            except ShaderError as error:
                self.result.problems += problems_of(error)
                continue
            files = {os.path.realpath(file) for file in source.files}
            seen |= files
            if source not in self._compiled and (not wanted or wanted & files):
                self._compiled.add(source)
                self.result.problems += diagnose(self._context, source)
        return seen

    def finished(self) -> Check:
        """Returns the result, with its problems in order and each of them once."""
        self.result.programs = len(self._compiled)
        self.result.problems = sorted(distinct(self.result.problems), key=_place)
        return self.result


def _place(problem: Problem) -> tuple[str, int, int]:
    return problem.file, problem.line or 0, problem.column or 0


def _of_scene(scene: Scene, shaders: Shaders) -> Iterator[Maker]:
    """Yields the programs of a scene's picture in both encodings, and of the parts that its layers are made of."""
    parts: list[Part | None] = [None]
    if scene.film.aovs:
        parts += [Part(kind) for kind in LAYERS] + [Part("light", index) for index in range(len(ready(scene).lights))]
    plans: dict[ProgramPlan, None] = {}
    for part in parts:
        assembly = ready(scene, None, part)
        for encoding in ENCODINGS if part is None else ENCODINGS[:1]:
            plans |= dict.fromkeys(plan(assembly, encoding).programs)
    yield from (partial(generate, each, shaders) for each in plans)
    yield from (partial(encoder, encoding, shaders) for encoding in ENCODINGS)


def _covering(names: tuple[str, ...] | None, shaders: Shaders) -> Iterator[Maker]:
    """Programs that between them contain every shader file that a scene can ask for. names: the models; None for all."""
    yield from (partial(generate, each, shaders) for each in dict.fromkeys(covering_plans(names)))
    yield from (partial(encoder, encoding, shaders) for encoding in ENCODINGS)


def _models_of(files: list[Path], shaders: Shaders) -> tuple[str, ...] | None:
    """Returns the names of the models if all of these shader files are files of models; None for all models."""
    names = [path.stem for path in files if path.stem in BRDFS and _is_read(path, shaders)]
    return tuple(names) if names and len(names) == len(files) else None


def _is_read(path: Path, shaders: Shaders) -> bool:
    """Returns whether a file is the one that is read for the model of its name."""
    file = shaders.find(f"brdf/{path.stem}.glsl")
    return file is not None and os.path.realpath(file.path) == os.path.realpath(path)
