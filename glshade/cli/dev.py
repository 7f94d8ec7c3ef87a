"""Command `glshade dev`: shows a scene in a browser, and draws it again when its files change."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli._options import Size, driver
from glshade.errors import MissingLibrary, printable

if TYPE_CHECKING:
    from glshade.live.loop import Redrawn
    from glshade.live.session import Settings

# SSH's usual port.
SSH_PORT = "22"


@click.command()
@click.argument("scene", metavar="SCENE", type=click.Path(path_type=Path))
@click.option("--port", type=click.IntRange(0, 65535), default=0, show_default=True, help="Port; 0 takes any free one.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address at which the server listens.")
@click.option(
    "--allow-host",
    "allowed",
    multiple=True,
    metavar="NAME[:PORT]",
    help="Further name under which browsers reach the server, such as localhost:9000 behind a tunnel. Repeatable.",
)
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@click.option(
    "--shaders",
    multiple=True,
    metavar="FOLDER",
    type=click.Path(exists=True, file_okay=False),
    help="Folder of GLSL files that replace glshade's files of the same names, such as brdf/phong.glsl. Repeatable.",
)
@click.option(
    "--models",
    multiple=True,
    metavar="FOLDER",
    type=click.Path(exists=True, file_okay=False),
    help="Folder of further reflectance models and lights. Its Python files are run, again after each change. Repeatable.",
)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replaces a value of the scene, as in `glshade render`. Repeatable.",
)
@click.option("--json", "as_json", is_flag=True, help="Prints the events to stdout, one JSON object a line.")
@click.option("--open", "opens", is_flag=True, help="Opens the page in a browser on this machine.")
@click.option("--no-server", is_flag=True, help="Draws to the file of -o after each change, without a page.")
@click.option("-o", "--output", type=click.Path(path_type=Path, dir_okay=False), help="Picture to write with --no-server.")
@driver
def command(
    scene: Path,
    port: int,
    host: str,
    allowed: tuple[str, ...],
    size: tuple[int, int] | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
    overrides: tuple[str, ...],
    as_json: bool,
    opens: bool,
    no_server: bool,
    output: Path | None,
    backend: Any,
    device: int | None,
) -> None:
    """Shows SCENE (.toml, .json, or a mesh file) in a browser, and draws it again when one of its files changes.

    The command prints the address of the page. The address holds a secret token: everybody with the token can see the
    picture and change the scene file. docs/live.md describes the page.
    """
    import asyncio

    if no_server != (output is not None):
        raise click.UsageError("--no-server and -o belong together")
    _check_libraries()
    from glshade.live.access import is_loopback
    from glshade.live.session import Settings

    if not is_loopback(host) and not allowed:
        raise click.UsageError("--host other than this machine needs --allow-host NAME, the name under which browsers reach it")
    if not scene.exists():
        raise click.UsageError(f"{scene}: there is no such file")
    report = _report_json if as_json else _report_text
    settings = Settings(str(scene), overrides, shaders, models, size, backend, device)
    if output is not None:
        asyncio.run(_redraw(settings, str(output), report))
        return
    asyncio.run(_serve(settings, "127.0.0.1" if host == "localhost" else host, port, allowed, opens, report))


async def _redraw(settings: Settings, output: str, report: Callable[[dict[str, Any]], None]) -> None:
    """Draws to a file until Ctrl-C. The arguments are those of the command."""
    from glshade.live.loop import redraw

    def redrawn(result: Redrawn) -> None:
        milliseconds = {"redraw": 1e3 * result.seconds}
        event = {"event": "revision", "revision": result.number, "ok": result.ok, "shown": 0, "problems": result.problems}
        report({**event, "milliseconds": milliseconds, "output": output})

    options = asdict(settings)
    await redraw(options.pop("scene"), output, redrawn, **options)


async def _serve(
    settings: Settings, host: str, port: int, allowed: tuple[str, ...], opens: bool, report: Callable[[dict[str, Any]], None]
) -> None:
    """Runs the server until Ctrl-C. The arguments are those of the command."""
    import secrets
    import webbrowser

    from glshade.live.access import Access, bracketed, hosts, is_loopback
    from glshade.live.server import Listener, serve
    from glshade.live.session import Session

    listener = Listener(host, port)
    access = Access(secrets.token_urlsafe(), hosts(host, listener.port, allowed))
    name = f"{bracketed(host)}:{listener.port}" if is_loopback(host) else allowed[0]
    if name not in access.hosts:
        name = f"{name}:{listener.port}"
    address = f"http://{name}/?token={access.token}"
    report({"event": "listening", "address": address, "tunnel": tunnel(os.environ, host, listener.port)})
    if opens:
        webbrowser.open(address)
    await serve(Session(settings, report), access, listener)


def tunnel(environment: Mapping[str, str], host: str, port: int) -> str | None:
    """Returns the command that makes a server on this machine reachable from the user's own; None if SSH is not in use.

    environment: environment variables
    host: loopback address at which the server listens
    port: its port
    """
    from glshade.live.access import bracketed

    # SSH's variable holds the client's address and port, and the server's.
    connection = environment.get("SSH_CONNECTION", "").split()
    if len(connection) != 4:
        return None
    _, _, address, ssh_port = connection
    user = environment.get("USER", "")
    login = f"{user}@{address}" if user else address
    other_port = "" if ssh_port == SSH_PORT else f" -p {ssh_port}"
    return f"ssh -N -L {port}:{bracketed(host)}:{port}{other_port} {login}"


def _check_libraries() -> None:
    """Checks that the libraries of the extra `live` are installed. Errors: MissingLibrary."""
    from importlib.util import find_spec

    missing = [name for name in ("starlette", "uvicorn", "websockets", "watchfiles", "tomlkit", "PIL") if not find_spec(name)]
    if missing:
        raise MissingLibrary(f"`glshade dev` needs {', '.join(missing)}: pip install 'glshade[live]'")


def _report_json(event: dict[str, Any]) -> None:
    """Prints an event as one line of JSON."""
    from glshade.live.wire import as_json

    click.echo(as_json(event))


def _report_text(event: dict[str, Any]) -> None:
    """Prints an event for people. The numbers of open pages are left out."""
    kind = event["event"]
    if kind == "listening":
        click.echo(f"Open {event['address']}")
        if event["tunnel"]:
            click.echo(f"From another machine, first run there: {event['tunnel']}")
    elif kind == "revision":
        _report_revision(event)
    elif kind in ("drawer", "refused"):
        click.echo(printable(event["text"]))


def _report_revision(event: dict[str, Any]) -> None:
    """Prints whether a revision is drawn, and its problems with the lines around them."""
    from glshade.problem import Problem

    number, shown = event["revision"], event["shown"]
    if event["ok"]:
        place = f" to {event['output']}" if "output" in event else ""
        click.echo(f"revision {number}: drawn{place} in {sum(event['milliseconds'].values()):.0f} ms")
    else:
        click.echo(f"revision {number}: not drawn" + (f"; the page shows revision {shown}" if shown else ""))
    for table in event["problems"]:
        fields = {key: value for key, value in table.items() if key != "caret"}
        text = Problem(**{**fields, "excerpt": tuple(table["excerpt"])}).text()
        click.echo("\n".join(printable(line) for line in text.split("\n")))
