"""Results: folders of results with pictures made by hand, as `glshade compare --report` writes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from glshade.golden.judge import compare_files
from glshade.golden.results import Case, ResultsWriter, case_of
from glshade.golden.rules import RULES
from glshade.image import file as picture_file
from glshade.image.contents import PictureContents

Array = Any


def gradient(size: tuple[int, int] = (48, 32), channels: int = 3, floats: bool = False) -> Array:
    """Returns a picture (H, W, C) of a smooth gradient, as 8-bit codes or as float32 numbers. size: width, height [pixels]."""
    width, height = size
    rows, columns = np.mgrid[:height, :width]
    planes = [rows / height, columns / width, (rows + columns) / (height + width), np.ones_like(rows)]
    picture = np.stack(planes[:channels], axis=2)
    return (picture * 2).astype(np.float32) if floats else np.rint(picture * 255).astype(np.uint8)


def save(path: Path, pixels: Array) -> Path:
    """Writes pixels (H, W, C) to a file, 8-bit codes as PNG and floats as EXR."""
    path.parent.mkdir(parents=True, exist_ok=True)
    encoding = "srgb" if pixels.dtype == np.uint8 else "linear"
    picture_file.write(path, PictureContents(pixels, encoding, premultiplied=pixels.dtype != np.uint8))
    return path


class Run:
    """A run whose pictures are compared by the default rule.

    root: the folder of baselines.
    folder: the folder of results.
    """

    def __init__(self, base: Path) -> None:
        self.root, self.folder = base / "baselines", base / "results"
        self.made = base / "made"
        self.rule = RULES["codes"]()
        self.writer = ResultsWriter(self.folder, "run")

    def add(self, name: str, expected: Array | None, actual: Array | None, **changes: Any) -> Case:
        """Adds the case of two pictures; None stands for a file that is missing. changes: values of the case."""
        pictures: dict[str, Path] = {}
        if expected is not None:
            pictures["expected"] = save(self.root / name, expected)
        if actual is not None:
            pictures["actual"] = save(self.made / name, actual)
        result = compare_files(self.root / name, self.made / name, self.rule, name)
        case = case_of(result, id=f"test::{name}", name=name, root=self.root, rule=self.rule, missing=expected is None)
        return self.writer.add(case.model_copy(update=changes), pictures)

    def finish(self) -> list[Case]:
        """Returns the cases of the run."""
        return self.writer.finish()


def changed(pixels: Array, at: tuple[int, int] = (5, 7), by: int = 60) -> Array:
    """Returns pixels of which one differs. at: row and column."""
    result = pixels.copy()
    result[at] = result[at] + by if pixels.dtype != np.uint8 else (result[at].astype(int) + by) % 256
    return result
