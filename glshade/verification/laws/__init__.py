"""Laws of pictures: changes of a scene whose effect on the picture is known, so that no second renderer is needed to test it.

Each module of this package without a leading underscore holds one law, under the name `LAW`. The module is named after the law,
with an underscore for each hyphen: "light-split" is in light_split.py.
"""

from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from glshade.scene.scene import Scene
from glshade.verification.laws._finding import Finding as Finding
from glshade.verification.laws._finding import findings
from glshade.verification.laws._law import Law as Law

_MODULES = sorted(path.stem for path in Path(__file__).parent.glob("[!_]*.py"))
_ALL: list[Law] = [import_module(f"{__name__}.{module}").LAW for module in _MODULES]
# name -> law
LAWS: dict[str, Law] = {law.name: law for law in _ALL}


def check_laws(scene: Scene, names: Iterable[str] = LAWS, *, renderer: Any = None) -> Iterator[Finding]:
    """Yields one Finding for each law and each renderer that draws it.

    The laws are tried on the whole picture with one sample a pixel, without the film's crop and without `quality.refine`.
    names: the names of the laws; the default is all of them.
    renderer: optional, the Renderer that draws each law on the GPU. Each law is always drawn by the float64 reference.
    Errors: KeyError for a name that is no law; SceneError; with a renderer also ShaderError and ContextError.
    """
    return findings(scene, [LAWS[name] for name in names], renderer)
