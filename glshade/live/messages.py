"""Messages: the requests that the server sends to its child processes, and their answers.

They travel over a pipe as pickles, so they hold plain data only: texts, numbers, bytes, lists and tables of these.
A view is the table that a page sends (docs/live.md describes its keys). A problem is the table of `Problem.as_dict`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

View: TypeAlias = Mapping[str, Any]
Table: TypeAlias = dict[str, Any]
Mime: TypeAlias = Literal["image/png", "image/jpeg"]
PNG: Mime = "image/png"
JPEG: Mime = "image/jpeg"


@dataclass(frozen=True, kw_only=True)
class Request:
    """The base class of requests. Each is answered once, in the order of arrival.

    id: the number that the answer repeats.
    """

    id: int = 0


@dataclass(frozen=True, kw_only=True)
class Load(Request):
    """Reads a scene and compiles its programs. The answer is `Loaded`, also where the scene is at fault.

    revision: the number of the new revision. It becomes the revision that is drawn only if it has no fault.
    scene: the path of the scene or mesh file.
    overrides: texts KEY=VALUE, as `--set` takes them, in their order.
    shaders: paths of the user's shader folders.
    models: paths of the user's model folders, whose Python files are executed.
    size: optional; width and height [pixels] in place of the film's.
    """

    revision: int
    scene: str
    overrides: tuple[str, ...] = ()
    shaders: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    size: tuple[int, int] | None = None


@dataclass(frozen=True, kw_only=True)
class Restore(Request):
    """Loads the last good revision from a snapshot on disk, which another drawer wrote. The answer is `Loaded`.

    folder: the folder of the snapshot.
    """

    folder: str


@dataclass(frozen=True, kw_only=True)
class Draw(Request):
    """Draws a picture of a view. The answer is `Frame` or `Failed`.

    view: the view.
    still: whether the picture stands still. A still picture has the very pixels of `glshade render` and is a lossless PNG.
    """

    view: View = field(default_factory=dict)
    still: bool = True


@dataclass(frozen=True, kw_only=True)
class Save(Request):
    """Draws the scene's own picture and writes it to a file, as `glshade render` does. The answer is `Saved` or `Failed`.

    path: the picture file; its suffix names the format.
    """

    path: str


@dataclass(frozen=True, kw_only=True)
class Pick(Request):
    """Asks which object a pixel shows. The answer is `Picked` or `Failed`.

    view: the view.
    x, y: the pixel, from the top left of the full-size picture [pixels].
    """

    view: View
    x: int
    y: int


@dataclass(frozen=True, kw_only=True)
class Verify(Request):
    """Asks the judge whether a view is drawn right. The answer is `Judged` or `Failed`."""

    view: View


@dataclass(frozen=True, kw_only=True)
class Probe(Request):
    """Asks the judge for the values of a pixel. The answer is `Probed` or `Failed`.

    view: the view.
    x, y: the pixel, from the top left [pixels].
    """

    view: View
    x: int
    y: int


@dataclass(frozen=True, kw_only=True)
class Reference(Request):
    """Asks the judge for the picture of the float64 reference. The answer is `Frame` or `Failed`."""

    view: View


@dataclass(frozen=True, kw_only=True)
class Heat(Request):
    """Asks the judge for the difference from the reference as a picture. The answer is `Frame`, with `scale`, or `Failed`."""

    view: View


@dataclass(frozen=True, kw_only=True)
class ShowVariable(Request):
    """Asks the judge for the values of a variable as a picture. The answer is `Frame`, with `scale`, or `Failed`.

    view: the view, whose key "variable" names the object and the variable.
    """

    view: View


@dataclass(frozen=True, kw_only=True)
class Trace(Request):
    """Asks the judge for the value of every variable at a pixel. The answer is `Traced` or `Failed`.

    view: the view.
    x, y: the pixel, from the top left [pixels].
    """

    view: View
    x: int
    y: int


@dataclass(frozen=True, kw_only=True)
class MeasureDigits(Request):
    """Asks the judge for the lines of an object's program that lose digits. The answer is `LostDigits` or `Failed`.

    view: the view.
    object: the index of the object in the scene.
    """

    view: View
    object: int


@dataclass(frozen=True, kw_only=True)
class ReadSource(Request):
    """Asks the drawer for the files of an object's program. The answer is `Source` or `Failed`.

    view: the view.
    object: the index of the object in the scene.
    """

    view: View
    object: int


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The base class of answers.

    id: the number of the request.
    ok: whether the request could be fulfilled.
    """

    id: int
    ok: bool = True


@dataclass(frozen=True, kw_only=True)
class Failed(Answer):
    """The request could not be fulfilled.

    problems: the reasons, one table each.
    """

    problems: list[Table]
    ok: bool = False


