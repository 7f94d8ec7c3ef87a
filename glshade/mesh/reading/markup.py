"""Markup: parses the XML in mesh files.

XML from a stranger can ask for files, addresses and huge texts by its document type definition (entities). No mesh format needs
one, so that a file with one is refused, and nothing else in XML makes the parser fetch or repeat anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeAlias
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from glshade.errors import printable
from glshade.mesh.reading.file import MeshFile

# The deepest nesting of elements. COLLADA nests one node in another; a chain of nodes may be as long in a scene file.
_DEEPEST = 512
# The elements that `tree` keeps, about 150 bytes each. Polygons with an element each take the most of them.
_MOST_ELEMENTS = 4_000_000

Start: TypeAlias = Callable[[str, dict[str, str]], object]


def parse(
    file: MeshFile,
    place: str,
    chunks: Iterable[bytes],
    start: Start,
    end: Callable[[str], object] | None = None,
    text: Callable[[str], object] | None = None,
) -> None:
    """Parses XML and calls functions for what it holds. Names of elements and attributes come without their prefixes.

    place: what precedes a message, such as the name of a file within an archive.
    start: gets the name and the attributes of an element that begins. Errors: KeyError and ValueError become AssetErrors.
    end: gets the name of an element that ends.
    text: gets pieces of text.
    Errors: AssetError, with the line.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.buffer_size = 1 << 20
    depth = 0

    def begin(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise file.fail(f"{place}line {parser.CurrentLineNumber}: elements are nested more than {_DEEPEST} deep")
        name = name.rpartition(":")[2]
        try:
            start(name, attributes)
        except (KeyError, ValueError, OverflowError):
            wrong = f"<{printable(name[:40])}> lacks an attribute, or has one that cannot be read"
            raise file.fail(f"{place}line {parser.CurrentLineNumber}: {wrong}") from None

    def finish(name: str) -> None:
        nonlocal depth
        depth -= 1
        if end is not None:
            end(name.rpartition(":")[2])

    def refuse(*_: object) -> None:
        raise file.fail(
            f"{place}line {parser.CurrentLineNumber}: has a document type (<!DOCTYPE>), which is not read; remove it"
        )

    parser.StartElementHandler = begin
    parser.EndElementHandler = finish
    parser.StartDoctypeDeclHandler = refuse
    if text is not None:
        parser.CharacterDataHandler = text
    try:
        for chunk in chunks:
            parser.Parse(chunk, False)
        parser.Parse(b"", True)
    except expat.ExpatError as error:
        early = error.code in _EARLY
        problem = "the XML ends too early; is the file truncated?" if early else "the text is not XML"
        raise file.fail(f"{place}line {error.lineno}, column {error.offset + 1}: {problem}") from None
    except (LookupError, UnicodeError):
        raise file.fail(f"{place}the XML is in a text encoding that is not known") from None


# Expat's numbers for a document that has no element yet, ends within a tag, or ends with elements open.
_EARLY = {expat.errors.codes[text] for text in (expat.errors.XML_ERROR_NO_ELEMENTS, expat.errors.XML_ERROR_UNCLOSED_TOKEN)}


def tree(file: MeshFile, data: bytes) -> Element:
    """Returns the root of an XML document. Names of elements have no prefixes. Errors: AssetError, with the line."""
    builder = TreeBuilder()
    count = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > _MOST_ELEMENTS:
            raise file.fail(f"has more than {_MOST_ELEMENTS:,} XML elements")
        builder.start(name, attributes)

    parse(file, "", [data], start, builder.end, builder.data)
    return builder.close()


def words(text: str) -> list[float]:
    """Returns the numbers of a short text. Some programs write a comma in place of the point. Errors: ValueError."""
    return [float(word) for word in text.replace(",", ".").split()]
