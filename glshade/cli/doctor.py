"""glshade doctor: what works here, what the driver really does, and what to do where it does not."""

from __future__ import annotations

from typing import Any

import click


@click.command()
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout, for keeping.")
def command(backend: str, device: int | None, as_json: bool) -> None:
    """Checks libraries, driver, context and a picture, and measures the driver. Exit code 5 where no picture can be drawn."""
    from glshade.errors import GlshadeError

    found: dict[str, Any] = {"well": False, "error": None}
    say = _nothing if as_json else click.echo
    try:
        _examine(found, backend, device, say)
    except GlshadeError as error:
        found["error"] = str(error)
        say(f"NOT WELL: {error}")
    if as_json:
        import json

        click.echo(json.dumps(found, indent=2, allow_nan=False))
    if found["error"] is not None:
        raise SystemExit(5)


def _nothing(text: str) -> None:
    """Where JSON alone is asked for."""


def _examine(found: dict[str, Any], backend: str, device: int | None, say: Any) -> None:
    """Fills `found`, and says each thing as it is known. Errors: ContextError and ShaderError where no picture can be drawn."""
    import platform
    from importlib.metadata import version

    from glshade.driver.measurement import assumptions, measure
    from glshade.errors import GlshadeError
    from glshade.gl.context import open_context
    from glshade.version import __version__

    found |= {"glshade": __version__, "python": platform.python_version(), "platform": platform.platform()}
    say(f"glshade {__version__}, Python {found['python']}, {found['platform']}")
    names = ("moderngl", "glcontext", "numpy", "OpenImageIO", "trimesh")
    found["libraries"] = {name: version(name) for name in names}
    say("libraries: " + ", ".join(f"{name} {version}" for name, version in found["libraries"].items()))
    found["egl"] = _devices()
    say(_in_words(found["egl"]))
    context = open_context(backend, device)  # type: ignore[arg-type]
    try:
        found["opengl"] = {
            **{"renderer": context.renderer, "version": context.version, "backend": context.backend},
            **{"largest_side": context.largest_side, "samples": context.gl.max_samples, "zero_to_one": context.zero_to_one},
        }
        say(_limits(found["opengl"]))
        say(_picture(backend, device))
        found["well"] = True
        try:
            measured = measure(context)
        except GlshadeError as error:
            # A picture was drawn all the same.
            found["measured"] = None
            say(f"not measured: {error}")
            say("all is well")
            return
        assumed = assumptions(context, measured)
    finally:
        context.release()
    found["measured"], found["assumptions"] = measured, [one.as_dict() for one in assumed]
    say("\n".join(["measured:", *(f"  {name:<17}{text}" for name, text in _table(measured))]))
    broken = [one for one in assumed if not one.holds]
    for one in broken:
        say(f"CAUTION: glshade assumes {one.what}; here: {one.measured}. So {one.follows}")
    say(f"a picture is drawn, but mind {len(broken)} caution{'s' * (len(broken) > 1)}" if broken else "all is well")


def _devices() -> dict[str, Any]:
    """What EGL offers; where it has nothing, why."""
    import sys
    from dataclasses import asdict

    from glshade.errors import GlshadeError
    from glshade.gl.context import LIBEGL, devices

    if not sys.platform.startswith("linux"):
        return {"library": None, "problem": "not used on this platform", "devices": []}
    try:
        return {"library": LIBEGL, "problem": None, "devices": [{**asdict(d), "software": d.is_software} for d in devices()]}
    except GlshadeError as error:
        # Not the end: OSMesa may serve.
        return {"library": LIBEGL, "problem": str(error), "devices": []}


def _in_words(egl: dict[str, Any]) -> str:
    if egl["problem"]:
        return f"EGL: {egl['problem']}"
    return f"EGL: {egl['library']} loads; " + "; ".join(
        f"device {d['index']}: {d['vendor']} ({'software' if d['software'] else 'hardware'})" for d in egl["devices"]
    )


def _limits(opengl: dict[str, Any]) -> str:
    depth = "reversed, 0 to 1" if opengl["zero_to_one"] else "reversed, -1 to 1"
    return (
        f"OpenGL: {opengl['renderer']}, {opengl['version']} ({opengl['backend']})\n"
        f"limits: pictures of {opengl['largest_side']} pixels a side in one piece, {opengl['samples']} samples a pixel "
        f"(more are drawn in several passes); depth {depth}"
    )


def _picture(backend: str, device: int | None) -> str:
    import numpy as np

    from glshade.errors import ContextError
    from glshade.gl.renderer import render
    from glshade.scene.scene import Scene

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


# Those whose error is told in units of the last place; the others' near their zeros is nothing but that.
_IN_ULP = ("+", "-", "*", "/", "sqrt", "inversesqrt", "exp2", "pow")


def _table(measured: dict[str, Any]) -> list[tuple[str, str]]:
    """name, value: what a person wants to see of the measurements."""
    functions, formats = measured["built_ins"], measured["formats"]
    timer, loops, bits = measured["timer_query"], measured["loop_rounds"], measured["subpixel_bits"]

    def said(offered: bool, held: bool | None, words: tuple[str, str]) -> str:
        return words[0 if held else 1] if offered else "not offered"

    def rounds(count: int) -> str:
        return f"{count:,}" + (" or more" if count == loops["tried"] else ": stops there without a word")

    denormals = ", ".join(
        f"{stage}: {'kept' if d['read'] and d['made'] else 'flushed when ' + ' and '.join(k for k in d if not d[k])}"
        for stage, d in measured["denormals"].items()
    )
    shift = measured["interpolation_shift_in_steps"]
    half, small = formats["RGBA16F"], formats["R11F_G11F_B10F"]
    return [
        ("error, ULP", ", ".join(f"{name} {functions[name]['ulp']:.2g}" for name in _IN_ULP)),
        ("error, absolute", ", ".join(f"{n} {f['absolute']:.1e}" for n, f in functions.items() if n not in _IN_ULP)),
        ("fma", said(measured["fma"]["offered"], measured["fma"]["fused"], ("fused", "not fused"))),
        ("a * b + c", "contracted" if any(measured["contracted"].values()) else "two roundings"),
        ("precise", said(measured["precise"]["offered"], measured["precise"]["kept"], ("kept", "not kept"))),
        ("mix(1e8, 1, 1)", f"{measured['mix_at_its_end']:g}"),
        ("denormals", denormals),
        ("loops", f"vertex {rounds(loops['vertex'])}; fragment {rounds(loops['fragment'])}"),
        ("RGBA16F", f"rounds {half['rounding']}, off by {half['relative']:.1e}; 70000 is stored as {half['70000']:g}"),
        (
            "R11F_G11F_B10F",
            f"rounds {small['rounding']}, off by {small['relative']:.1e}; -1 and less become {small['negative']:g}",
        ),
        ("codes", ", ".join(f"{name} {formats[name]['lsb']:.2f}" for name in ("RGB10_A2", "RGBA8", "SRGB8_ALPHA8")) + " off"),
        ("timer query", f"tells {timer['share']:.2f} of the time by the clock on the wall"),
        ("sub-pixel bits", f"{bits['measured']} (the driver says {bits['told']})"),
        ("interpolation", f"from corners {'as they are' if abs(shift) < 0.1 else 'as they are snapped'}"),
        ("samples", " ".join(f"({x:g}, {y:g})" for x, y in measured["sample_positions"]) or "none"),
    ]
