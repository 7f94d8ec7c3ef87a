"""RenderRegression: the fixture `render_regression`, with which a test compares pictures."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.golden.judge import compare_files
from glshade.golden.pytest_plugin import checking, messages
from glshade.golden.pytest_plugin.checking import Request
from glshade.golden.pytest_plugin.names import default_name
from glshade.golden.pytest_plugin.pictures import take
from glshade.golden.pytest_plugin.process import Process
from glshade.golden.pytest_plugin.run import Run, shared_folder
from glshade.golden.rules import Rule
from glshade.golden.rules.codes import Codes
from glshade.scene.file import load
from glshade.scene.scene import Scene


class RenderRegression:
    """Compares the pictures of one test with baselines, with each other, or with the laws of pictures."""

    def __init__(self, run: Run, node_id: str) -> None:
        self._run, self._node_id = run, node_id
        self._names: set[str] = set()

    @classmethod
    def of(cls, process: Process, request: pytest.FixtureRequest) -> RenderRegression:
        """Returns the fixture's value for a test."""
        if process.active is None:
            process.active = Run(process, shared_folder(request.getfixturevalue("tmp_path_factory"), process))
        return cls(process.active, request.node.nodeid)

    def check(
        self,
        picture: object,
        *,
        name: str | None = None,
        rule: str | Rule | None = None,
        mask: NDArray[np.bool_] | None = None,
        overrides: Sequence[str] = (),
    ) -> None:
        """Fails the test unless a picture is the same as its baseline, or differs only as drivers may differ.

        picture: a glshade Image or Layers, a NumPy array, a picture of Pillow, the path of a PNG or EXR file, a Scene, or the
            path of a scene file.
        name: the baseline's path in the folder of baselines, with or without its suffix; by default it is made from the test's
            node id (glshade.golden.pytest_plugin.names).
        rule: a rule or its name; by default, the rule in the baseline's sidecar, and else `codes`.
        mask: (H, W), True where a pixel is left out.
        overrides: for a scene file, values that replace those of the file, such as "film.size=[96, 54]".
        """
        __tracebackhide__ = True
        self._check(lambda: picture, True, name, rule=rule, mask=mask, overrides=overrides)

    def check_drawn(
        self,
        draw: Callable[[], object],
        *,
        name: str | None = None,
        rule: str | Rule | None = None,
        mask: NDArray[np.bool_] | None = None,
    ) -> None:
        """Does the same as `check` with the picture that a function returns; --glshade-stability calls it several times."""
        __tracebackhide__ = True
        self._check(draw, False, name, rule=rule, mask=mask)

    def same(self, a: object, b: object) -> None:
        """Fails the test unless two pictures are the same by the rule `codes`. No baseline is needed.

        a, b: as `picture` of `check`.
        """
        __tracebackhide__ = True
        _fail(lambda: self._difference(a, b))

    def laws(self, scene: object) -> None:
        """Fails the test if a scene, drawn by the GPU or by the reference, breaks a law of pictures (docs/laws.md).

        scene: a Scene, or the path of a scene file.
        """
        __tracebackhide__ = True
        _fail(lambda: self._broken_laws(scene))

    def digits(self, model: object, *, limit: float = 1e-6) -> None:
        """Fails the test if a line of a model's GLSL loses digits in float32 (docs/digits.md).

        model: a model's name or class, or a material.
        limit: the loss that a line may have, relative to the result. Lines that are not to blame may lose more.
        """
        __tracebackhide__ = True
        _fail(lambda: self._lost_digits(model, limit))

    def _check(self, draw: Callable[[], object], ready_made: bool, name: str | None, **options: Any) -> None:
        """Compares a picture with its baseline, and fails the test unless they are the same.

        draw: a function that returns the picture.
        ready_made: whether it returns the same object each time.
        name, options: the arguments of `check`.
        """
        __tracebackhide__ = True
        # An error in the test's own function is the test's, with its traceback.
        given = draw()

        def wrong() -> str:
            request = Request.of(self._node_id, draw, ready_made, **options)
            picture = take(given, self._run.renderer, request.overrides)
            whole = checking.full_name(default_name(self._node_id) if name is None else name, picture.suffix)
            self._claim(whole)
            with tempfile.TemporaryDirectory(prefix="glshade-") as folder:
                return checking.run_check(self._run, request, picture, whole, Path(folder))

        _fail(wrong)

    def _difference(self, a: object, b: object) -> str:
        """Returns the difference of two pictures; empty if they are the same. Errors: GlshadeError, OSError."""
        with tempfile.TemporaryDirectory(prefix="glshade-") as folder:
            paths = []
            for letter, given in (("a", a), ("b", b)):
                picture = take(given, self._run.renderer)
                paths.append(Path(folder) / f"{letter}{picture.suffix}")
                picture.write(paths[-1])
            result = compare_files(paths[0], paths[1], Codes(), name="a and b")
            if not result.outcome:
                return ""
            kept = messages.keep(paths, self._run.settings.results / "same" / default_name(self._node_id))
            return messages.not_same(result, kept, self._run.settings.start)

    def _broken_laws(self, given: object) -> str:
        """Returns the laws that a scene breaks, a line each; empty if it breaks none. Errors: GlshadeError, OSError."""
        # Most tests need no float64 reference.
        from glshade.verification.laws import LAWS, check_laws

        if not isinstance(given, Scene | str | os.PathLike):
            raise GlshadeError(f"laws() needs a Scene or the path of a scene file, not {type(given).__qualname__}")
        scene = given if isinstance(given, Scene) else load(Path(given))
        findings = list(check_laws(scene, renderer=self._run.renderer()))
        return "\n".join(messages.broken_law(finding, LAWS[finding.law]) for finding in findings if finding.broken)

    def _lost_digits(self, model: object, limit: float) -> str:
        """Returns the lines of a model that lose more digits than allowed, a line each; empty if there is none.

        Errors: GlshadeError.
        """
        from glshade.brdfs import BRDFS, Brdf
        from glshade.catalogue.digits import digits_of_material, digits_of_model
        from glshade.document import nearest

        if isinstance(model, Brdf):
            found = digits_of_material(model)
        elif isinstance(model, type) and issubclass(model, Brdf):
            found = digits_of_model(model)
        elif isinstance(model, str) and model in BRDFS:
            found = digits_of_model(BRDFS[model])
        else:
            raise GlshadeError(f"digits() needs a model or a material; no model is named {model!r}{nearest(str(model), BRDFS)}")
        lines = [f"{loss.place}: loses {loss.loss:.1e} of the result: {loss.text}" for loss in found.bad if loss.loss > limit]
        return "\n".join(lines)

    def _claim(self, name: str) -> None:
        """Notes that the test uses a baseline. Errors: GlshadeError where it is used already."""
        if name in self._names:
            raise GlshadeError(f"the test uses the baseline {name} twice; give each check a name= of its own")
        self._names.add(name)
        self._run.claim(name, self._node_id)


def _fail(check: Callable[[], str]) -> None:
    """Fails the test with the message that a function returns, or with that of an error on purpose or of the system.

    An empty message lets the test go on. There is no traceback, because the message says all.
    """
    __tracebackhide__ = True
    try:
        message = check()
    except (GlshadeError, OSError, MemoryError) as error:
        message = str(error) or "there is not enough memory"
    # Outside of the handler, or pytest would print the error that was caught, too.
    if message:
        pytest.fail(message, pytrace=False)
