"""Sidecars: the JSON file beside a baseline that says who made the picture, from what, and by which rule it is compared."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn, TypeAlias, TypeVar

from pydantic import Field, ValidationError, field_serializer

from glshade.document import Document, nearest
from glshade.errors import GlshadeError, shortened
from glshade.files import check_regular, read_bytes, replacing
from glshade.golden.names import sidecar_path
from glshade.image import file as picture_file
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer
    from glshade.golden.rules import Rule
    from glshade.scene.scene import Scene

# The version of the format. A file with a larger number was written by a later glshade, which may mean something else by a key.
VERSION: Literal[1] = 1
# A sidecar takes about 1,000 bytes. A file that is larger than this is something else [bytes].
LARGEST = 1 << 20

# Short name of a driver -> words, in lower case, one of which its GL_RENDERER or GL_VERSION string holds. The first name that
# fits counts: the strings of drivers that pass their work on, such as zink, also name the GPU.
FAMILIES = {
    "llvmpipe": ("llvmpipe",),
    "softpipe": ("softpipe",),
    "zink": ("zink",),
    "virgl": ("virgl",),
    "d3d12": ("d3d12",),
    "angle": ("angle",),
    "svga3d": ("svga3d",),
    "nvidia": ("nvidia", "geforce", "quadro"),
    "nouveau": ("nouveau",),
    "amd": ("amd", "radeon"),
    "intel": ("intel",),
    "apple": ("apple",),
}

Maker: TypeAlias = Literal["driver", "reference", "unknown"]
Model = TypeVar("Model", bound=Document)


class Driver(Document):
    """The OpenGL driver that drew a picture.

    renderer: its GL_RENDERER string.
    version: its GL_VERSION string; empty if it is not known.
    backend: "egl", "osmesa" or "standalone"; empty if it is not known.
    """

    renderer: str
    version: str = ""
    backend: str = ""

    @property
    def family(self) -> str:
        """The short name of the driver, such as `llvmpipe` or `nvidia`, which also names its variants."""
        return family(self.renderer, self.version)


class RuleUse(Document):
    """A rule by its name, with the settings that are not the defaults."""

    name: str = "codes"
    options: dict[str, Annotated[float, Field(ge=0, allow_inf_nan=True)]] = Field({})

    @field_serializer("options")
    def _without_infinity(self, options: dict[str, float]) -> dict[str, float | str]:
        # JSON has no infinity. Pydantic reads the text "inf" as one.
        return {key: "inf" if math.isinf(value) else value for key, value in options.items()}

    @classmethod
    def of(cls, rule: Rule) -> RuleUse:
        """Returns the name and the settings of a rule."""
        default: Any = type(rule)()
        names: list[str] = [field.name for field in fields(rule)] if is_dataclass(rule) else []
        changed = {name: getattr(rule, name) for name in names if getattr(rule, name) != getattr(default, name)}
        return cls(name=type(rule).__module__.rpartition(".")[2], options=changed)

    def rule(self) -> Rule:
        """Returns the rule. Errors: GlshadeError for an unknown name or setting."""
        from glshade.golden.rules import RULES

        if self.name not in RULES:
            raise GlshadeError(f"no rule is named {self.name!r}{nearest(self.name, RULES)}")
        try:
            return RULES[self.name](**self.options)
        except TypeError:
            raise GlshadeError(f"the rule {self.name} has no such settings: {', '.join(self.options)}") from None


class Origin(Document):
    """The origin of a picture: who made it, and from what.

    made_by: "driver", "reference" (the float64 reference, whose pictures no driver can make out of date) or "unknown".
    driver: the driver that drew it; None for the reference, and if it is not known.
    freedom: the measured errors of that driver, in the form of `Freedom.as_dict`; None if they were not measured.
    glshade: the version of glshade that drew it; empty if it is not known.
    scene: the scene's file. In a sidecar it is relative to the sidecar's folder, with slashes; elsewhere it is absolute.
    overrides: values that replace those of the scene's file, as `--set` takes them, such as "film.size=[96, 54]".
    scene_digest: SHA-256 of the scene, overrides included, as `scene_digest` returns it.
    shaders_digest: SHA-256 of the GLSL files, as `Shaders.digest` has it.
    """

    made_by: Maker = "unknown"
    driver: Driver | None = None
    freedom: dict[str, Any] | None = None
    glshade: str = ""
    scene: str | None = None
    overrides: tuple[str, ...] = ()
    scene_digest: str | None = None
    shaders_digest: str | None = None


class First(Document):
    """The first picture that was approved for a baseline, with which later ones are compared, so that none of them creeps away.

    sha256: SHA-256 of the bytes of its file, which is `Baselines.first_path` unless it is the baseline itself.
    distance: distance of the baseline from it, as `distance_of` returns it.
    """

    sha256: str
    distance: float = 0.0


class Sidecar(Origin):
    """The contents of a sidecar.

    version: the version of this format.
    sha256: SHA-256 of the bytes of the picture's file. If the file has another one, the sidecar belongs to another picture.
    rule: the rule by which the picture is compared.
    first: the first approved picture.
    accepted_drift: how often a person has accepted that a picture has crept away from the first one.
    """

    version: Literal[1] = 1
    sha256: str
    rule: RuleUse = RuleUse()
    first: First
    accepted_drift: int = Field(0, ge=0)

    def scene_path(self, picture: Path) -> Path | None:
        """Returns the path of the scene's file, for the sidecar of this picture; None if no scene is named."""
        return None if self.scene is None else scene_beside(picture, self.scene)


