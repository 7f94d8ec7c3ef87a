"""Template: fills in a page, and forbids it to run or load anything that it was not written with."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from glshade.errors import GlshadeError
from glshade.files import replacing
from glshade.page.ramp import css
from glshade.version import __version__

HERE = Path(__file__).parent


def render(
    template: Path, styles: Sequence[Path] = (), scripts: Sequence[Path] = (), *, beside: bool = False, **values: Any
) -> str:
    """Returns a page that extends base.html.j2.

    Texts are escaped where the template inserts them, and `tojson` writes values so that they cannot end a script. The page's
    Content-Security-Policy names the digests of its style and its script, so that a browser runs nothing else: an attribute
    `style` or `onclick` has no effect in it.

    template: the file of the template, whose folder is searched for the templates that it includes.
    styles, scripts: files that are added to the shared style and script. All scripts are one module.
    beside: True if the script loads further scripts from the page's folder.
    values: the values that the template names.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader([template.parent, HERE]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # Keep the order of keys, because it often has a meaning.
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False}
    style = css() + _joined([HERE / "style.css", *styles])
    script = _joined([HERE / "script.js", *scripts])
    return environment.get_template(template.name).render(
        policy="; ".join(_policy(style, script, beside)),
        style=Markup(style),
        script=Markup(script),
        version=__version__,
        **values,
    )


def _policy(style: str, script: str, beside: bool) -> Iterator[str]:
    """Yields the directives of the Content-Security-Policy (W3C, CSP level 3)."""
    # A page that is opened from a disk has no origin which 'self' could mean, so the scheme is named as well.
    folder = " 'self' file:"
    yield "default-src 'none'"
    yield f"img-src data:{folder}"
    yield f"style-src '{_digest(style)}'"
    yield f"script-src '{_digest(script)}'{folder if beside else ''}"
    yield "base-uri 'none'"
    yield "form-action 'none'"


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _joined(files: Sequence[Path]) -> str:
    return "".join(file.read_text(encoding="utf-8") for file in files)


def write(path: Path, text: str) -> None:
    """Writes a text file, whole or not at all. Errors: GlshadeError."""
    try:
        with replacing(path) as temporary:
            # Half of a surrogate pair, which a file's name may hold, cannot be written as UTF-8.
            temporary.write_text(text, encoding="utf-8", errors="replace", newline="\n")
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror or error}") from None
