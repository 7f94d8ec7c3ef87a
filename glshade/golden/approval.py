"""Approval: makes the pictures of a run the new baselines, all of them or none.

The files of each picture are replaced in this order: the first approved picture, the sidecar, the picture. So if the process
is killed in between, the sidecar belongs to another picture, which its hash tells, and the same command completes the approval.
"""

from __future__ import annotations

import os
import shlex
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from glob import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from glshade.errors import GlshadeError
from glshade.golden import report
from glshade.golden.baselines import MOST_VARIANTS, Baselines
from glshade.golden.judge import checked_parts, compare_files
from glshade.golden.names import check_key, check_name, sidecar_path
from glshade.golden.result import Outcome, Result
from glshade.golden.results import Case, picture_path
from glshade.golden.sidecar import First, Origin, Sidecar, as_text, load_sidecar, scene_beside, sha256_of
from glshade.golden.transaction import STAGE, Transaction, all_or_none
from glshade.image import file as picture_file

# The first bytes of a file of each format. A name alone would let a JPEG file pass for a PNG file.
SIGNATURES = {".png": b"\x89PNG\r\n\x1a\n", ".exr": b"\x76\x2f\x31\x01"}
# OpenEXR's compressions that change the values of floats.
LOSSY = frozenset({"b44", "b44a", "dwaa", "dwab", "pxr24"})


class Refused(GlshadeError):
    """Nothing was approved. The message has one line for each picture that cannot be approved."""


@dataclass(frozen=True)
class Approval:
    """One picture that was approved, or would be.

    name: the baseline's name.
    path: the file that was written, as a path in the folder of baselines.
    what: "new", "replaced", "sidecar" where the picture was the same and only its sidecar changed, or "unchanged".
    distance: the distance of the new picture from the old one; None where there was none, or their sizes differ.
    notes: further lines, such as the settings of the film that the reference leaves out.
    """

    name: str
    path: str
    what: str
    distance: float | None = None
    notes: tuple[str, ...] = ()


def selected(cases: Iterable[Case], only: Sequence[str] = ()) -> list[Case]:
    """Returns the cases to approve: those that did not pass, or those whose name or id matches one of the patterns `only`.

    only: patterns as in a shell: `*` (which takes slashes, too), `?`, `[abc]`. A person who names a case may also approve one
        that has passed.
    """
    if not only:
        return [case for case in cases if not case.passed]
    return [case for case in cases if any(fnmatchcase(text, way) for way in only for text in (case.name, case.id))]


def approve_command(folder: Path, patterns: Iterable[str] = ()) -> str:
    """Returns the command line that approves some cases of a folder of results, quoted for a POSIX shell.

    patterns: the names of the cases; characters that patterns give a meaning to are escaped.
    """
    options = [word for name in patterns for word in ("--only", escape(name))]
    return shlex.join(["glshade", "approve", str(folder), *options])


def approve(
    folder: Path,
    cases: Sequence[Case],
    *,
    root: Path,
    as_variant: str | bool = False,
    from_reference: bool = False,
    accept_drift: bool = False,
    dry_run: bool = False,
) -> list[Approval]:
    """Makes the test pictures of some cases the new baselines. Either all of them are written, or nothing is changed.

    folder: the folder of the results.
    cases: the cases, as `selected` returns them.
    root: the folder of baselines. Nothing is written outside it.
    as_variant: the key of the variant to write; True for the short name of the driver that drew the picture; False to replace
        the picture by the same driver if there is one, and else the main picture.
    from_reference: draws the scene with the float64 reference, and approves that in place of the test picture.
    accept_drift: approves pictures, too, that have crept away from the first approved picture in steps that all passed.
    dry_run: changes nothing, and returns what would be done.
    Errors: Refused, with a line for each picture that cannot be approved; GlshadeError where a file cannot be written.
    """
    with TemporaryDirectory() as drawn:
        planner = _Planner(folder, Baselines(root), Path(drawn), as_variant, from_reference, accept_drift)
        changes = planner.changes(cases)
        if not dry_run:
            _write(root, changes)
    return [change.approval for change in changes]