def scene_beside(picture: Path, scene: str) -> Path:
    """Returns the path of a scene's file that is named relative to a picture's folder, which need not exist."""
    # The operating system cannot leave a folder that does not exist by "..".
    return Path(os.path.normpath(picture.parent / scene))


def load_sidecar(picture: Path) -> Sidecar:
    """Returns the sidecar of a picture, which may belong to another picture.

    Errors: OSError; GlshadeError where it is damaged or of a later version, with the reason alone.
    """
    return loaded(sidecar_path(picture), Sidecar, LARGEST)


def read_sidecar(picture: Path) -> tuple[Sidecar | None, str]:
    """Returns (the sidecar of a picture, "") or (None, one sentence that says why it cannot be used).

    A picture is compared without its sidecar if the sidecar is missing, damaged, of a later version, or of another picture.
    """
    path = sidecar_path(picture)
    try:
        sidecar = load_sidecar(picture)
        if sidecar.sha256 != sha256_of(picture):
            return None, f"{path.name} is not used: it belongs to another picture; approve the picture again"
    except FileNotFoundError:
        return None, f"{picture.name} has no sidecar ({path.name}), so that its driver and scene are not known"
    except (OSError, GlshadeError) as error:
        return None, f"{path.name} is not used: {getattr(error, 'strerror', None) or error}"
    return sidecar, ""


def write_sidecar(picture: Path, sidecar: Sidecar) -> None:
    """Writes the sidecar of a picture, whole or not at all. Errors: OSError."""
    with replacing(sidecar_path(picture)) as temporary:
        temporary.write_text(as_text(sidecar.model_dump(mode="json")), encoding="utf-8")


def as_text(value: Any) -> str:
    """Returns a value as JSON, with a line for each part of it, so that version control shows what has changed."""
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def loaded(path: Path, model: type[Model], largest: int) -> Model:
    """Returns the contents of a JSON file of ours. largest: the size above which it is refused [bytes].

    Errors: OSError; GlshadeError where it is damaged or was written by a later version, with the reason alone.
    """
    return parsed(read_bytes(path, largest), model)


def parsed(data: bytes, model: type[Model]) -> Model:
    """Returns the contents of a JSON text of ours. Errors: GlshadeError, with the reason alone."""
    try:
        value = json.loads(data, parse_constant=_not_a_number)
    except (ValueError, RecursionError) as error:
        raise GlshadeError(f"is damaged: {shortened(str(error))}") from None
    version = value.get("version", VERSION) if isinstance(value, dict) else VERSION
    if isinstance(version, int) and version > VERSION:
        raise GlshadeError(f"was written by a later version of glshade (format {version}, known: {VERSION}); update glshade")
    try:
        return model.model_validate(value)
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        place = ".".join(map(str, fault["loc"]))
        raise GlshadeError(f"is damaged: {shortened(f'{place}: ' if place else '')}{shortened(fault['msg'])}") from None


def _not_a_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a number of JSON")


def sha256_of(path: Path) -> str:
    """Returns the SHA-256 of a regular file's bytes: 64 hexadecimal digits. Errors: OSError."""
    check_regular(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def drawn_by(renderer: Renderer, scene: Scene, path: Path | None = None, overrides: Sequence[str] = ()) -> Origin:
    """Returns the origin of the picture that a renderer draws of a scene.

    path, overrides: optional, the scene's file, and the values that replace those of the file, as Origin has them.
    The driver's freedom is measured once a process. Errors: AssetError, OSError, ShaderError, ContextError.
    """
    from glshade.driver.freedom import measure_freedom
    from glshade.scene.digest import scene_digest

    context = renderer.context
    return Origin(
        made_by="driver",
        driver=Driver(renderer=context.renderer, version=context.version, backend=context.backend),
        freedom=measure_freedom(context).as_dict(),
        glshade=__version__,
        scene=None if path is None else str(path.absolute()),
        overrides=tuple(overrides),
        scene_digest=scene_digest(scene),
        shaders_digest=renderer.current_shaders().digest,
    )


def origin_of(picture: Path) -> Origin:
    """Returns what a picture's sidecar, or else its own attributes, say about its origin. The scene's path is absolute."""
    sidecar, _ = read_sidecar(picture)
    if sidecar is not None:
        kept = {name: getattr(sidecar, name) for name in Origin.model_fields}
        scene = sidecar.scene_path(picture)
        return Origin(**{**kept, "scene": None if scene is None else str(scene.absolute())})
    attributes = picture_file.attributes(picture)
    # The name of a renderer may hold a semicolon; that of a version does not.
    renderer, _, version = attributes.get("glshade:renderer", "").rpartition("; ")
    return Origin(
        made_by="driver" if renderer else "unknown",
        driver=Driver(renderer=renderer, version=version) if renderer else None,
        glshade=attributes.get("glshade:version", ""),
        scene_digest=attributes.get("glshade:scene"),
    )


def family(renderer: str, version: str = "") -> str:
    """Returns a short name for a driver, such as `llvmpipe` or `nvidia`: the default key of its variants.

    renderer, version: its GL_RENDERER and GL_VERSION strings.
    """
    names = f"{renderer} {version}".lower()
    for name, words in FAMILIES.items():
        if any(word in names for word in words):
            return name
    return re.sub(r"[^a-z0-9]+", "-", renderer.lower().partition(" ")[0]).strip("-") or "unknown"
