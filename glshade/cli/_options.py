"""Options: command-line options that several commands share."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from glshade.limits import DEFAULT, Limits

if TYPE_CHECKING:
    from glshade.scene.scene import Scene


# Key of the film -> name of its option, for options whose name differs from the key.
OPTIONS = {"aovs": "aov", "point_size": "point-size"}


class Size(click.ParamType[tuple[int, int]]):
    """An option's type: a size such as `640x480`, as (width, height) [pixels]."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"(\d+)x(\d+)", value)
        if not match or "0" in match.groups():
            self.fail(f"{value!r} is not a size such as 640x480", param, ctx)
        return int(match[1]), int(match[2])


class Crop(click.ParamType[tuple[int, int, int, int]]):
    """An option's type: a window such as `10,20,64x48`, as (x, y, width, height) from the top left [pixels]."""

    name = "X,Y,WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int, int, int]:
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"(\d+),(\d+),(\d+)x(\d+)", value)
        if not match:
            self.fail(f"{value!r} is not a window such as 10,20,64x48", param, ctx)
        x, y, width, height = map(int, match.groups())
        return x, y, width, height


class Duration(click.ParamType[float]):
    """An option's type: a time such as `5ms` or `0.2s`, in seconds. A number without unit is in milliseconds."""

    name = "TIME"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float):
            return value
        match = re.fullmatch(r"([0-9.]+(?:e-?\d+)?)\s*(ms|s|)", value)
        try:
            seconds = float(match[1]) * (1.0 if match[2] == "s" else 1e-3) if match else 0.0
        except ValueError:
            seconds = 0.0
        if not seconds > 0:
            self.fail(f"{value!r} is not a time such as 5ms or 0.2s", param, ctx)
        return seconds


def driver(command: Any) -> Any:
    """Adds the options --backend and --device, whose values Renderer takes as arguments of these names."""
    command = click.option("--device", type=int, help="Index of the EGL device, as `glshade devices` lists them.")(command)
    backends = click.Choice(["auto", "egl", "osmesa", "standalone"])
    help = "OpenGL backend; auto is EGL on Linux, and OSMesa if EGL fails."
    return click.option("--backend", type=backends, default="auto", show_default=True, help=help)(command)


def shaders(command: Any) -> Any:
    """Adds the option --shaders, whose value `shaders` holds the paths of the user's own shader folders."""
    return _shaders_option(_check_shaders)(command)


def _shaders_option(callback: Any) -> Any:
    return click.option(
        "--shaders",
        multiple=True,
        metavar="FOLDER",
        callback=callback,
        help="Folder of GLSL files that replace glshade's files of the same names, such as brdf/phong.glsl, or add "
        "reflectance models, such as brdf/mine.glsl. Repeatable.",
    )


def _check_shaders(ctx: click.Context, option: click.Parameter, folders: tuple[str, ...]) -> tuple[str, ...]:
    """Reads the shader folders, so that a faulty one is reported once, before worker processes start. Returns the folders.

    Errors: ShaderError.
    """
    if folders and not ctx.resilient_parsing:
        from glshade.glsl.shaders import current
        from glshade.scene.models import use_shader_models

        current(folders)
        use_shader_models(folders)
    return folders


def models(command: Any) -> Any:
    """Adds the option --models, whose value `models` holds the paths of the user's own model folders.

    The models are loaded before the other options are read (click's is_eager), because other options may name a model.
    """
    return _models_option(_use_models)(command)


def _models_option(callback: Any) -> Any:
    return click.option(
        "--models",
        multiple=True,
        metavar="FOLDER",
        is_eager=True,
        callback=callback,
        help="Folder of further reflectance models and lights, each NAME.py with NAME.glsl beside it, or NAME.glsl alone. "
        "The Python files are run. Repeatable.",
    )


def unread_folders(command: Any) -> Any:
    """Adds the options --shaders and --models for a command that reads the folders itself, and reports their faults."""
    return _shaders_option(None)(_models_option(None)(command))


def _use_models(ctx: click.Context, option: click.Parameter, folders: tuple[str, ...]) -> tuple[str, ...]:
    if folders and not ctx.resilient_parsing:
        from glshade.scene.models import use_models

        use_models(folders)
    return folders


def point_size(command: Any) -> Any:
    """Adds the option --point-size, whose value is that of the film's key."""
    return click.option(
        "--point-size", type=float, metavar="N", help="Side of the squares that points become, and width of lines [pixels]."
    )(command)