@dataclass(frozen=True, eq=False)
class _Change:
    """The approval of one picture, checked and not yet written.

    approval: what the person is told.
    picture: the file to approve, outside the folder of baselines.
    target: the file that it becomes.
    sidecar: the new sidecar.
    first: the file to which the target's present contents are copied, since they are the first approved picture; None if they
        are not, or are not kept.
    forgotten: the file of a first picture that no longer counts; None if there is none.
    """

    approval: Approval
    picture: Path
    target: Path
    sidecar: Sidecar
    first: Path | None = None
    forgotten: Path | None = None


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A picture that may become a baseline.

    path: its file.
    sha256: SHA-256 of the file's bytes.
    origin: its origin, with the scene relative to the baseline's folder.
    notes: lines for the person who approves it.
    """

    path: Path
    sha256: str
    origin: Origin
    notes: tuple[str, ...] = ()


@dataclass
class _Planner:
    """Finds out what an approval changes. The fields are the arguments of `approve`; `drawn` is an empty folder."""

    folder: Path
    baselines: Baselines
    drawn: Path
    as_variant: str | bool
    from_reference: bool
    accept_drift: bool
    _targets: dict[str, Case] = field(default_factory=dict)

    def changes(self, cases: Sequence[Case]) -> list[_Change]:
        """Returns what the approval of some cases changes. Errors: Refused."""
        changes, faults = [], []
        for case in cases:
            try:
                changes.append(self._change(case))
            except GlshadeError as error:
                faults += str(error).split("\n")
            except OSError as error:
                faults.append(f"{error.filename or case.name}: {error.strerror or error}")
        if faults:
            raise Refused("\n".join([*faults, "nothing was approved; `--only GLOB` chooses which pictures to approve"]))
        return changes

    def _change(self, case: Case) -> _Change:
        """Returns what the approval of one case changes. Errors: GlshadeError, OSError."""
        check_name(case.name)
        key = self._key(case)
        target = self.baselines.path(case.name, key)
        self.baselines.check_case(case.name, key)
        other = self._targets.setdefault(str(target).casefold(), case)
        if other is not case:
            raise GlshadeError(f"{case.name}: two cases have this baseline, {other.id} and {case.id}; approve one with --only")
        new = self._from_reference(case) if self.from_reference else self._from_run(case)
        _check_picture(case.name, new.path)
        return self._next_time(case, key, target, new) if target.exists() else self._first_time(case, target, new)

    def _key(self, case: Case) -> str:
        """Returns the key of the variant that is written; empty for the main picture. Errors: GlshadeError."""
        family = case.driver.family if case.driver else ""
        if self.as_variant is False:
            if self.from_reference or not family:
                return ""
            nearest = next(iter(self.baselines.variants(case.name, case.driver)), None)
            if nearest is None:
                return ""
            own = nearest.sidecar.driver if nearest.sidecar else None
            return nearest.key if family == (own.family if own else nearest.key) else ""
        if self.as_variant is True and not family:
            raise GlshadeError(f"{case.name}: its driver is not known; name the variant: --as-variant KEY")
        key = family if self.as_variant is True else self.as_variant
        check_key(key)
        self._check_room(case, key)
        return key

    def _check_room(self, case: Case, key: str) -> None:
        """Checks that a baseline may have this variant. Errors: GlshadeError."""
        found = self.baselines.variants(case.name, case.driver)
        keys = {variant.key for variant in found}
        if "" not in keys:
            raise GlshadeError(f"{case.name}: has no baseline yet; approve it without --as-variant first")
        if key in keys or len(keys - {""}) < MOST_VARIANTS:
            return
        actual = self._actual(case)
        listed = []
        for variant in sorted(found, key=lambda variant: variant.key):
            distance = distance_of(self._compared(case, variant.path, actual))
            listed.append(f"{variant.path.name} ({'another size' if distance is None else f'distance {distance:.3g}'})")
        raise GlshadeError(
            f"{case.name}: has {MOST_VARIANTS} variants, and no more are allowed: {', '.join(listed)}; replace the nearest one "
            "with --as-variant and its key, or delete one that is no longer needed"
        )

    def _from_run(self, case: Case) -> _Candidate:
        """Returns the test picture of a case. Errors: GlshadeError, OSError."""
        return _Candidate(self._actual(case), case.actual_sha256, self._with_scene(case))

    def _from_reference(self, case: Case) -> _Candidate:
        """Returns the reference's picture of a case's scene. Errors: GlshadeError, OSError."""
        from glshade.golden.reference_picture import draw_reference

        known = self._with_scene(case)
        if known.scene is None:
            raise GlshadeError(f"{case.name}: neither the run nor a sidecar names a scene file that the reference could draw")
        scene = scene_beside(self.baselines.path(case.name), known.scene)
        path = self.drawn / f"{len(self._targets)}{Path(case.name).suffix.lower()}"
        drawn = draw_reference(scene, path, known.overrides)
        if case.scene_digest not in (None, drawn.origin.scene_digest):
            raise GlshadeError(f"{case.name}: {scene} has changed since this run; run the test again")
        origin = drawn.origin.model_copy(update={"scene": known.scene})
        notes = tuple(f"the reference leaves out {setting}" for setting in drawn.left_out)
        return _Candidate(drawn.path, sha256_of(drawn.path), origin, notes)

    def _with_scene(self, case: Case) -> Origin:
        """Returns the origin of a case's test picture, with the scene relative to the baseline's folder.

        Where the run does not name the scene, it is the one that the sidecar of the approved picture names.
        """
        origin = Origin(**{name: getattr(case, name) for name in Origin.model_fields})
        if case.scene is not None:
            return origin.model_copy(update={"scene": _scene_beside(case)})
        for variant in self.baselines.variants(case.name, case.driver):
            if variant.sidecar is not None and variant.sidecar.scene is not None:
                return origin.model_copy(update={"scene": variant.sidecar.scene, "overrides": variant.sidecar.overrides})
        return origin

    def _actual(self, case: Case) -> Path:
        """Returns the file of a case's test picture. Errors: GlshadeError, OSError."""
        path = picture_path(self.folder, case)
        if path is None:
            reason = f" ({case.reason})" if case.reason else ""
            raise GlshadeError(f"{case.name}: the run has no picture of it to approve{reason}")
        if sha256_of(path) != case.actual_sha256:
            raise GlshadeError(f"{path}: is not the picture that was compared: it has changed since; run the test again")
        return path

    def _first_time(self, case: Case, target: Path, new: _Candidate) -> _Change:
        """Returns the change that adds a baseline."""
        sidecar = _sidecar(case, new, First(sha256=new.sha256), 0)
        return _Change(self._approval(case, target, "new", None, new.notes), new.path, target, sidecar)

    def _next_time(self, case: Case, key: str, target: Path, new: _Candidate) -> _Change:
        """Returns the change that replaces a baseline. Errors: GlshadeError for a picture that has crept away."""
        before, now, old = sha256_of(target), new.sha256, self._old_sidecar(target)
        step, notes = self._compared(case, target, new.path), new.notes
        if old is not None and old.sha256 == now:
            # This picture is the baseline already, or an approval was interrupted after it had written the sidecar.
            first, accepted = old.first, old.accepted_drift
        elif new.origin.made_by == "reference" or not (case.passed or step.outcome is Outcome.SAME):
            # The reference does not creep, and a person has seen a step that did not pass.
            first, accepted = First(sha256=now), 0
        else:
            first, accepted = self._kept_first(case, key, target, new, old)
        sidecar = _sidecar(case, new, first, accepted)
        what = "replaced" if before != now else "unchanged" if sidecar == old else "sidecar"
        if step.outcome is not Outcome.SAME:
            notes += self._others(case, target, new.path)
        if old is not None and old.made_by == "reference" and new.origin.made_by != "reference":
            notes += ("the reference had made the old picture; `--from reference` approves the reference's picture again",)
        kept = self.baselines.first_path(case.name, key)
        return _Change(
            self._approval(case, target, what, distance_of(step), notes),
            new.path,
            target,
            sidecar,
            first=kept if first.sha256 == before != now else None,
            forgotten=kept if first.sha256 == now and kept.exists() else None,
        )

    @staticmethod
    def _old_sidecar(target: Path) -> Sidecar | None:
        """Returns the sidecar that is there, even of another picture. Errors: GlshadeError where it cannot be read."""
        try:
            return load_sidecar(target)
        except FileNotFoundError:
            return None
        except GlshadeError as error:
            path = sidecar_path(target)
            raise GlshadeError(f"{path}: {error}; or restore it from version control, or delete it to begin anew") from None

    def _kept_first(self, case: Case, key: str, target: Path, new: _Candidate, old: Sidecar | None) -> tuple[First, int]:
        """Returns the first approved picture, and how often drift was accepted, after a step that the rule accepts.

        Errors: GlshadeError where the picture has crept away from the first one, and this is not accepted.
        """
        accepted = old.accepted_drift if old else 0
        sha256 = old.first.sha256 if old else sha256_of(target)
        path = next((x for x in (target, self.baselines.first_path(case.name, key)) if _has(x, sha256)), None)
        if path is None:
            reason = f"the first approved picture, {self.baselines.first_path(case.name, key)}, is missing; restore it"
        else:
            whole = self._compared(case, path, new.path)
            distance = distance_of(whole)
            if whole.outcome is Outcome.SAME:
                return First(sha256=sha256, distance=float(f"{distance or 0:.6g}")), accepted
            reason = (
                f"has crept away from the first approved picture, {path}, in steps that all passed: {whole.reason}"
                f"{'' if distance is None else f'; distance {distance:.3g}'}; look at both"
            )
        if self.accept_drift:
            return First(sha256=new.sha256), accepted + 1
        raise GlshadeError(f"{case.name}: {reason}, or approve it with --accept-drift")

    def _others(self, case: Case, target: Path, picture: Path) -> tuple[str, ...]:
        """Returns a note for each other approved picture of a baseline, which stays as it is."""
        notes = []
        for variant in self.baselines.variants(case.name):
            if variant.path != target:
                distance = distance_of(self._compared(case, variant.path, picture))
                told = "its size differs" if distance is None else f"its distance is {distance:.3g}"
                notes.append(f"{variant.path.name} stays; {told}")
        return tuple(notes)

    def _compared(self, case: Case, reference: Path, test: Path) -> Result:
        """Returns the result of comparing two pictures by a case's rule and mask. Errors: GlshadeError."""
        path = picture_path(self.folder, case, "mask")
        mask = None
        if path is not None:
            (part,) = picture_file.parts(path)
            mask = np.any(picture_file.read_part(path, part), axis=2)
        return compare_files(reference, test, case.rule.rule(), mask=mask)

    def _approval(self, case: Case, target: Path, what: str, distance: float | None, notes: tuple[str, ...]) -> Approval:
        return Approval(case.name, target.relative_to(self.baselines.root).as_posix(), what, distance, notes)


