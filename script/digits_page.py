"""Makes the pictures of docs/digits.md, and the lines that the page quotes, from the files that stand on the page.

script/make-digits calls it.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from pages import write

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "digits.md"
IMAGES = ROOT / "docs" / "images"
# A file of the page: its path, then a block of its text.
FILE = re.compile(r"`([\w./-]+)`:\n\n```\w+\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)
# The page quotes what the command prints between this mark and the end of the block after it.
QUOTED = re.compile(r"<!-- lines -->\n(?:\n```\n.*?^```\n)?", flags=re.MULTILINE | re.DOTALL)
# The figures of a quoted line. Another version of NumPy may round them in another way, so they are not compared.
FIGURES = re.compile(r" +\d\.\de[+-]\d\d +\d\.\d +\d\.\de[+-]\d\d +")
PICTURES = {"wrong.png": "digits-wrong.png", "map.png": "digits-map.png", "right.png": "digits-right.png"}


def main(check: bool) -> str | None:
    """Writes the pictures and the page, or says what is out of date.

    check: whether to compare the page in place of writing.
    """
    text = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path, content in FILE.findall(text):
            (folder / path).parent.mkdir(exist_ok=True)
            (folder / path).write_text(content, encoding="utf-8")
        commands = re.findall(r"^    glshade ((?:render|digits) ball.toml .*)$", text, flags=re.MULTILINE)
        printed = [_run(command, folder) for command in commands if not check or "--map" in command]
        lines = next(output for output in printed if output.startswith("line"))
        page = QUOTED.sub(lambda _: f"<!-- lines -->\n\n```\n{_table(lines)}```\n", text)
        if check:
            same = FIGURES.sub("", page) == FIGURES.sub("", text)
            return None if same else "docs/digits.md quotes other lines than it should: run script/make-digits"
        for made, kept in PICTURES.items():
            (IMAGES / kept).write_bytes((folder / made).read_bytes())
    write(PAGE, page)
    return None


def _run(command: str, folder: Path) -> str:
    """Returns what a command of glshade prints."""
    done = subprocess.run(
        [sys.executable, "-m", "glshade", *command.split()], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout


def _table(output: str) -> str:
    """Returns the table that `glshade digits` printed, without ill-posed lines; shader files have paths below shaders/."""
    table = output.split("\n\n")[0].replace(f"{ROOT / 'shaders'}/", "")
    rows = [re.split(r"  +", row) for row in table.splitlines() if "ill-posed" not in row]
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    return "".join(
        "  ".join([*(f"{cell:{width}}" for cell, width in zip(row, widths, strict=False)), row[-1]]) + "\n" for row in rows
    )


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv[1:]))
