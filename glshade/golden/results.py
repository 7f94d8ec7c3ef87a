"""Results: the folder into which comparisons are written, for `glshade approve`, the page and CI.

FOLDER/results.json holds the cases, and FOLDER/cases their pictures. While a run goes on, each of its processes appends a line
for each case to a file of its own in FOLDER/lines, so that a run that is killed keeps the cases that it has finished.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, field_validator

from glshade.document import Document, fault
from glshade.errors import GlshadeError, is_printable, printable
from glshade.files import check_regular, read_bytes, replacing
from glshade.golden.sidecar import VERSION, Origin, RuleUse, as_text, loaded, parsed, sha256_of
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.golden.result import Result
    from glshade.golden.rules import Rule


RESULTS, LINES, CASES = "results.json", "lines", "cases"
# A case takes a few thousand bytes. A larger file was not written by us, or holds more cases than a page can show [bytes].
LARGEST = 1 << 28
# The pictures of a case.
KINDS = ("actual", "expected", "difference", "classes", "mask")
# The name of a case's folder ends with this many hexadecimal digits of a hash, so that no two cases share a folder.
HASHED = 10
FOLDER = re.compile(rf".*-[0-9a-f]{{{HASHED}}}")


class Case(Origin):
    """One comparison, and the origin of its test picture.

    id: pytest's node id, or the name of the pair.
    name: the baseline's name: its path in its folder, such as `cars/red.png`.
    baseline_root: the absolute path of the folder of baselines.
    baseline: the path, in that folder, of the approved picture that was compared; None if there is none.
    actual: the path of the test picture, in the folder of the results; None if there is none.
    actual_sha256: SHA-256 of the bytes of the test picture's file.
    rule: the rule that judged.
    outcome: the word for the Outcome.
    verdict: the text of the SceneVerdict; None without a scene.
    reason: one line that says why; empty for "same".
    causes: the causes of the difference, as values for JSON.
    layers: the results of the layers, as values for JSON.
    distances: the file name of each approved picture that was tried -> the test picture's distance from it.
    files: "expected", "difference", "classes" or "mask" -> the path of that picture in the folder of the results. A mask is
        black where pixels are compared.
    missing: whether there is no baseline yet.
    notes: further lines for a person, such as the reason why a sidecar cannot be used.
    """

    id: str
    name: str
    baseline_root: str
    baseline: str | None = None
    actual: str | None = None
    actual_sha256: str = ""
    rule: RuleUse = RuleUse()
    outcome: Literal["same", "warn", "fail", "sizes", "file"]
    verdict: str | None = None
    reason: str = ""
    causes: tuple[dict[str, Any], ...] = ()
    layers: tuple[dict[str, Any], ...] = ()
    distances: dict[str, float] = Field({})
    files: dict[str, str] = Field({})
    missing: bool = False
    notes: tuple[str, ...] = ()

    @field_validator("id", "name", "baseline_root", "scene", "actual")
    @classmethod
    def _printable(cls, text: str | None) -> str | None:
        # No file of ours has such a name, and functions of the operating system refuse some of them.
        if text is not None and not is_printable(text):
            raise fault("has control characters")
        return text

    @property
    def passed(self) -> bool:
        """Whether nobody has to look at the case."""
        return self.outcome == "same"


def case_of(
    result: Result, *, id: str, name: str, root: Path, rule: Rule, origin: Origin | None = None, missing: bool = False
) -> Case:
    """Returns the case of a comparison's result.

    id, name: as Case has them.
    root: the folder of baselines.
    rule: the rule that judged.
    origin: the origin of the test picture, with an absolute path of the scene; None if it is not known.
    missing: whether there is no baseline yet.
    """
    from glshade.golden import report

    known = {key: _cleaned(getattr(origin, key)) for key in Origin.model_fields} if origin else {}
    return Case(
        **known,
        id=printable(id),
        name=printable(name),
        baseline_root=printable(str(root.absolute())),
        baseline=_cleaned(_relative(result.baseline, root)),
        rule=RuleUse.of(rule),
        outcome=result.outcome.name.lower(),
        verdict=None if result.verdict is None else str(result.verdict),
        reason=printable(result.reason),
        causes=_cleaned([asdict(cause) for cause in result.causes]),
        layers=_cleaned(report.as_json([result], "")["pairs"][0]["layers"]),
        distances=_cleaned(result.distances),
        missing=missing,
        notes=_cleaned(result.notes),
    )


def _cleaned(value: Any) -> Any:
    """Returns a value for JSON whose texts are printable. The names of files may be anything, even what UTF-8 cannot write."""
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, Mapping):
        return {printable(key): _cleaned(item) for key, item in value.items()}
    return tuple(map(_cleaned, value)) if isinstance(value, list | tuple) else value


def _relative(path: str, root: Path) -> str | None:
    """Returns the path of a file in a folder; None for no path, and for a file that lies elsewhere."""
    try:
        return Path(path).absolute().relative_to(root.absolute()).as_posix() if path else None
    except ValueError:
        return None


class ResultsWriter:
    """Writes the results of one process of a run. Several processes may write to one folder at the same time."""

    def __init__(self, folder: Path, run: str, worker: str = "") -> None:
        """Nothing is written until a case is added.

        folder: the folder of the results, which need not exist yet.
        run: a name for the run that all of its processes share, of letters, digits, "-" and "_".
        worker: the name of this process in the run, of the same characters.
        """
        self.folder = folder
        self._run = run
        self._lines = folder / LINES / f"{run}.{worker}.jsonl"
        self._begun = False

    def add(self, case: Case, pictures: Mapping[str, Path]) -> Case:
        """Copies the pictures of a case into the folder, and appends the case's line. Returns the case with their paths.

        The first case removes what an earlier run has written to the folder: results.json, index.html, junit.xml and lines.
        pictures: "actual", "expected", "difference", "classes" or "mask" -> a picture file outside the folder of the results.
        A picture that cannot be read is left out, and a note of the case says why.
        Errors: GlshadeError where the folder cannot be written.
        """
        try:
            self._begin()
            case = self._with_pictures(case, pictures)
            with self._lines.open("ab", buffering=0) as file:
                file.write(json.dumps(case.model_dump(mode="json"), allow_nan=False).encode() + b"\n")
        except OSError as error:
            raise _unwritable(self.folder, error) from None
        return case

    def finish(self) -> list[Case]:
        """Merges the lines of all processes of the run into results.json, and returns the cases, sorted by id and name.

        Folders of pictures that no case of this run names are removed. Errors: GlshadeError.
        """
        try:
            self._begin()
            cases = _merged(self.folder)
            with replacing(self.folder / RESULTS) as temporary:
                contents = Contents(tool=f"glshade {__version__}", cases=tuple(cases))
                temporary.write_text(as_text(contents.model_dump(mode="json")), encoding="utf-8")
            shutil.rmtree(self.folder / LINES)
            kept = {_folder_name(case) for case in cases}
            for folder in (self.folder / CASES).glob("*/"):
                if folder.name not in kept and FOLDER.fullmatch(folder.name) and not folder.is_symlink():
                    shutil.rmtree(folder)
        except OSError as error:
            raise _unwritable(self.folder, error) from None
        return cases

    def _begin(self) -> None:
        """Removes what earlier runs have written, once. Other processes of this run may do so at the same time."""
        if self._begun:
            return
        self._lines.parent.mkdir(parents=True, exist_ok=True)
        for file in self._lines.parent.glob("*.jsonl"):
            if not file.name.startswith(f"{self._run}."):
                file.unlink(missing_ok=True)
        for name in (RESULTS, "index.html", "junit.xml"):
            (self.folder / name).unlink(missing_ok=True)
        self._begun = True

    def _with_pictures(self, case: Case, pictures: Mapping[str, Path]) -> Case:
        """Copies the pictures of a case, and returns the case with their paths. Errors: OSError."""
        folder = self.folder / CASES / _folder_name(case)
        folder.mkdir(parents=True, exist_ok=True)
        for left in folder.iterdir():
            left.unlink()
        copies = {kind: folder / f"{kind}{_suffix(path)}" for kind, path in pictures.items()}
        notes = list(case.notes)
        for kind, path in pictures.items():
            try:
                check_regular(path)
                with path.open("rb") as file:
                    file.read(1)
            except OSError as error:
                del copies[kind]
                notes.append(printable(f"{path}: cannot be read: {error.strerror or error}"))
            else:
                shutil.copyfile(path, copies[kind])
        files = {kind: copy.relative_to(self.folder).as_posix() for kind, copy in copies.items()}
        actual = files.pop("actual", None)
        hashed = sha256_of(copies["actual"]) if actual else ""
        return case.model_copy(update={"actual": actual, "actual_sha256": hashed, "files": files, "notes": tuple(notes)})


class Contents(Document):
    """The contents of results.json.

    version: the version of the format.
    tool: the program that wrote it, with its version.
    cases: the cases, sorted by id and name.
    """

    version: Literal[1] = VERSION
    tool: str
    cases: tuple[Case, ...]


def read(folder: Path) -> list[Case]:
    """Returns the cases in a folder of results, sorted by id and name. Of a run that was killed, those that it has finished.

    Errors: GlshadeError with one line where the folder holds no results, or they are damaged or of a later version.
    """
    path = folder / RESULTS
    if folder.is_file():
        raise GlshadeError(f"{folder}: holds no results, but is a file; give the folder in which it lies")
    try:
        return list(loaded(path, Contents, LARGEST).cases)
    except FileNotFoundError:
        if not any((folder / LINES).glob("*.jsonl")):
            raise GlshadeError(
                f"{folder}: holds no results (no {RESULTS}); give the folder that `glshade compare --report` or pytest wrote"
            ) from None
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be read: {error.strerror or error}") from None
    except GlshadeError as error:
        raise GlshadeError(f"{path}: {error}") from None
    try:
        return _merged(folder)
    except OSError as error:
        raise GlshadeError(f"{folder / LINES}: cannot be read: {error.strerror or error}") from None


def picture_path(folder: Path, case: Case, kind: str = "actual") -> Path | None:
    """Returns the file of one of a case's pictures; None if it has none.

    kind: "actual", or a key of Case.files.
    Errors: GlshadeError where the path leads out of the folder.
    """
    relative = case.actual if kind == "actual" else case.files.get(kind)
    if relative is None:
        return None
    path = folder / relative
    try:
        outside = PurePosixPath(relative).is_absolute() or not path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):
        outside = True
    if outside:
        raise GlshadeError(f"{folder / RESULTS}: {case.id}: the picture {relative!r} lies outside the folder of the results")
    return path


def _merged(folder: Path) -> list[Case]:
    """Returns the cases of all lines in a folder, sorted by id and name; of lines about the same case, the last one.

    Errors: OSError; GlshadeError for a line that is damaged.
    """
    cases = {}
    for file in sorted((folder / LINES).glob("*.jsonl")):
        # A process that was killed may have left a part of a line at the end of its file.
        for number, line in enumerate(read_bytes(file, LARGEST).split(b"\n")[:-1], 1):
            try:
                case = parsed(line, Case)
            except GlshadeError as error:
                raise GlshadeError(f"{file}: line {number}: {error}") from None
            cases[case.id, case.name] = case
    return [cases[key] for key in sorted(cases)]


def _folder_name(case: Case) -> str:
    """Returns the name of the folder of a case's pictures: readable, without special characters, and of no other case."""
    words = re.sub(r"[^A-Za-z0-9._]+", "-", case.name.removesuffix(PurePosixPath(case.name).suffix)).strip("-.")
    hashed = hashlib.sha256(f"{case.id}\0{case.name}".encode()).hexdigest()[:HASHED]
    # Most file systems allow 255 bytes. The end of a name tells more than its beginning, which is often a folder.
    return f"{words[-80:]}-{hashed}"


def _suffix(path: Path) -> str:
    """Returns a file's suffix in lower case, or nothing where it is no suffix of a picture."""
    return path.suffix.lower() if re.fullmatch(r"\.[A-Za-z0-9]+", path.suffix) else ""


def _unwritable(folder: Path, error: OSError) -> GlshadeError:
    """Returns the error to raise for a folder of results that cannot be written."""
    return GlshadeError(f"{error.filename or folder}: the results cannot be written: {error.strerror or error}")