def _sidecar(case: Case, new: _Candidate, first: First, accepted_drift: int) -> Sidecar:
    """Returns the sidecar of a picture that becomes the baseline of a case."""
    known = {name: getattr(new.origin, name) for name in Origin.model_fields}
    return Sidecar(**known, sha256=new.sha256, rule=case.rule, first=first, accepted_drift=accepted_drift)


def _scene_beside(case: Case) -> str | None:
    """Returns the path of a case's scene relative to the folder of its baseline, with slashes; None if no scene is named."""
    if case.scene is None:
        return None
    folder = (Path(case.baseline_root) / case.name).parent
    try:
        return Path(os.path.relpath(case.scene, folder)).as_posix()
    except ValueError:  # on Windows, where they may be on different drives
        return case.scene


def distance_of(result: Result) -> float | None:
    """Returns the distance of two pictures from the result of their comparison: the largest RMSE of their layers.

    It is 0 for files with the same bytes, and None where the pixels could not be compared.
    """
    if not result.layers:
        return 0.0 if result.outcome is Outcome.SAME else None
    metrics = report.largest(result)
    return None if metrics is None else metrics.rmse


def _has(path: Path, sha256: str) -> bool:
    """Returns whether a file exists and has this SHA-256."""
    try:
        return sha256_of(path) == sha256
    except OSError:
        return False


