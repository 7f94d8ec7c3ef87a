"""Wire: the messages between the server of `glshade dev` and a page. docs/live.md lists them.

The page is a part of glshade, but any program that has the token can send messages. So each message is checked first.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, JsonValue, TypeAdapter, ValidationError

# The longest text message of a page [bytes]. A view with a few hundred changed values has 20 kB.
LARGEST_MESSAGE = 256 << 10
# The pixels of a picture for a page: 4K in both directions. A larger picture is a task for `glshade render`.
MOST_PIXELS = 1 << 24
# The width or height of a picture for a page [pixels]. No OpenGL driver draws a larger one in one piece.
LONGEST_SIDE = 16384
# The pictures that a page shows side by side.
MOST_PANES = 2
# The largest index of an object, and the largest number of a step of a trace, that a page may name.
LARGEST_INDEX = 1 << 20
# The kinds of pictures.
SOURCES = r"^(picture|last_good|previous|reference|heat|variable|file:.+)$"
# Version of the binary messages.
VERSION = 1

Text: TypeAlias = Annotated[str, Field(max_length=4096)]
Vector: TypeAlias = tuple[float, float, float]
Side: TypeAlias = Annotated[int, Field(ge=1, le=LONGEST_SIDE)]


def _check_pixels(size: tuple[int, int]) -> tuple[int, int]:
    if size[0] * size[1] > MOST_PIXELS:
        raise ValueError(f"a picture of {size[0]}x{size[1]} has more than {MOST_PIXELS} pixels")
    return size


Size: TypeAlias = Annotated[tuple[Side, Side], AfterValidator(_check_pixels)]


class _Message(BaseModel):
    """The base class of tables that a page sends. Keys that are not declared are an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ViewCamera(_Message):
    """A camera of a view: the name of one of the scene's cameras, or a camera of the page's own.

    name: name of a camera of the scene; the other keys are left out then
    type: "perspective" or "orthographic"
    eye, target: position, and the point at which the camera looks, in world space
    up: direction that is upwards in the picture
    fov: vertical field of view of a perspective camera [degrees]
    height: height of the picture of an orthographic camera, in units of the scene
    """

    name: Text | None = None
    type: Literal["perspective", "orthographic"] | None = None
    eye: Vector | None = None
    target: Vector | None = None
    up: Vector | None = None
    fov: float | None = None
    height: float | None = None


class Variable(_Message):
    """A variable of an object's program.

    object: index of the object in the scene
    place: the file and the line in it, as `file:line`
    name: name of the variable, as the trace of a pixel gives it
    number: how many times the line has given it a value before
    """

    object: int = Field(ge=0, le=LARGEST_INDEX)
    place: Text
    name: Text
    number: int = Field(0, ge=0, le=LARGEST_INDEX)


class View(_Message):
    """Everything that a pane shows.

    camera: camera; None is the scene's own
    size: width and height [pixels]; None is the film's
    set: key -> value, of values that the page has changed, with keys as `--set` takes them
    shading: "flat", "gouraud" or "phong" for the whole picture; None leaves it to the scene
    layer: name of a layer; None is the picture
    paint: "nan" paints pixels whose value is NaN or infinite
    source: kind of the picture: "picture", "last_good", "previous", "reference", "heat", "variable" or "file:PATH"
    variable: the variable whose values are shown, if the source is "variable"
    """

    camera: ViewCamera | None = None
    size: Size | None = None
    set: dict[Text, JsonValue] = Field(default_factory=dict, max_length=1000)
    shading: Literal["flat", "gouraud", "phong"] | None = None
    layer: Text | None = None
    paint: Literal["nan"] | None = None
    source: Annotated[str, Field(pattern=SOURCES, max_length=4096)] = "picture"
    variable: Variable | None = None

    @property
    def is_slow(self) -> bool:
        """Whether the judge computes the picture, which takes seconds."""
        return self.source in ("reference", "heat", "variable")

    def table(self) -> dict[str, Any]:
        """Returns the view as the drawer and the judge take it: a camera holds only the keys that were given."""
        table = self.model_dump(exclude={"camera"})
        return {**table, "camera": self.camera and self.camera.model_dump(exclude_none=True)}