@dataclass(frozen=True, kw_only=True)
class Loaded(Answer):
    """A scene was read, or could not be.

    ok: whether it has no fault, so that it is drawn from now on.
    revision: the number of the revision that was asked for.
    shown: the number of the revision that is drawn from now on, which is an older one where `ok` is false; 0 where there is
        none yet.
    problems: every fault of the files, one table each.
    dependencies: the paths of the files that the picture depends on, those that are missing too.
    folders: the paths of the folders to watch.
    controls: the values that a page can change, as `controls.controls_of` returns them; those of `shown`.
    info: facts about `shown`, as `information.information_of` returns them.
    snapshot: the folder from which a new drawer can restore `shown`; None where there is none yet.
    restart: whether the request has to be sent to a new drawer, because Python files of the model folders have changed. A
        process can run them only once. Nothing was loaded then.
    milliseconds: step -> time [ms]: "read", "plan", "compile", "first_draw".
    """

    revision: int
    shown: int
    problems: list[Table] = field(default_factory=list)
    dependencies: list[str] = field(default_factory=list)
    folders: list[str] = field(default_factory=list)
    controls: Table = field(default_factory=dict)
    info: Table = field(default_factory=dict)
    snapshot: str | None = None
    restart: bool = False
    milliseconds: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Frame(Answer):
    """A picture.

    data: the bytes of the picture file.
    mime: its media type.
    width, height: its size, which is smaller than that of the view while the picture moves [pixels].
    revision: the number of the revision that it shows.
    milliseconds: step -> time [ms]: "draw", "encode".
    problems: warnings about the picture, one table each.
    non_finite: the number of its pixels that are NaN or infinite; None where it was not counted.
    scale: the scale of a heat map: {"low", "high", "text", "colours"}, with colours from low to high; None for other pictures.
    ignored: keys of the view's "set" that do not fit the scene.
    controls: the values that a page can change, where the view's "set" has changed a model; else None.
    """

    data: bytes
    mime: Mime = PNG
    width: int
    height: int
    revision: int
    milliseconds: dict[str, float] = field(default_factory=dict)
    problems: list[Table] = field(default_factory=list)
    non_finite: int | None = None
    scale: Table | None = None
    ignored: list[str] = field(default_factory=list)
    controls: Table | None = None


@dataclass(frozen=True, kw_only=True)
class Saved(Answer):
    """The picture was written.

    revision: the number of the revision that it shows.
    """

    revision: int


@dataclass(frozen=True, kw_only=True)
class Picked(Answer):
    """What lies at a pixel.

    object: the name of the object, or objects[N] where it has none; None for the background.
    key: the prefix of the keys of the object's values, such as "objects.3"; None for the background.
    material: the name of its material; None for the background.
    material_key: the prefix of the keys of its material's values, such as "materials.body"; None for the background, and for a
        material that comes from the mesh file.
    point: the point of the surface in world space [scene units]; None for the background.
    """

    object: str | None = None
    key: str | None = None
    material: str | None = None
    material_key: str | None = None
    point: tuple[float, float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Judged(Answer):
    """The verdict about a view.

    verdict: "verified", "failed", "inconclusive", or "none" where a model has no reference and its own GLSL cannot be run.
    derived: whether the picture was compared with its own GLSL, run in float64, because a model has no reference.
    text: the verdict in one sentence.
    unexplained: the number of pixels that no rule of the verifier explains.
    ambiguous: the number of pixels that the float64 reference does not determine, such as those on edges.
    pixels: (x, y) of up to 200 unexplained pixels.
    revision: the number of the revision that was judged.
    seconds: the time that it took [s].
    """

    verdict: Literal["verified", "failed", "inconclusive", "none"]
    text: str
    derived: bool = False
    unexplained: int = 0
    ambiguous: int = 0
    pixels: list[tuple[int, int]] = field(default_factory=list)
    revision: int = 0
    seconds: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Probed(Answer):
    """The values of a pixel, in linear light.

    x, y: the pixel [pixels].
    value: what the driver drew: red, green and blue, and alpha where the picture has it.
    reference: the value of the float64 reference.
    low, high: the interval in which a right value lies, by channel.
    kind: the class that the verifier gives the pixel, in words.
    object: the name of the object; None for the background.
    triangle: the index of the triangle in its mesh; None for the background.
    text: the result in one sentence.
    revision: the number of the revision that was probed.
    """

    x: int
    y: int
    value: Sequence[float]
    reference: Sequence[float]
    low: Sequence[float]
    high: Sequence[float]
    kind: str
    object: str | None = None
    triangle: int | None = None
    text: str = ""
    revision: int = 0


@dataclass(frozen=True, kw_only=True)
class Traced(Answer):
    """The value of every variable at a pixel.

    x, y: the pixel [pixels].
    object: the index of the object in the scene; None for the background.
    steps: a table for each step, in the order in which they ran: "file", "short" (the file's name with its folder), "line",
        "text", "name", "number" (how many times the line has given the variable a value before), "type", "float64" and
        "float32" (texts), "digits" (the decimal digits that float32 has lost) and "picture" (whether the variable can be shown
        as a picture).
    left_out: the number of further steps, which are not listed.
    revision: the number of the revision that was traced.
    """

    x: int
    y: int
    object: int | None = None
    steps: list[Table] = field(default_factory=list)
    left_out: int = 0
    revision: int = 0


@dataclass(frozen=True, kw_only=True)
class LostDigits(Answer):
    """The lines of an object's program that lose more than three digits.

    object: the index of the object in the scene.
    lines: a table for each line: "file", "line", "text", "digits" and "ill_posed" (whether rounding the inputs alone does as
        much).
    revision: the number of the revision that was measured.
    """

    object: int
    lines: list[Table] = field(default_factory=list)
    revision: int = 0


@dataclass(frozen=True, kw_only=True)
class Source(Answer):
    """The files of an object's program.

    object: the index of the object in the scene.
    name: the object's name.
    files: a table for each file: "file" (its path, or <PLACE> for generated text), "name" (its name with its folder)
        and "lines" (its text, line by line).
    revision: the number of the revision that holds them.
    """

    object: int
    name: str
    files: list[Table] = field(default_factory=list)
    revision: int = 0
