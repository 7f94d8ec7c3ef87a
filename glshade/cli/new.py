"""Command `glshade new`: writes the files to start from when you add something of your own.

Each folder in `_templates` is a kind. The name `example` in its files stands for the chosen name, and `Example` for the name of
its class.
"""

from __future__ import annotations

import re
from pathlib import Path

import click

TEMPLATES = Path(__file__).parent / "_templates"
KINDS = tuple(sorted(path.name for path in TEMPLATES.iterdir() if path.is_dir()))
# A name of a model: small letters, digits and single underscores between them.
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")


@click.command()
@click.argument("kind", type=click.Choice(KINDS))
@click.argument("name")
@click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("models"),
    show_default=True,
    help="Folder to write the files to; it is made if need be.",
)
def command(kind: str, name: str, folder: Path) -> None:
    """Writes the files to start from for a new KIND that is called NAME.

    A brdf is a reflectance model: NAME.glsl, which the GPU runs, and NAME.py, which computes the same in float64. Both are
    complete, so that a scene can use the model at once, and its pictures are verified. Files that exist are never replaced.
    """
    from glshade.brdfs import BRDFS

    if not _NAME.fullmatch(name):
        raise click.BadParameter(f"{name!r} is no name such as shiny_thing", param_hint="'NAME'")
    if name in BRDFS:
        raise click.BadParameter(f"a model that ships with glshade is named {name!r}", param_hint="'NAME'")
    texts = {
        folder / path.name.replace("example", name): path.read_text(encoding="utf-8")
        for path in sorted((TEMPLATES / kind).iterdir())
        if path.is_file()
    }
    taken = next((path for path in texts if path.exists()), None)
    if taken is not None:
        raise click.UsageError(f"{taken} exists already")
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        text = re.sub(r"\bexample:", f"{name}:", text.replace("Example", BRDFS.class_name(name)))
        path.write_text(text.replace('"example"', f'"{name}"'), encoding="utf-8")
        click.echo(path)
    click.echo(f'A scene uses the model by material = {{ brdf = "{name}" }}. Then:')
    for tried in ("render", "verify", "check"):
        click.echo(f"  glshade {tried} SCENE --models {folder}")
