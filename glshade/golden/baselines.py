"""Baselines: a folder of approved pictures, their variants by driver, and their sidecars.

ROOT/ball.png is a baseline, and ROOT/ball.png.glshade.json its sidecar. ROOT/ball@softpipe.png is a variant of it: a picture by
another driver, which is right, too. ROOT/.glshade/first/ball.png is the picture that was approved first, if another one has
taken its place.
"""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from glshade.errors import GlshadeError
from glshade.golden.names import MARK, SUFFIXES, check_key, check_name, is_no_pair, with_key

if TYPE_CHECKING:
    from glshade.golden.rules import Rule
    from glshade.golden.sidecar import Driver, Sidecar

# The most variants beside a baseline's main picture. Each one more makes it easier for a wrong picture to pass.
MOST_VARIANTS = 4
# The folder, in the folder of baselines, of the pictures that were approved first.
FIRST = ".glshade/first"


@dataclass(frozen=True)
class Variant:
    """One approved picture of a baseline.

    path: its file.
    key: the part of its name after @; empty for the main picture.
    sidecar: the contents of its sidecar; None if there is none that can be used.
    note: one sentence that says why `sidecar` is None; else empty.
    """

    path: Path
    key: str
    sidecar: Sidecar | None
    note: str = ""


class Baselines:
    """A folder of approved pictures. It need not exist yet."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def path(self, name: str, key: str = "") -> Path:
        """Returns the file of a baseline, or of one of its variants, which need not exist.

        Errors: GlshadeError where the name or the key is not allowed, or a link leads out of the folder.
        """
        check_name(name)
        if key:
            check_key(key)
        return self._inside(with_key(name, key))

    def first_path(self, name: str, key: str = "") -> Path:
        """Returns the file of the first approved picture, which exists only if another picture has taken its place.

        Errors: those of `path`.
        """
        self.path(name, key)
        return self._inside(f"{FIRST}/{with_key(name, key)}")

    def names(self) -> Iterator[str]:
        """Yields the names of all baselines in the folder, sorted. Variants, sidecars and hidden files are none."""
        found = []
        for folder, folders, files in os.walk(self.root):
            folders[:] = [name for name in folders if not name.startswith(".")]
            within = Path(folder).relative_to(self.root)
            pictures = [name for name in files if not name.startswith(".") and name.lower().endswith(SUFFIXES)]
            found += [(within / name).as_posix() for name in pictures if not is_no_pair(Path(folder, name))]
        yield from sorted(found)

    def variants(self, name: str, driver: Driver | None = None) -> list[Variant]:
        """Returns the approved pictures of a baseline, nearest first; an empty list where there are none.

        A picture by the same driver is nearest, then one by another version of it, then the main picture, then the others.
        name: the path of a picture in the folder, of any format. Folders of pictures that nobody has approved have no variants.
        driver: the driver of the picture that they will be compared with; None if it is not known.
        Errors: GlshadeError where the name or a link leads out of the folder.
        """
        from glshade.golden.sidecar import read_sidecar

        main = self._inside(name)
        files = [(main, "")] if main.is_file() else []
        files += [(main.with_name(file), key) for file, key in self._beside(main)]
        found = [Variant(path, key, *read_sidecar(path)) for path, key in files]
        return sorted(found, key=lambda variant: _farness(variant, driver))

    def has_variants(self, name: str) -> bool:
        """Returns whether a baseline has a variant beside its main picture. Errors: those of `variants`."""
        return bool(self._beside(self._inside(name)))

    def check_case(self, name: str, key: str = "") -> None:
        """Checks that no file or folder is there whose name differs from a new picture's only in case or in accents' form.

        Other file systems would take both for one file. Errors: GlshadeError.
        """
        folder = self.root
        for part in PurePosixPath(with_key(name, key)).parts:
            try:
                names = os.listdir(folder)
            except OSError:
                return
            for other in names:
                if other != part and _folded(other) == _folded(part):
                    raise GlshadeError(
                        f"{name}: {folder / other} has the same name but for upper and lower case, and some systems take both "
                        "for one file; choose another name"
                    )
            folder /= part

    def _beside(self, main: Path) -> list[tuple[str, str]]:
        """Returns (file's name, key) of the variants of a main picture."""
        start = main.stem + MARK
        try:
            names = sorted(name for name in os.listdir(main.parent) if name.startswith(start) and name.endswith(main.suffix))
        except OSError:
            return []
        return [(name, name[len(start) : -len(main.suffix)]) for name in names if is_no_pair(main.with_name(name))]

    def _inside(self, relative: str) -> Path:
        """Returns the path of a file in the folder. Errors: GlshadeError where a link leads out of the folder."""
        path = self.root / relative
        try:
            leaves = not path.parent.resolve().is_relative_to(self.root.resolve())
        except (OSError, RuntimeError) as error:
            raise GlshadeError(f"{path.parent}: cannot be used: {getattr(error, 'strerror', None) or error}") from None
        if leaves:
            raise GlshadeError(f"{path.parent}: a link leads out of the folder of baselines, {self.root}; remove the link")
        return path


def _folded(name: str) -> str:
    """Returns a name in the form in which file systems compare names if they ignore case."""
    return unicodedata.normalize("NFC", name).casefold()


def rule_of(variants: Sequence[Variant]) -> Rule:
    """Returns the rule that the sidecar of a baseline's main picture names, by default `codes`.

    Errors: GlshadeError where the sidecar names a rule, or a setting of it, that does not exist.
    """
    from glshade.golden.rules.codes import Codes

    for variant in variants:
        if variant.sidecar is not None and not variant.key:
            return variant.sidecar.rule.rule()
    return Codes()


def _farness(variant: Variant, driver: Driver | None) -> tuple[int, int, int, int, str]:
    """Returns how far the driver of a variant is from a driver, in an order that sorts the nearest first."""
    own = variant.sidecar.driver if variant.sidecar else None
    if driver is None:
        return (0, 0, 0, 0, variant.key)
    if own is None or own.family != driver.family:
        # Without a usable sidecar, the key still tells the driver.
        group = 0 if own is None and variant.key == driver.family else 2 if variant.key else 1
        return (group, 3, 0, 0, variant.key)
    same = own.renderer == driver.renderer
    return (0, 0 if same else 1, int(own.version != driver.version), int(own.backend != driver.backend), variant.key)