def _check_picture(name: str, picture: Path) -> None:
    """Checks that a file can be a baseline: it is what its name says, without loss, and can be read. Errors: GlshadeError."""
    suffix = Path(name).suffix.lower()
    with picture.open("rb") as file:
        start = file.read(len(SIGNATURES[suffix]))
    if start != SIGNATURES[suffix]:
        raise GlshadeError(f"{name}: {picture} is no {suffix} file, whatever its name says; write it as PNG or OpenEXR")
    compression = picture_file.attributes(picture).get("compression", "").partition(":")[0]
    if compression in LOSSY:
        raise GlshadeError(f"{name}: is compressed with loss ({compression}); write it with another compression, such as zip")
    for part in checked_parts(picture):
        if not np.isfinite(picture_file.read_part(picture, part)).all():
            raise GlshadeError(
                f"{name}: holds infinite or NaN values, which every rule rejects; correct the scene or the shader"
            )


def _write(root: Path, changes: Sequence[_Change]) -> None:
    """Writes the files of all changes, or none of them. Errors: GlshadeError."""
    wanted = [change for change in changes if change.approval.what != "unchanged"]
    if not wanted:
        return
    try:
        with all_or_none(root) as transaction:
            for change in wanted:
                _replace(change, transaction)
    except OSError as error:
        place = str(error.filename2 or error.filename or root)
        # The name of a temporary file tells a person nothing.
        place = str(root) if STAGE in place else place
        raise GlshadeError(f"{place}: cannot be written: {error.strerror or error}; nothing was approved") from None


def _replace(change: _Change, transaction: Transaction) -> None:
    """Replaces the files of one change. Errors: OSError, GlshadeError."""
    if change.first is not None:
        first = transaction.temporary()
        shutil.copyfile(change.target, first)
        transaction.replace(change.first, first)
    sidecar = transaction.temporary()
    sidecar.write_text(as_text(change.sidecar.model_dump(mode="json")), encoding="utf-8")
    transaction.replace(sidecar_path(change.target), sidecar)
    picture = transaction.temporary()
    shutil.copyfile(change.picture, picture)
    if sha256_of(picture) != change.sidecar.sha256:
        raise GlshadeError(f"{change.picture}: changed while it was being approved; nothing was approved")
    transaction.replace(change.target, picture)
    if change.forgotten is not None:
        transaction.replace(change.forgotten, None)
