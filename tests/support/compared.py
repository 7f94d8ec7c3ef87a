"""Runs of comparisons: folders of results as `glshade compare --report` and the pytest plugin write them, in a few words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from glshade.golden.baselines import Baselines
from glshade.golden.judge import compare_files
from glshade.golden.result import Outcome, Result
from glshade.golden.results import Case, ResultsWriter, case_of
from glshade.golden.rules import RULES, Rule
from glshade.golden.sidecar import Driver, Origin
from glshade.image import file as picture_file
from glshade.image.contents import PictureContents

LLVMPIPE = Driver(renderer="llvmpipe (LLVM 15.0.7, 256 bits)", version="4.5 Mesa 22.3.6", backend="egl")
SOFTPIPE = Driver(renderer="softpipe", version="3.3 Mesa 22.3.6", backend="egl")


def write_picture(path: Path, pixels: Any) -> Path:
    """Writes pixels (H, W, C) as they are, with straight alpha. Folders are made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    encoding = "srgb" if pixels.dtype == np.uint8 else "linear"
    picture_file.write(path, PictureContents(pixels, encoding, premultiplied=False))
    return path


def compare_all(
    root: Path, results: Path, pictures: Mapping[str, Any], rule: Rule | None = None, origin: Origin | None = None
) -> list[Case]:
    """Compares pictures with their baselines, writes the folder of results, and returns the cases.

    root: the folder of baselines.
    pictures: the baseline's name -> its test picture, (H, W, C).
    origin: the origin of all test pictures.
    """
    rule = rule or RULES["codes"]()
    writer = ResultsWriter(results, "run")
    with TemporaryDirectory() as folder:
        for name, pixels in pictures.items():
            test = write_picture(Path(folder, name), pixels)
            known = Baselines(root).variants(name, origin.driver if origin else None)
            result = Result(name, str(test), Outcome.FILE, "there is no baseline")
            files = {"actual": test}
            if known:
                result = replace(compare_files(known[0].path, test, rule, name), baseline=str(known[0].path))
                files["expected"] = known[0].path
            writer.add(case_of(result, id=name, name=name, root=root, rule=rule, origin=origin, missing=not known), files)
    return writer.finish()