class ViewMessage(_Message):
    """Asks for a picture in each pane, in place of all views that were asked for before.

    number: number of the view, which the pictures' headers repeat
    moving: whether the next view follows at once, so that a JPEG picture at half the size may do
    panes: a view for each pane
    """

    type: Literal["view"]
    number: int = Field(ge=0, lt=1 << 53)
    moving: bool = False
    panes: Annotated[tuple[View, ...], Field(min_length=1, max_length=MOST_PANES)]


class ShownMessage(_Message):
    """Acknowledges pictures: the server sends the next one only then.

    number: number of the view
    pane: index of the pane; None acknowledges all panes
    """

    type: Literal["shown"]
    number: int = Field(ge=0, lt=1 << 53)
    pane: int | None = None


class PixelMessage(_Message):
    """Asks for the object ("pick") or the values ("probe") at a pixel.

    pane: index of the pane
    x, y: column and row from the top left of the full-size picture [pixels]
    """

    type: Literal["pick", "probe"]
    pane: int = Field(0, ge=0, lt=MOST_PANES)
    x: int = Field(ge=0, lt=LONGEST_SIDE)
    y: int = Field(ge=0, lt=LONGEST_SIDE)


class ObjectMessage(_Message):
    """Asks for the files of an object's program ("source"), or for the lines of it that lose digits ("digits").

    object: index of the object in the scene
    """

    type: Literal["source", "digits"]
    object: int = Field(ge=0, le=LARGEST_INDEX)


class PlainMessage(_Message):
    """Asks for a verdict on the view of the first pane ("judge"), or for the state and all pictures again ("reset")."""

    type: Literal["judge", "reset"]


class WriteMessage(_Message):
    """Asks to write values into the scene file.

    values: key -> value, with keys as `--set` takes them
    """

    type: Literal["write"]
    values: dict[Text, JsonValue] = Field(min_length=1, max_length=1000)


PageMessage: TypeAlias = ViewMessage | ShownMessage | PixelMessage | ObjectMessage | PlainMessage | WriteMessage
_MESSAGES: TypeAdapter[PageMessage] = TypeAdapter(Annotated[PageMessage, Field(discriminator="type")])


def parse(text: str) -> PageMessage:
    """Returns the message of a page. Errors: ValueError with one line that names the faulty key."""
    try:
        return _MESSAGES.validate_json(text)
    except ValidationError as error:
        raise ValueError(_line(error)) from None


def parse_view(query: Mapping[str, str]) -> View:
    """Returns the view that an address such as /frame.png?camera=NAME&size=640x480&layer=normal asks for.

    query: key -> text: "camera", "size" and "layer", each optional
    Errors: ValueError with one line that names the faulty key.
    """
    table: dict[str, Any] = dict(query)
    if "camera" in table:
        table["camera"] = {"name": table["camera"]}
    if "size" in table:
        table["size"] = table["size"].split("x")
    unknown = table.keys() - {"camera", "size", "layer"}
    if unknown:
        raise ValueError(f"unknown key {min(unknown)}; allowed: camera, size, layer")
    try:
        return View.model_validate(table)
    except ValidationError as error:
        raise ValueError(_line(error)) from None


def packed(pane: int, header: Mapping[str, Any], picture: bytes = b"") -> bytes:
    """Returns the binary message of a picture.

    The message is one byte for the version, one for the pane, four for the length of the header (big-endian), the header as
    JSON, and the bytes of the picture file.
    """
    text = as_json(header).encode()
    return struct.pack(">BBI", VERSION, pane, len(text)) + text + picture


def as_json(table: Mapping[str, Any]) -> str:
    """Returns a table as one line of JSON. JSON has no NaN and no infinity, so these become "nan", "inf" and "-inf"."""
    try:
        return json.dumps(table, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    except ValueError:
        return json.dumps(_finite(table), allow_nan=False, ensure_ascii=False, separators=(",", ":"))


def _finite(value: Any) -> Any:
    """Returns a JSON value with texts in place of NaN and infinities."""
    if isinstance(value, float) and value - value != 0:
        return str(value)
    if isinstance(value, Mapping):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return value


def _line(error: ValidationError) -> str:
    """Returns the first fault of a message as one line."""
    first = error.errors(include_url=False, include_context=False, include_input=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    return f"{place}: {first['msg']}" if place else first["msg"]
