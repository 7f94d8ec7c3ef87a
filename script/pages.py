"""Functions that the scripts which write docs/ share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from glshade.files import replacing


def table(heading: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Returns a Markdown table. Cells may hold Markdown; only their vertical bars are escaped, because these would
    end a cell.
    """
    lines = [heading, ["---"] * len(heading), *([str(cell).replace("|", "\\|") for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines).replace("| --- " * len(heading), "|---" * len(heading))


def write(path: Path, text: str) -> None:
    """Replaces the file's text. A failure leaves the old file as it was."""
    with replacing(path) as beside:
        beside.write_text(text, encoding="utf-8")
