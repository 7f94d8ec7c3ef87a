"""swept: numbers of the scene are set to their own values, as sweeps with a single value set them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from numpy.typing import NDArray

from glshade.document import Document
from glshade.scene.override import apply, pairs
from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError

# The keys that are swept. All of them may have the value 0, which they have before they are set.
KEYS = frozenset({"intensity", "colour", "position", "translate", "rotate", "background", "exposure"})


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    written = _document(scene, lambda value: value)
    document = _document(scene, lambda value: [0.0] * len(value) if isinstance(value, tuple) else 0.0)
    sweeps = list(_sweeps(written, ""))
    if not sweeps:
        raise NotApplicableError(f"the scene sets none of the keys {', '.join(sorted(KEYS))}")
    for key, value in pairs(sweeps):
        document = apply(document, key, value)
    return draw(Scene.model_validate(document, context={"limits": scene.limits}))


def _document(value: Any, at_keys: Callable[[Any], Any]) -> Any:
    """Returns a part of a scene as a scene file holds it: tables, lists and values.

    at_keys: a function of each value whose key is one of KEYS, which returns the value to write.
    """
    if isinstance(value, Document):
        # A document made by its own class need not set the key that tells the class.
        written = value.model_fields_set | {"type", "brdf"}
        value = {key: getattr(value, key) for key in type(value).model_fields if key in written}
    if isinstance(value, Mapping):
        # A colour may be a spectrum, which is a table of its own.
        return {
            key: at_keys(item) if key in KEYS and not isinstance(item, Document) else _document(item, at_keys)
            for key, item in value.items()
        }
    if isinstance(value, list | tuple):
        return [_document(item, at_keys) for item in value]
    return value


def _sweeps(node: Any, key: str) -> Iterator[tuple[str, str]]:
    """Yields (dotted key, text of the value) for each value in a part of the document whose key is one of KEYS.

    key: the dotted key of the part.
    """
    if isinstance(node, Mapping):
        for name, value in node.items():
            inner = f'{key}."{name}"' if key else name
            if name in KEYS and not isinstance(value, Mapping):
                yield inner, repr(list(value) if isinstance(value, tuple) else value)
            else:
                yield from _sweeps(value, inner)
    elif isinstance(node, list):
        names = {item.get("name") for item in node if isinstance(item, Mapping)}
        for index, item in enumerate(node):
            # An item whose number is the name of another item cannot be found by its number.
            if str(index) not in names:
                yield from _sweeps(item, f"{key}[{index}]")


LAW = Law(name="swept", description="numbers are set as sweeps of one value set them", picture=_picture)
