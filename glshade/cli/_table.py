"""Tables: prints rows and texts of commands, formatted by rich on a terminal, and elsewhere as plain text for programs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import click

# A cell of a table: its text, or (text, style of rich).
Cell = str | tuple[str, str]


def on_terminal() -> bool:
    """Returns whether stdout is a terminal."""
    return sys.stdout.isatty()


def chosen(names: Sequence[str], known: Mapping[str, Any], what: str) -> list[str]:
    """Returns the given names, or all known names if no name is given.

    names: names from the command line
    known: the known names, as keys
    what: noun for the error message, such as "model"
    Errors: click.BadParameter for an unknown name, with the nearest known one.
    """
    from glshade.document import nearest

    for name in names:
        if name not in known:
            raise click.BadParameter(f"no {what} is named {name!r}{nearest(name, known)}", param_hint="'NAME'")
    return list(names) or list(known)


def as_json(value: Any) -> None:
    """Prints a value as indented JSON."""
    import json

    click.echo(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))


def table(heads: Sequence[str], rows: Sequence[Sequence[Cell]]) -> None:
    """Prints a table with these headings and rows."""
    if on_terminal():
        _rich_table(heads, rows)
        return
    plain = [list(heads), *([cell if isinstance(cell, str) else cell[0] for cell in row] for row in rows)]
    widths = [max(len(row[i]) for row in plain) for i in range(len(heads))]
    for row in plain:
        click.echo("  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def _rich_table(heads: Sequence[str], rows: Sequence[Sequence[Cell]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    result = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False)
    for index, head in enumerate(heads):
        # The first column holds names, which must not be wrapped.
        result.add_column(head, style="cyan" if index == 0 else None, no_wrap=index == 0)
    for row in rows:
        result.add_row(*(Text(cell) if isinstance(cell, str) else Text(cell[0], style=cell[1]) for cell in row))
    Console(highlight=False).print(result)


def title(text: str, beside: str = "") -> None:
    """Prints a bold title, with a plain text beside it."""
    click.echo(click.style(text, bold=True) + (f"  {beside}" if beside else ""))


def paragraph(text: str, label: str = "") -> None:
    """Prints a text after its label. On a terminal it is wrapped to the width; elsewhere it stays on one line."""
    text = f"{label}: {text}" if label else text
    click.echo(click.wrap_text(text, width=_width(), preserve_paragraphs=True) if on_terminal() else text)


def _width() -> int:
    """Returns the width of the terminal [columns], at most 128, because longer lines are hard to read."""
    import shutil

    return min(shutil.get_terminal_size().columns, 128)


def each(names: Sequence[str], show: Callable[[str], None]) -> None:
    """Calls `show` with each name, and prints an empty line between."""
    for index, name in enumerate(names):
        if index:
            click.echo()
        show(name)


def value(given: Any) -> str:
    """Returns a default value as short text: one number for three equal numbers, and "-" for None (an optional value)."""
    if given is None:
        return "-"
    if isinstance(given, list):
        return value(given[0]) if len(given) == 3 and len(set(given)) == 1 else " ".join(value(item) for item in given)
    return f"{given:g}" if isinstance(given, float) else str(given)
