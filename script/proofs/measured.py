"""No damaged file of measured reflectance ends in a traceback, a hang, or memory beyond 200 MB.

Of three inputs, two are truncations of a file and one is a file with a few changed bytes. The proof writes files of all
formats; one is as large as those of the MERL database. Each input becomes a table in a child process, or one line that names
the file.
"""

from __future__ import annotations

import random
import sys
import traceback
import warnings
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from support.child import Child, forget_peak, peak, serve

COUNT = 200
# The time of one input [s], which a busy machine may take, and the size of the data at which its process gets a MemoryError
# [bytes].
SECONDS, MEMORY = 120, 4 << 30
# The memory that an input may take [bytes].
MOST = 200 << 20
# The most bytes of a file that a mutation changes, and the bytes about its beginning, where headers are, that half of them hit.
CHANGED, HEAD = 8, 400
# The tables of scattered samples have few cells here: the reading is what is tried, and large ones take seconds.
SIZE = (12, 12, 12)


def prove(count: int, seed: int) -> int:
    """Tries `count` inputs, prints those that break the claim, and returns their number."""
    originals = sorted(files().items())
    outcomes: Counter[str] = Counter()
    broken = 0
    with TemporaryDirectory() as name:
        child = Child([sys.executable, "-m", "proofs.measured"], SECONDS, MEMORY)
        try:
            for index in range(count):
                title, data = damaged(originals, seed, index)
                path = Path(name) / title
                path.write_bytes(data)
                answer = child.ask({"path": str(path)})
                outcomes[answer["outcome"]] += 1
                if answer["outcome"] not in ("drawn", "refused"):
                    broken += 1
                    print(f"input {index} of seed {seed}, {title}: {answer['outcome']}: {answer['words']}", flush=True)
        finally:
            child.close()
    print(", ".join(f"{number} {outcome}" for outcome, number in sorted(outcomes.items())))
    return broken


def damaged(originals: list[tuple[str, bytes]], seed: int, index: int) -> tuple[str, bytes]:
    """Returns the name and the bytes of an input."""
    chance = random.Random(f"{seed} {index}")
    title, data = chance.choice(originals)
    if index % 3:
        return title, data[: chance.randrange(len(data))]
    changed = bytearray(data)
    end = HEAD if chance.random() < 0.5 else len(changed)
    for _ in range(chance.randint(1, CHANGED)):
        at = chance.randrange(min(end, len(changed)))
        # Text is damaged by other digits and signs as well as by any byte.
        changed[at] = chance.choice([chance.randrange(256), ord(chance.choice("0123456789-.e \n#"))])
    return title, bytes(changed)


def files() -> dict[str, bytes]:
    """Returns name -> bytes of a file of each kind."""
    from glshade.measured.formats import binary, brdf
    from glshade.measured.rusinkiewicz import spherical
    from glshade.measured.samples import Samples
    from glshade.measured.table import MERL_SIZE

    chance = np.random.default_rng(0)
    theta, phi = 1.4 * chance.random((2, 60)), 6.2 * chance.random(60)
    f = 0.1 + chance.random((60, 3))
    samples = Samples(spherical(theta[0], np.zeros(60)), spherical(theta[1], phi), f)
    rows = "".join(f"{a:.5f} {b:.5f} {c:.5f} {g:.5f}\n" for a, b, c, g in zip(theta[0], theta[1], phi, f[:, 0], strict=True))
    cosines = "".join(f"{c:.5f} {r:.4f} {g:.4f} {b:.4f}\n" for c, (r, g, b) in zip(np.cos(theta[0]), f, strict=True))
    return {
        "a.brdf": brdf.written(samples, "proof").encode(),
        "a.alta": f"#DIM 3 1\n#VS 0\n#PARAM_IN ISOTROPIC_TV_TL_DPHI\n#PARAM_OUT INV_STERADIAN\n{rows}".encode(),
        "b.alta": f"#DIM 1 3\n#PARAM_IN COS_TH\n#PARAM_OUT RGB_COLOR\n{cosines}".encode(),
        "small.binary": binary.written(0.1 + chance.random((12, 9, 9, 3))),
        "merl.binary": binary.written(np.full((*MERL_SIZE, 3), 0.25)),
        "a.bsdf": b"tensor_file\0" + bytes(chance.integers(0, 256, 200, dtype=np.uint8)),
    }


def answer(path: Path) -> dict[str, Any]:
    """Makes the table of a file, and returns the outcome and its words."""
    from glshade.errors import GlshadeError
    from glshade.measured.reading import read
    from glshade.measured.tabulation import tabulated

    before = forget_peak()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            table = tabulated(read(path))
            finite = bool(np.isfinite(table.values).all())
            result = {"outcome": "drawn" if finite else "not finite", "words": ""}
        except GlshadeError as error:
            lines = str(error).splitlines()
            clear = len(lines) == 1 and lines[0].startswith(str(path)) and lines[0].isprintable()
            result = {"outcome": "refused" if clear else "unclear", "words": lines}
        except Exception:
            result = {"outcome": "traceback", "words": traceback.format_exc(limit=-6)}
    if caught and result["outcome"] in ("drawn", "refused"):
        result = {"outcome": "warning", "words": str(caught[0].message)}
    used = peak() - before
    return {"outcome": "memory", "words": f"{used / 1e6:.0f} MB"} if used > MOST else result


def main() -> None:
    """Answers the questions of a child process, after it has made a table once."""
    from glshade.measured import tabulation

    tabulation.SCATTERED_SIZE = SIZE
    with TemporaryDirectory() as name:
        path = Path(name) / "a.brdf"
        path.write_bytes(files()["a.brdf"])
        assert answer(path)["outcome"] == "drawn"
    serve(lambda question: answer(Path(question["path"])))


if __name__ == "__main__":
    main()
