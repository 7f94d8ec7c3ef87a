"""No scene document ends in a traceback, takes more than 30 s of two cores or 2 GB, or prints a line that is not clear.

Of 13 documents, 10 have hostile values in many places and 3 in one place or none. Each is loaded and drawn at 32 x 32 pixels.
"""

from __future__ import annotations

import json
import os
import random
import re
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from support.hostile import Maker, text_of, write_files

COUNT = 2600
# The limits of one document: its time on two cores [s], the memory of its process [bytes], and the length of a line.
SECONDS, MEMORY, LINE = 30, 2 << 30, 1010
# A process that gives no answer within this time is killed [s]. Processor time is what counts, because a machine may be busy.
PATIENCE = 300
# The side of the picture [pixels].
SIDE = 32
# The share of hostile values in the documents, by the number of the document. The last three are nearly valid.
HOSTILITY = (0.3, 0.2, 0.15, 0.1, 0.08, 0.06, 0.05, 0.03, 0.01, 0.005, 0.3, 0.1, 0.02)
NEARLY_VALID = 3
PROCESSES = 2


def prove(count: int, seed: int) -> int:
    """Tries `count` documents, prints those that break the claim, and returns their number."""
    from glshade.scene.scene import Scene

    schema = Scene.model_json_schema()
    outcomes: Counter[str] = Counter()
    broken = 0
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(PROCESSES) as threads:
        folder = Path(name)
        write_files(folder)

        def share(first: int) -> list[tuple[int, str, str]]:
            with_child = Child(folder, first)
            try:
                return [(k, *with_child.outcome(document(schema, seed, k))) for k in range(first, count, PROCESSES)]
            finally:
                with_child.close()

        for found in threads.map(share, range(min(PROCESSES, count))):
            for index, outcome, detail in found:
                outcomes[outcome] += 1
                if outcome not in ("drawn", "refused"):
                    broken += 1
                    print(f"document {index} of seed {seed}: {outcome}: {detail}", flush=True)
    print(", ".join(f"{number} {outcome}" for outcome, number in sorted(outcomes.items())))
    return broken


def document(schema: Any, seed: int, index: int) -> str:
    """Returns the text of a document."""
    kind = index % len(HOSTILITY)
    nearly_valid = kind >= len(HOSTILITY) - NEARLY_VALID
    return text_of(Maker(schema, random.Random(f"{seed} {index}"), HOSTILITY[kind], nearly_valid).document())


class Child:
    """A process that loads and draws documents one after another, and is replaced when it takes too long or dies.

    folder: the folder in which the document is written.
    number: the number of the process, for the name of the document.
    """

    def __init__(self, folder: Path, number: int) -> None:
        self._path = folder / f"{number}.json"
        self._process = self._started()

    def _started(self) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "proofs.documents", str(self._path)]
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def outcome(self, text: str) -> tuple[str, str]:
        """Returns an outcome and its details: "drawn" and "refused" are good, all others are bad."""
        self._path.write_text(text)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with ThreadPoolExecutor(1) as waiting:
            try:
                self._process.stdin.write(b"\n")
                self._process.stdin.flush()
                answer = waiting.submit(self._process.stdout.readline).result(PATIENCE)
                outcome, detail = json.loads(answer)
                return outcome, detail
            except TimeoutError:
                reason = "time"
            except (OSError, ValueError):
                reason = "death"
            self._process.kill()
            code = self._process.wait()
        self._process = self._started()
        return reason, f"exit code {code}: {text[:2000]}"

    def close(self) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.wait()


def answer(path: Path, renderer: Any) -> tuple[str, str]:
    """Returns the outcome of the document in a file, and its details."""
    import glshade

    start = time.process_time()
    # This sets the peak of the process's memory, VmHWM, to its present size (man 5 proc).
    Path("/proc/self/clear_refs").write_text("5")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            scene = glshade.load(path)
            film = scene.film.model_copy(update={"size": (SIDE, SIDE), "crop": None})
            renderer.render(scene.model_copy(update={"film": film}))
            result = "drawn", ""
        except glshade.GlshadeError as error:
            lines = str(error).split("\n")
            unclear = [line for line in lines if not line.isprintable() or len(line) > LINE or not line.strip()]
            result = ("unclear", repr(unclear[0][:LINE])) if unclear else ("refused", lines[0])
        except Exception:
            result = "traceback", traceback.format_exc(limit=-6)
    leaked = [str(w.message) for w in caught if issubclass(w.category, RuntimeWarning | DeprecationWarning | BytesWarning)]
    if leaked and result[0] in ("drawn", "refused"):
        result = "warning", f"{leaked[0]} {path.read_text()[:1500]}"
    if time.process_time() - start > 2 * SECONDS:
        return "time", path.read_text()[:1500]
    peak = re.search(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text())
    assert peak is not None
    return ("memory", path.read_text()[:1500]) if int(peak[1]) * 1024 > MEMORY else result


def main() -> None:
    """Answers each line of stdin with the outcome of the document."""
    import glshade

    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    with glshade.Renderer() as renderer:
        for _ in sys.stdin.buffer:
            print(json.dumps(answer(Path(sys.argv[1]), renderer)), file=answers, flush=True)


if __name__ == "__main__":
    main()
