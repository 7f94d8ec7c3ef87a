"""What the scripts that write docs/ share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from glshade.files import replacing


def table(heading: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table of GitHub's Markdown; what cells hold is taken as it is, but for the bars that would end them."""
    lines = [heading, ["---"] * len(heading), *([str(cell).replace("|", "\\|") for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines).replace("| --- " * len(heading), "|---" * len(heading))


def write(path: Path, text: str) -> None:
    """The file appears whole or not at all."""
    with replacing(path) as beside:
        beside.write_text(text, encoding="utf-8")