def limits(command: Any) -> Any:
    """Adds the options that raise a limit. The command gets their values as one argument `limits`, as `glshade.load` takes it.

    docs/security.md explains the limits.
    """

    @wraps(command)
    def limited(
        *arguments: Any, allow_outside: bool, max_triangles: int, max_pixels: int, max_texels: int, **others: Any
    ) -> Any:
        return command(*arguments, limits=Limits(allow_outside, max_triangles, max_pixels, max_texels), **others)

    for name, help in (
        ("triangles", "Largest number of triangles that the scene makes by shapes, subdivision and copies."),
        ("pixels", "Largest number of shaded pixels of a picture."),
        ("texels", "Largest number of pixels of all textures."),
    ):
        default = getattr(DEFAULT, f"max_{name}")
        number = click.IntRange(1)
        limited = click.option(f"--max-{name}", type=number, metavar="N", default=default, show_default=True, help=help)(
            limited
        )
    outside = "Lets mesh files name buffers, materials and textures outside the folders of the mesh and of the scene's files."
    return click.option("--allow-outside", is_flag=True, help=outside)(limited)


def overrides(command: Any) -> Any:
    """Adds the options --set, --up, --file-lights and --joint.

    The command gets their values as (key, text) pairs in `overrides`, as `glshade.load` takes them.
    """

    @wraps(command)
    def overridden(
        *arguments: Any,
        overrides: list[tuple[str, str]],
        up: str | None,
        file_lights: bool,
        joints: list[tuple[str, str]],
        **others: Any,
    ) -> Any:
        first = [*joints, *([("up", up)] if up else [])]
        if file_lights:
            first.append(("file_lights", "true"))
        return command(*arguments, overrides=[*first, *overrides], **others)

    help = "Axis of a mesh file that points up; auto is z for .stl and y for the others (docs/files.md). [default: auto]"
    lights = "Draws mesh files with the lights that they hold, in lux and candela, and not with the default lights."
    overridden = joint(overridden)
    overridden = click.option("--file-lights", is_flag=True, help=lights)(overridden)
    overridden = click.option("--up", type=click.Choice(["x", "y", "z", "auto"]), help=help)(overridden)
    return click.option(
        "--set",
        "overrides",
        multiple=True,
        metavar="KEY=VALUE",
        callback=lambda ctx, param, texts: _assignments(texts, param),
        help="Replaces a value of the scene: quality.fresnel=schlick, materials.body.roughness=0.3, "
        "objects.ball.material=gold, lights.0.intensity=2, film.size=[640,360]. Repeatable.",
    )(overridden)


def joint(command: Any) -> Any:
    """Adds the option --joint, whose value `joints` holds overrides: pairs of the key `joints.NAME` and a text."""
    return click.option(
        "--joint",
        "joints",
        multiple=True,
        metavar="NAME=VALUE",
        callback=lambda ctx, param, texts: _joints(texts, param),
        help="Value of a joint of a robot (.urdf) [radians, or metres of a prismatic joint]. Repeatable.",
    )(command)


def _joints(texts: tuple[str, ...], option: click.Parameter) -> list[tuple[str, str]]:
    """Returns the overrides for texts NAME=VALUE. A name may hold any characters; the value follows the last =."""
    pairs = []
    for text in texts:
        name, equals, value = text.rpartition("=")
        if not (name.strip() and equals and value.strip()):
            raise click.BadParameter(f"{text!r} is not NAME=VALUE such as elbow=0.5", param=option)
        pairs.append((f"joints.{name.strip()}", value.strip()))
    return pairs


def _assignments(texts: tuple[str, ...], option: click.Parameter) -> list[tuple[str, str]]:
    if not texts:
        return []
    from glshade.scene.override import split

    try:
        return [split(text) for text in texts]
    except ValueError as error:
        raise click.BadParameter(str(error), param=option) from None


def filmed(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """Returns the scene with a changed film.

    scene: the scene, which is not changed itself
    changes: key of the film -> value; None changes nothing
    Errors: click.BadParameter, which names the option that sets the key.
    """
    changes = {key: value for key, value in changes.items() if value is not None}
    if not changes:
        return scene
    from pydantic import ValidationError

    from glshade.scene.film import Film

    try:
        film = Film.model_validate({**scene.film.model_dump(), **changes})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = str(first["loc"][0])
        raise click.BadParameter(first["msg"], param_hint=f"'--{OPTIONS.get(key, key)}'") from None
    excess = film.excess(scene.limits)
    if excess:
        raise click.BadParameter(excess, param_hint=f"'--{OPTIONS.get(key := next(iter(changes)), key)}'")
    return scene.model_copy(update={"film": film})
