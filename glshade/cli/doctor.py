"""Command `glshade doctor`: checks whether pictures can be drawn on this machine, and measures the driver."""

from __future__ import annotations

from typing import Any

import click

from glshade.cli._options import driver


@click.command()
@driver
@click.option("--json", "as_json", is_flag=True, help="Prints the results as one JSON object.")
def command(backend: str, device: int | None, as_json: bool) -> None:
    """Checks whether pictures can be drawn.

    Checks the libraries, EGL, a context and a picture, and measures the driver. The exit code is 5 if no picture can be drawn.
    """
    from glshade.errors import GlshadeError

    results: dict[str, Any] = {"well": False, "error": None}
    say = _nothing if as_json else click.echo
    try:
        _examine(results, backend, device, say)
    except GlshadeError as error:
        results["error"] = str(error)
        say(f"NOT WELL: {error}")
    if as_json:
        import json

        click.echo(json.dumps(results, indent=2, allow_nan=False))
    if results["error"] is not None:
        raise SystemExit(5)


def _nothing(text: str) -> None:
    """Prints nothing; takes the place of click.echo if only JSON is to be printed."""


def _examine(results: dict[str, Any], backend: str, device: int | None, say: Any) -> None:
    """Runs the checks, and reports each result as soon as it is known.

    results: dictionary that the results are added to
    backend: OpenGL backend, as for Renderer
    device: EGL device; None leaves the choice to the driver
    say: function that prints a line
    Errors: ContextError and ShaderError if no picture can be drawn.
    """
    import platform
    from importlib.metadata import version

    from glshade.driver.assumptions import check_assumptions
    from glshade.driver.measurement import measure
    from glshade.errors import GlshadeError
    from glshade.gl.context import open_context
    from glshade.version import __version__

    results |= {"glshade": __version__, "python": platform.python_version(), "platform": platform.platform()}
    say(f"glshade {__version__}, Python {results['python']}, {results['platform']}")
    names = ("moderngl", "glcontext", "numpy", "OpenImageIO")
    results["libraries"] = {name: version(name) for name in names}
    say("libraries: " + ", ".join(f"{name} {version}" for name, version in results["libraries"].items()))
    results["egl"] = _devices()
    say(_in_words(results["egl"]))
    context = open_context(backend, device)  # type: ignore[arg-type]
    try:
        results["opengl"] = {
            "renderer": context.renderer,
            "version": context.version,
            "backend": context.backend,
            "largest_side": context.largest_side,
            "samples": context.gl.max_samples,
            "zero_to_one": context.zero_to_one,
        }
        say(_limits(results["opengl"]))
        say(_picture(backend, device))
        results["well"] = True
        try:
            measured = measure(context)
        except GlshadeError as error:
            # The measurements are only extra information: a picture was drawn, so the driver works.
            results["measured"] = None
            say(f"not measured: {error}")
            say("all is well")
            return
        assumed = check_assumptions(context, measured)
    finally:
        context.release()
    results["measured"], results["assumptions"] = measured, [assumption.as_dict() for assumption in assumed]
    say("\n".join(["measured:", *(f"  {name:<17}{text}" for name, text in _table(measured))]))
    broken = [assumption for assumption in assumed if not assumption.holds]
    for assumption in broken:
        say(f"CAUTION: glshade assumes {assumption.what}; measured: {assumption.measured}. So {assumption.follows}")
    if broken:
        say(f"pictures can be drawn, with {len(broken)} caution{'s' if len(broken) > 1 else ''}")
    else:
        say("all is well")


def _devices() -> dict[str, Any]:
    """Returns a dictionary with EGL's library and devices, and the problem if EGL cannot be used (None if it can be)."""
    import sys
    from dataclasses import asdict

    from glshade.errors import GlshadeError
    from glshade.gl.context import devices
    from glshade.gl.egl import LIBEGL

    if not sys.platform.startswith("linux"):
        return {"library": None, "problem": "not used on this platform", "devices": []}
    try:
        return {"library": LIBEGL, "problem": None, "devices": [{**asdict(d), "software": d.is_software} for d in devices()]}
    except GlshadeError as error:
        # The check goes on, because OSMesa may work without EGL.
        return {"library": LIBEGL, "problem": str(error), "devices": []}


def _in_words(egl: dict[str, Any]) -> str:
    """Returns the result of `_devices` as a line."""
    if egl["problem"]:
        return f"EGL: {egl['problem']}"
    return f"EGL: {egl['library']} loads; " + "; ".join(
        f"device {d['index']}: {d['vendor']} ({'software' if d['software'] else 'hardware'})" for d in egl["devices"]
    )


def _limits(opengl: dict[str, Any]) -> str:
    """Returns the context's name and limits as two lines."""
    depth = "reversed, 0 to 1" if opengl["zero_to_one"] else "reversed, -1 to 1"
    return (
        f"OpenGL: {opengl['renderer']}, {opengl['version']} ({opengl['backend']})\n"
        f"limits: pictures of {opengl['largest_side']} pixels a side in one piece, {opengl['samples']} samples a pixel "
        f"(more are drawn in several passes); depth {depth}"
    )


