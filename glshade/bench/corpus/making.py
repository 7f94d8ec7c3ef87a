"""Making: writes the pairs of the corpus to a folder. What exists there already is not drawn again.

FOLDER/corpus.json                              the seed and the size of the pictures
FOLDER/SCENE/scene.json, baseline.png or .exr   a scene and its baseline
FOLDER/SCENE/regressions/KIND-STRENGTH.png      test pictures; the strength is a number from 1, the strongest, to 3
FOLDER/SCENE/noises/KIND.png
FOLDER/SCENE/.../KIND.none                      the kind does not apply to the scene
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from glshade.bench.corpus.case import Case, write_pixels
from glshade.bench.corpus.drawing import draw_elsewhere, draw_file
from glshade.bench.corpus.kinds import Noise
from glshade.bench.corpus.noises import NOISES
from glshade.bench.corpus.regressions import REGRESSIONS
from glshade.bench.corpus.scenes import FLOATS, SCENES, SIZE, write_scene
from glshade.errors import GlshadeError
from glshade.files import replacing
from glshade.gl.preparation import ApproximateWarning
from glshade.scene.file import load

Group = Literal["regressions", "noises"]
# The version of the corpus's files. A folder of another version is refused, because its pairs are others.
VERSION = 1


@dataclass(frozen=True, order=True)
class Item:
    """A pair that may be made.

    scene: the scene's name.
    group: regressions or noises.
    kind: the kind's name.
    strength: the number of the strength, 1 for the strongest; 0 for noise.
    """

    scene: str
    group: Group
    kind: str
    strength: int = 0

    def path(self, folder: Path) -> Path:
        """Returns the file of the test picture."""
        name = f"{self.kind}-{self.strength}" if self.strength else self.kind
        return folder / self.scene / self.group / f"{name}{suffix(self.scene)}"


@dataclass(frozen=True)
class Made:
    """A pair in the folder.

    item: which pair it is.
    scene: the scene's file.
    reference, test: the files of the pictures.
    """

    item: Item
    scene: Path
    reference: Path
    test: Path


def suffix(scene: str) -> str:
    """Returns the suffix of the pictures of a scene."""
    return ".exr" if scene in FLOATS else ".png"


def planned(count: int | None = None, seed: int = 0) -> list[Item]:
    """Returns the pairs of the corpus, sorted. count: the number of pairs, which are chosen at random; None for all of them."""
    items: list[Item] = []
    for scene in SCENES:
        for regression in REGRESSIONS.values():
            items += [Item(scene, "regressions", regression.name, 1 + k) for k in range(len(regression.strengths))]
        items += [Item(scene, "noises", name) for name in NOISES]
    if count is not None and count < len(items):
        # The kinds' order must not depend on the folders of modules, so that a seed always means the same pairs.
        items.sort()
        items = [items[k] for k in np.random.default_rng(seed).permutation(len(items))[:count]]
    return sorted(items)


def make(
    folder: Path,
    items: Iterable[Item],
    seed: int = 0,
    size: tuple[int, int] = SIZE,
    report: Callable[[str], None] = lambda text: None,
) -> Iterator[Made | Item]:
    """Writes the pairs that the folder lacks, scene by scene, and yields every pair; an Item where its kind does not apply.

    seed: the number from which random kinds follow.
    size: width and height of the pictures [pixels].
    report: is called with a line about each driver that cannot be used.
    Errors: GlshadeError for a folder of another corpus; ContextError; OSError.
    """
    from glshade.gl.renderer import Renderer

    items = sorted(items)
    _check_folder(folder, seed, size)
    names = sorted({item.scene for item in items})
    scenes = {name: write_scene(folder, name, size) for name in names}
    lost = set(_drawn_elsewhere(folder, items, scenes, report))
    with ExitStack() as opened:
        renderer = None
        for name in names:
            reference = scenes[name].with_name(f"baseline{suffix(name)}")
            wanted = [item for item in items if item.scene == name]
            if not reference.exists() or any(_is_missing(item, folder) for item in wanted):
                renderer = renderer or opened.enter_context(Renderer())
                if not reference.exists():
                    draw_file(renderer, scenes[name], reference)
                case = Case(name, load(scenes[name]), reference, renderer, seed)
            for item in wanted:
                path = item.path(folder)
                if item in lost:
                    yield item
                    continue
                if _is_missing(item, folder):
                    _write(case, item, path)
                yield Made(item, scenes[name], reference, path) if path.exists() else item


def _check_folder(folder: Path, seed: int, size: tuple[int, int]) -> None:
    """Writes the settings of a new folder, or checks those of an old one. Errors: GlshadeError, OSError."""
    settings = {"version": VERSION, "seed": seed, "size": list(size)}
    path = folder / "corpus.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadeError(f"{folder}: the folder cannot be made: {error.strerror or error}") from None
    if not path.exists():
        if any(folder.iterdir()):
            raise GlshadeError(f"{folder}: is neither empty nor a corpus; give another folder")
        with replacing(path) as beside:
            beside.write_text(json.dumps(settings) + "\n", encoding="utf-8")
        return
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        found = None
    if found != settings:
        raise GlshadeError(f"{path}: the corpus was made with {found}, not with {settings}; give its seed, or another folder")


def _is_missing(item: Item, folder: Path) -> bool:
    """Returns whether neither a pair's test picture exists nor the note that its kind does not apply."""
    path = item.path(folder)
    return not path.exists() and not path.with_suffix(".none").exists()


