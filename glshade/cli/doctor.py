"""glshade doctor: what works here, and what to do where it does not."""

from __future__ import annotations

from collections.abc import Callable

import click


@click.command()
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
def command(backend: str, device: int | None) -> None:
    """Checks libraries, driver, context and a picture, in plain words. Exit code 5 where no picture can be drawn."""
    import platform
    from importlib.metadata import version

    from glshade import __version__
    from glshade.errors import GlshadeError

    click.echo(f"glshade {__version__}, Python {platform.python_version()}, {platform.platform()}")
    names = ("moderngl", "glcontext", "numpy", "OpenImageIO", "trimesh")
    click.echo("libraries: " + ", ".join(f"{name} {version(name)}" for name in names))
    checks: list[Callable[[], str]] = [_devices, lambda: _context(backend, device), lambda: _picture(backend, device)]
    for check in checks:
        try:
            click.echo(check())
        except GlshadeError as error:
            click.echo(f"NOT WELL: {error}")
            raise SystemExit(5) from None
    click.echo("all is well")


def _devices() -> str:
    import sys

    from glshade.errors import GlshadeError
    from glshade.gl.context import LIBEGL, devices

    if not sys.platform.startswith("linux"):
        return "EGL: not used on this platform"
    try:
        found = devices()
    except GlshadeError as error:
        # Not the end: OSMesa may serve.
        return f"EGL: {error}"
    return f"EGL: {LIBEGL} loads; " + "; ".join(
        f"device {d.index}: {d.vendor} ({'software' if d.is_software else 'hardware'})" for d in found
    )


def _context(backend: str, device: int | None) -> str:
    from glshade.gl.context import open_context

    context = open_context(backend, device)  # type: ignore[arg-type]
    depth = "reversed, 0 to 1" if context.zero_to_one else "reversed, -1 to 1 (no glClipControl: far surfaces may flicker)"
    text = (
        f"OpenGL: {context.renderer}, {context.version} ({context.backend})\n"
        f"limits: pictures of {context.largest_side} pixels a side in one piece, {context.gl.max_samples} samples a pixel "
        f"(more are drawn in several passes); depth {depth}"
    )
    context.release()
    return text


def _picture(backend: str, device: int | None) -> str:
    import numpy as np

    from glshade.errors import ContextError
    from glshade.gl.renderer import render
    from glshade.scene import Scene

    white = {"brdf": "ambient", "ka": 1.0}
    scene = Scene.model_validate(
        {
            "objects": [{"shape": "plane", "transform": {"rotate": [90, 0, 0]}, "material": white}],
            "lights": [{"type": "ambient", "intensity": 0.5}],
            "camera": {"type": "orthographic", "eye": [0, 0, 1], "target": [0, 0, 0], "height": 2},
            "film": {"size": [16, 16]},
        }
    )
    pixels = render(scene, dtype="float32", backend=backend, device=device).pixels  # type: ignore[arg-type]
    if not np.all(pixels == 0.5):
        raise ContextError(f"a grey of 0.5 came out as {pixels.min():g} to {pixels.max():g}: the driver is not to be trusted")
    return "picture: a grey of 0.5 came out as 0.5"