def _picture(backend: str, device: int | None) -> str:
    """Draws a picture of uniform grey, and returns a line about it. Errors: ContextError if its values are wrong."""
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
        raise ContextError(f"a grey of 0.5 came out as {pixels.min():g} to {pixels.max():g}: the driver draws wrong values")
    return "picture: a grey of 0.5 came out as 0.5"


# Functions whose error is reported in units in the last place (ULP). The other functions have zeros. Near a zero, an error in
# ULP may be arbitrarily large, so their absolute error is reported instead.
_IN_ULP = ("+", "-", "*", "/", "sqrt", "inversesqrt", "exp2", "pow")

# Whether triangles are clipped at the sides of the view, in words.
_CLIPPING = {
    True: "triangles are clipped at the sides of the view",
    False: "triangles may reach beyond the sides of the view",
    None: "cannot be seen, because corners do not snap to a coarse grid",
}


def _level_of_detail(measured: dict[str, Any]) -> str:
    """Returns the rule for the level of detail in words."""
    rules = {
        "length": "from the longer of the two changes of texture coordinates per pixel",
        "largest": "from the largest component of the changes of texture coordinates per pixel, the least that OpenGL allows",
        "sum": "from the sum of the largest components of the changes per pixel, the most that OpenGL allows",
        None: "by no known rule; the range that OpenGL allows is assumed",
    }
    return f"{rules[measured['rule']]}; off by {measured['error']:.2g}"


def _table(measured: dict[str, Any]) -> list[tuple[str, str]]:
    """Returns the measurements that are of interest to people: (name, value)."""
    from glshade.driver.raster import FINEST

    functions, formats = measured["built_ins"], measured["formats"]
    timer, loops, bits = measured["timer_query"], measured["loop_rounds"], measured["subpixel_bits"]

    def feature(offered: bool, works: bool | None, words: tuple[str, str]) -> str:
        return words[0 if works else 1] if offered else "not offered"

    def rounds(count: int) -> str:
        return f"{count:,}" + (" or more" if count == loops["tried"] else ", where it stops without an error")

    denormals = ", ".join(
        f"{stage}: {'kept' if d['read'] and d['made'] else 'flushed when ' + ' and '.join(k for k in d if not d[k])}"
        for stage, d in measured["denormals"].items()
    )
    shift = measured["interpolation_shift_in_steps"]
    snapped = f"{FINEST} or more" if bits["measured"] == FINEST else str(bits["measured"])
    half, small = formats["RGBA16F"], formats["R11F_G11F_B10F"]
    return [
        ("error, ULP", ", ".join(f"{name} {functions[name]['ulp']:.2g}" for name in _IN_ULP)),
        ("error, absolute", ", ".join(f"{n} {f['absolute']:.1e}" for n, f in functions.items() if n not in _IN_ULP)),
        ("fma", feature(measured["fma"]["offered"], measured["fma"]["fused"], ("fused", "not fused"))),
        ("a * b + c", "contracted" if any(measured["contracted"].values()) else "two roundings"),
        ("precise", feature(measured["precise"]["offered"], measured["precise"]["kept"], ("kept", "not kept"))),
        ("mix(1e8, 1, 1)", f"{measured['mix_at_its_end']:g}"),
        ("denormals", denormals),
        ("loops", f"vertex {rounds(loops['vertex'])}; fragment {rounds(loops['fragment'])}"),
        ("RGBA16F", f"rounds {half['rounding']}, off by {half['relative']:.1e}; 70000 is stored as {half['70000']:g}"),
        (
            "R11F_G11F_B10F",
            f"rounds {small['rounding']}, off by {small['relative']:.1e}; -1 and less become {small['negative']:g}",
        ),
        ("codes", ", ".join(f"{name} {formats[name]['lsb']:.2f}" for name in ("RGB10_A2", "RGBA8", "SRGB8_ALPHA8")) + " off"),
        ("timer query", f"reports {timer['share']:.2f} of the wall-clock time"),
        ("sub-pixel bits", f"{snapped} (the driver reports {bits['told']})"),
        ("interpolation", f"from corners {'before' if abs(shift) < 0.1 else 'after'} they are snapped to the grid"),
        ("clipping", _CLIPPING[measured["clips_at_sides"]]),
        ("level of detail", _level_of_detail(measured["level_of_detail"])),
        ("filter weights", f"off by {measured['filter_weight_error']:.1e} texels"),
        ("sRGB decoding", f"off by {measured['srgb_decoding']['error']:.2g} of an 8-bit code"),
        ("table weights", f"off by {measured['table_weight_error']:.1e} texels"),
        ("samples", " ".join(f"({x:g}, {y:g})" for x, y in measured["sample_positions"]) or "none"),
    ]