def _write(case: Case, item: Item, path: Path) -> None:
    """Writes the test picture of a pair that needs no other driver, or notes that its kind does not apply."""
    path.parent.mkdir(parents=True, exist_ok=True)
    attributes: dict[str, str] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ApproximateWarning)
        if item.group == "regressions":
            regression = REGRESSIONS[item.kind]
            pixels = regression.make(case, regression.strengths[item.strength - 1])
            # A regression is drawn by the driver that drew the baseline.
            attributes = case.attributes
        else:
            noise = NOISES[item.kind]
            if noise.write is not None:
                noise.write(case, path)
                return
            pixels = noise.make(case) if noise.make else None
    if pixels is None:
        path.with_suffix(".none").touch()
    else:
        write_pixels(path, pixels, attributes)


def _drawn_elsewhere(
    folder: Path, items: Sequence[Item], scenes: dict[str, Path], report: Callable[[str], None]
) -> Iterator[Item]:
    """Draws the missing pictures of noises that other drivers draw, and yields those pairs that cannot be drawn."""
    for name in sorted({item.kind for item in items if item.group == "noises"}):
        noise = NOISES[name]
        if not noise.driver:
            continue
        wanted = [item for item in items if item.kind == name and _is_missing(item, folder)]
        for item in [item for item in wanted if not _is_capable(noise, scenes[item.scene])]:
            wanted.remove(item)
            item.path(folder).parent.mkdir(parents=True, exist_ok=True)
            item.path(folder).with_suffix(".none").touch()
        for item in wanted:
            item.path(folder).parent.mkdir(parents=True, exist_ok=True)
        if not wanted or not draw_elsewhere(noise.driver, [(scenes[item.scene], item.path(folder)) for item in wanted]):
            continue
        # A driver that crashes at one scene may draw the others.
        for item in (item for item in wanted if _is_missing(item, folder)):
            reason = draw_elsewhere(noise.driver, [(scenes[item.scene], item.path(folder))])
            if reason:
                report(f"{item.scene}, {name}: not drawn: {reason}")
                yield item


def _is_capable(noise: Noise, scene: Path) -> bool:
    """Returns whether the driver of a noise has as many samples per pixel as a scene asks for."""
    return load(scene).film.samples <= noise.samples
