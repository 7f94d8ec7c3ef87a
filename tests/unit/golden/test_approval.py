"""Approvals: what becomes a baseline, what is refused, and what an interruption leaves."""

from __future__ import annotations

import json
import math
import os
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.compared import LLVMPIPE, SOFTPIPE, compare_all, write_picture

from glshade.errors import GlshadeError
from glshade.golden import transaction
from glshade.golden.approval import Approval, Refused, approve, approve_command, selected
from glshade.golden.baselines import Baselines
from glshade.golden.names import sidecar_path
from glshade.golden.results import Case, read
from glshade.golden.rules import Rule
from glshade.golden.sidecar import Driver, Origin, Sidecar, read_sidecar, sha256_of
from glshade.image import file as picture_file
from glshade.image.srgb import linear_to_srgb, srgb_to_linear
from glshade.image.view import displayed
from glshade.reference.picture import render
from glshade.scene.digest import scene_digest
from glshade.scene.file import load
from glshade.scene.override import split

GREY = np.full((20, 30, 3), 100, dtype=np.uint8)


class Project:
    """A folder with baselines and results, in which a user compares and approves."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.root, self.results = folder, folder / "baselines", folder / "results"

    def compare(self, pictures: Any, rule: Rule | None = None, driver: Driver | None = None, **origin: Any) -> list[Case]:
        """Compares pictures, by name, or one picture named ball.png."""
        pictures = pictures if isinstance(pictures, dict) else {"ball.png": pictures}
        made_by = "driver" if driver else "unknown"
        return compare_all(self.root, self.results, pictures, rule, Origin(made_by=made_by, driver=driver, **origin))

    def approve(self, *only: str, **options: Any) -> list[Approval]:
        return approve(self.results, selected(read(self.results), only), root=self.root, **options)

    def refused(self, *only: str, **options: Any) -> list[str]:
        """Approves, checks that all is refused and nothing changed, and returns the lines of the message."""
        before = files(self.root)
        with pytest.raises(Refused) as error:
            self.approve(*only, **options)
        assert files(self.root) == before
        *lines, last = str(error.value).split("\n")
        assert last.startswith("nothing was approved")
        return lines

    def sidecar(self, name: str = "ball.png") -> Sidecar:
        sidecar, note = read_sidecar(self.root / name)
        assert sidecar is not None, note
        return sidecar


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


def files(folder: Path) -> dict[str, bytes]:
    """Returns the contents of all files in a folder, by their paths in it."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_missing_baseline_becomes_one(project: Project) -> None:
    (case,) = project.compare({"cars/red one.png": GREY}, driver=LLVMPIPE, glshade="0.1.0", scene_digest="ab")
    assert (case.outcome, case.missing) == ("file", True)
    (approval,) = project.approve()
    assert approval == Approval("cars/red one.png", "cars/red one.png", "new")
    assert sorted(files(project.root)) == ["cars/red one.png", "cars/red one.png.glshade.json"]
    sidecar = project.sidecar("cars/red one.png")
    assert (sidecar.made_by, sidecar.driver, sidecar.scene_digest) == ("driver", LLVMPIPE, "ab")
    assert sidecar.first.sha256 == sidecar.sha256 == sha256_of(project.root / "cars/red one.png")
    (case,) = project.compare({"cars/red one.png": GREY}, driver=LLVMPIPE, glshade="0.1.0", scene_digest="ab")
    assert (case.outcome, case.missing) == ("same", False)
    assert selected([case]) == []
    (approval,) = project.approve("cars/red*")
    assert approval.what == "unchanged"


def test_only_what_did_not_pass_is_approved_unless_it_is_named(project: Project) -> None:
    project.compare({"a.png": GREY, "b.png": GREY, "sub/c.png": GREY})
    assert [approval.name for approval in project.approve()] == ["a.png", "b.png", "sub/c.png"]
    cases = project.compare({"a.png": GREY + 1, "b.png": GREY + 9, "sub/c.png": GREY})
    assert [case.name for case in selected(cases)] == ["b.png"]
    assert [case.name for case in selected(cases, ["*.png"])] == ["a.png", "b.png", "sub/c.png"]
    assert [case.name for case in selected(cases, ["[ac].png", "sub/*"])] == ["a.png", "sub/c.png"]
    assert selected(cases, ["A.png"]) == []
    (approval,) = project.approve()
    assert (approval.what, approval.distance) == ("replaced", pytest.approx(9 / 255))


@given(st.text(st.characters(blacklist_categories=("Cs", "Cc")), min_size=1, max_size=20), st.data())
def test_the_command_selects_exactly_the_named_case(name: str, data: st.DataObject) -> None:
    other = data.draw(st.text("ab*?[]! ", max_size=8).filter(lambda text: text != name))
    cases = [Case(id=text, name=text, baseline_root="/", outcome="fail") for text in (name, other)]
    command = shlex.split(approve_command(Path("my results"), [name]))
    assert command[:3] == ["glshade", "approve", "my results"]
    assert command[3] == "--only"
    assert selected(cases, command[4:]) == cases[:1]


def test_a_dry_run_changes_nothing(project: Project) -> None:
    project.compare(GREY)
    (approval,) = project.approve(dry_run=True)
    assert approval.what == "new"
    assert not project.root.exists()


def test_one_picture_that_cannot_be_approved_stops_all(project: Project) -> None:
    project.compare({"a.png": GREY, "b.png": GREY})
    lost = next(project.results.rglob("b-*/actual.png"))
    write_picture(lost, GREY + 1)
    (line,) = project.refused()
    assert line == f"{lost}: is not the picture that was compared: it has changed since; run the test again"
    lost.unlink()
    (line,) = project.refused()
    assert line == f"{lost}: No such file or directory"
    assert not project.root.exists()
    assert [approval.name for approval in project.approve("a.png")] == ["a.png"]


def test_pictures_that_cannot_be_baselines(project: Project) -> None:
    nan = np.full((4, 4, 3), math.nan, dtype=np.float32)
    project.compare({"ball.jpg": GREY, "ball.hdr": nan, "nan.exr": nan, "a@b.png": GREY})
    assert sorted(project.refused()) == [
        'a@b.png: "@" in a name marks the variants of a baseline; rename the picture',
        "ball.hdr: a baseline is a PNG or an OpenEXR file, which lose nothing: .png or .exr",
        "ball.jpg: a baseline is a PNG or an OpenEXR file, which lose nothing: .png or .exr",
        "nan.exr: holds infinite or NaN values, which every rule rejects; correct the scene or the shader",
    ]


def test_a_name_does_not_make_a_file_lossless(project: Project) -> None:
    project.compare({"ball.png": GREY, "cut.png": GREY, "text.exr": GREY, "lossy.exr": GREY, "deep.png": GREY})
    for path in project.results.rglob("actual.*"):
        name = path.parent.name.partition("-")[0]
        if name == "ball":
            shutil.copyfile(write_picture(project.folder / "ball.jpg", GREY), path)
        elif name == "cut":
            path.write_bytes(path.read_bytes()[:-40])
        elif name == "text":
            path.write_text("no picture")
        elif name == "lossy":
            oiio_write(path, "float", compression="dwaa")
        else:
            oiio_write(path, "uint16")
    believe_changes(project.results)
    jpeg, cut, deep, lossy, text = project.refused()
    assert "actual.png is no .png file, whatever its name says; write it as PNG or OpenEXR" in jpeg
    assert "actual.exr is no .exr file" in text
    assert lossy == "lossy.exr: is compressed with loss (dwaa); write it with another compression, such as zip"
    assert "holds numbers of the type uint16" in deep
    assert "cannot be read as a picture" in cut


def oiio_write(path: Path, kind: str, **attributes: str) -> None:
    """Writes a grey picture whose numbers have a type of OpenImageIO's."""
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(8, 8, 3, kind)
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(np.full((8, 8, 3), 0.5, dtype=np.float32))
    output.close()


def believe_changes(results: Path) -> None:
    """Makes a folder of results name its present pictures as those that were compared, as a stranger may do."""
    path = results / "results.json"
    text = json.loads(path.read_text())
    for case in text["cases"]:
        case["actual_sha256"] = sha256_of(results / case["actual"])
    path.write_text(json.dumps(text))


@pytest.mark.parametrize("name", ["../out.png", "/tmp/out.png", "sub/../../out.png", "link/out.png", ".git/out.png"])
def test_results_from_elsewhere_write_nothing_outside_the_folder(project: Project, name: str) -> None:
    project.compare(GREY)
    project.root.mkdir()
    (project.root / "link").symlink_to(project.folder)
    path = project.results / "results.json"
    path.write_text(json.dumps(json.loads(path.read_text())).replace('"ball.png"', json.dumps(name)))
    before = files(project.folder)
    assert len(project.refused()) == 1
    assert files(project.folder) == before


def test_two_cases_with_one_baseline_are_refused(project: Project) -> None:
    project.compare({"a.png": GREY, "A.png": GREY + 1})
    (line,) = project.refused()
    assert line == "a.png: two cases have this baseline, A.png and a.png; approve one with --only"
    project.approve("a.png")
    (line,) = project.refused("A.png")
    assert line.startswith(f"A.png: {project.root}/a.png has the same name but for upper and lower case")


def test_a_case_without_a_picture_is_refused(project: Project) -> None:
    project.compare(GREY)
    project.approve()
    project.compare({})
    path = project.results / "results.json"
    case = Case(id="x", name="ball.png", baseline_root=str(project.root), outcome="file", reason="is only in the reference")
    path.write_text(json.dumps({"tool": "glshade", "cases": [case.model_dump(mode="json")]}))
    assert project.refused() == ["ball.png: the run has no picture of it to approve (is only in the reference)"]


def ramp(name: str, step: int) -> Any:
    """Returns a picture that is, on average, half a code brighter after each step."""
    if name.endswith(".exr"):
        return srgb_to_linear(linear_to_srgb(np.full((20, 30, 3), 0.2)) + step * 0.5 / 255).astype(np.float32)
    pixels = GREY + np.uint8(step // 2)
    # Every second column is one code brighter.
    pixels[:, ::2] += np.uint8(step % 2)
    return pixels


def crept(project: Project, name: str, steps: range) -> int:
    """Compares and approves one step of the ramp after another, and returns the first one that is refused."""
    for step in steps:
        (case,) = project.compare({name: ramp(name, step)})
        assert case.passed or case.missing, "each step alone is too small to be noticed"
        try:
            project.approve(name)
        except Refused:
            return step
        first = project.root / ".glshade/first" / name
        sidecar = project.sidecar(name)
        assert sidecar.first.sha256 == sha256_of(first if first.exists() else project.root / name)
        assert sidecar.first.distance == pytest.approx(0.5 * (step - steps.start) / 255, rel=0.5)
    raise AssertionError("no step was refused")


@pytest.mark.parametrize("name", ["ball.png", "ball.exr"])
def test_a_picture_cannot_creep_away(project: Project, name: str) -> None:
    step = crept(project, name, range(50))
    # The rule "codes" lets a picture differ by one code, which are two steps; a rounding adds one or two.
    assert 3 <= step <= 4
    (line,) = project.refused(name)
    assert line.startswith(f"{name}: has crept away from the first approved picture, {project.root}/.glshade/first/{name}, in ")
    assert line.endswith("; look at both, or approve it with --accept-drift")
    project.approve(name, accept_drift=True)
    sidecar = project.sidecar(name)
    assert (sidecar.accepted_drift, sidecar.first.sha256) == (1, sidecar.sha256)
    assert sorted(files(project.root)) == [name, f"{name}.glshade.json"]
    # From here, it may not creep away again.
    assert crept(project, name, range(step, 50)) <= step + 4


def test_a_step_that_a_person_has_seen_begins_anew(project: Project) -> None:
    for pixels in (GREY, GREY + 1, GREY + 60):
        (case,) = project.compare(pixels)
        project.approve("ball.png")
    assert not case.passed
    sidecar = project.sidecar()
    assert sidecar.first.sha256 == sidecar.sha256
    assert sorted(files(project.root)) == ["ball.png", "ball.png.glshade.json"]


def test_a_step_that_passed_by_its_scene_does_not_begin_anew(project: Project) -> None:
    """More than the rule accepts may differ, and yet both pictures may be right. Nobody has looked at such a step."""
    project.compare(GREY)
    project.approve()
    project.compare(GREY + 60)
    path = project.results / "results.json"
    path.write_text(path.read_text().replace('"fail"', '"same"'))
    (line,) = project.refused("ball.png")
    assert "has crept away" in line


def test_masked_pixels_do_not_count_as_a_step(project: Project) -> None:
    """A mask leaves out a clock, for example. That the clock has changed does not mean that somebody has looked at the rest."""
    mask = np.zeros((20, 30, 3), dtype=np.uint8)
    mask[:5] = 255
    for step in range(3):
        pixels = GREY + np.uint8(step)
        pixels[:5] += np.uint8(50 * step)
        (case,) = project.compare(pixels)
        case = case.model_copy(update={"files": {"mask": "mask.png"}})
        write_picture(project.results / "mask.png", mask)
        text = {"tool": "glshade", "cases": [case.model_dump(mode="json")]}
        (project.results / "results.json").write_text(json.dumps(text))
        if step == 2:
            break
        project.approve("*")
    assert project.sidecar().first.distance == pytest.approx(1 / 255 * math.sqrt(15 / 20), rel=1e-3)
    assert "has crept away" in project.refused("*")[0]


def test_the_way_back_to_the_first_picture(project: Project) -> None:
    for pixels in (GREY, GREY + 1, GREY):
        project.compare(pixels)
        project.approve("*")
    sidecar = project.sidecar()
    assert sidecar.first.sha256 == sidecar.sha256
    assert sidecar.first.distance == 0
    assert sorted(files(project.root)) == ["ball.png", "ball.png.glshade.json"]


def test_a_baseline_without_a_sidecar_is_the_first_picture(project: Project) -> None:
    write_picture(project.root / "ball.png", GREY)
    project.compare(GREY + 1)
    project.approve("*")
    assert project.sidecar().first.distance == pytest.approx(1 / 255, rel=1e-3)
    project.compare(GREY + 2)
    assert "has crept away" in project.refused("*")[0]


def test_a_first_picture_that_is_lost(project: Project) -> None:
    for pixels in (GREY, GREY + 1):
        project.compare(pixels)
        project.approve("*")
    first = project.root / ".glshade/first/ball.png"
    first.write_bytes(b"another file")
    project.compare(GREY + 2)
    assert project.refused("*") == [
        f"ball.png: the first approved picture, {first}, is missing; restore it, or approve it with --accept-drift"
    ]
    project.approve("*", accept_drift=True)
    assert project.sidecar().accepted_drift == 1
    assert not first.exists()


def test_a_sidecar_that_cannot_be_read_is_not_replaced(project: Project) -> None:
    project.compare(GREY)
    project.approve()
    path = sidecar_path(project.root / "ball.png")
    project.compare(GREY + 60)
    path.write_text("{")
    (line,) = project.refused()
    assert line.startswith(f"{path}: is damaged: ")
    assert line.endswith("; or restore it from version control, or delete it to begin anew")
    path.unlink()
    project.approve()
    assert project.sidecar().sha256 == sha256_of(project.root / "ball.png")


def test_a_picture_of_the_same_pixels_gets_a_new_sidecar(project: Project) -> None:
    project.compare(GREY, driver=LLVMPIPE, scene_digest="old")
    project.approve()
    project.compare(GREY, driver=LLVMPIPE, scene_digest="new")
    (approval,) = project.approve("*")
    assert (approval.what, project.sidecar().scene_digest) == ("sidecar", "new")


def drivers(*names: str) -> list[Driver]:
    return [Driver(renderer=name) for name in names]


def test_variants(project: Project) -> None:
    project.compare(GREY, driver=LLVMPIPE)
    assert project.refused(as_variant=True) == ["ball.png: has no baseline yet; approve it without --as-variant first"]
    project.approve()
    project.compare(GREY + 20, driver=SOFTPIPE)
    (approval,) = project.approve(as_variant=True)
    assert (approval.path, approval.what) == ("ball@softpipe.png", "new")
    assert project.sidecar("ball@softpipe.png").driver == SOFTPIPE
    assert sorted(Baselines(project.root).names()) == ["ball.png"]
    # Each driver is now compared with its own picture, and approving replaces that one.
    for driver, pixels, path in ((SOFTPIPE, GREY + 40, "ball@softpipe.png"), (LLVMPIPE, GREY + 5, "ball.png")):
        (case,) = project.compare(pixels, driver=driver)
        assert (case.baseline, case.outcome) == (path, "fail")
        (approval,) = project.approve()
        assert (approval.path, approval.what) == (path, "replaced")
        assert project.compare(pixels, driver=driver)[0].passed
    (other,) = approval.notes
    assert other == f"ball@softpipe.png stays; its distance is {35 / 255:.3g}"


def test_no_more_than_four_variants(project: Project) -> None:
    project.compare(GREY, driver=LLVMPIPE)
    project.approve()
    for number, driver in enumerate(drivers("NVIDIA 1", "AMD Radeon 1", "Intel 1", "softpipe"), 1):
        project.compare(GREY + 20 * np.uint8(number), driver=driver)
        project.approve(as_variant=True)
    project.compare(GREY + 100, driver=drivers("Apple M1")[0])
    (line,) = project.refused(as_variant=True)
    assert line.startswith("ball.png: has 4 variants, and no more are allowed: ball.png (distance 0.392), ball@amd.png (")
    assert "ball@softpipe.png (distance 0.0784); replace the nearest one" in line
    # A variant that is there already may be replaced.
    (approval,) = project.approve(as_variant="softpipe")
    assert (approval.path, approval.what) == ("ball@softpipe.png", "replaced")


def test_keys_of_variants(project: Project) -> None:
    project.compare(GREY)
    project.approve()
    project.compare(GREY + 60)
    assert project.refused(as_variant=True) == ["ball.png: its driver is not known; name the variant: --as-variant KEY"]
    (line,) = project.refused(as_variant="../x")
    assert line.startswith("'../x' is no key of a variant")
    project.approve(as_variant="Mine")
    (line,) = project.refused(as_variant="mine")
    assert "upper and lower case" in line
    assert sorted(files(project.root)) == sorted(
        ["ball.png", "ball.png.glshade.json", "ball@Mine.png", "ball@Mine.png.glshade.json"]
    )


def test_variants_creep_on_their_own(project: Project) -> None:
    project.compare(GREY, driver=LLVMPIPE)
    project.approve()
    for pixels, options in ((GREY + 60, {"as_variant": True}), (GREY + 61, {})):
        project.compare(pixels, driver=SOFTPIPE)
        project.approve("*", **options)
    assert (project.root / ".glshade/first/ball@softpipe.png").exists()
    project.compare(GREY + 62, driver=SOFTPIPE)
    assert "/.glshade/first/ball@softpipe.png" in project.refused("*")[0]


def two_steps(folder: Path) -> Project:
    """Returns a project with two baselines, which both have moved, and with results that both are to be approved."""
    project = Project(folder)
    for pixels in (GREY, GREY + 1):
        project.compare({"a.png": pixels, "b.png": pixels})
        project.approve("*")
    project.compare({"a.png": GREY + 60, "b.png": GREY, "c/d.png": GREY})
    return project


def interrupt(patch: pytest.MonkeyPatch, number: int) -> None:
    """Makes Ctrl-C come before the call of os.replace with this number."""
    replace = os.replace
    ahead = iter(range(number))

    def interrupted(*arguments: Any) -> None:
        if next(ahead, None) is None:
            # Only this call is interrupted, and not those that undo the work.
            patch.setattr(os, "replace", replace)
            raise KeyboardInterrupt
        replace(*arguments)

    patch.setattr(os, "replace", interrupted)


def approved_at_once(project: Project) -> dict[str, bytes]:
    """Returns the files of the baselines after an approval that nothing interrupts, of which nothing is left."""
    before = project.folder / "before"
    shutil.copytree(project.root, before)
    project.approve("*")
    found = files(project.root)
    shutil.rmtree(project.root)
    before.rename(project.root)
    return found


def test_ctrl_c_anywhere_changes_nothing(tmp_path: Path) -> None:
    project = two_steps(tmp_path)
    before, after = files(project.root), approved_at_once(project)
    for number in range(100):
        with pytest.MonkeyPatch.context() as patch:
            interrupt(patch, number)
            try:
                project.approve("*")
            except KeyboardInterrupt:
                assert files(project.root) == before
                assert not (project.root / "c").exists()
                continue
        break
    assert 5 < number < 99
    assert files(project.root) == after


def test_what_a_killed_approval_leaves_is_consistent_and_is_completed(tmp_path: Path) -> None:
    """A killed process undoes nothing. Each picture still has its own sidecar, or one that is known to be another's."""
    project = two_steps(tmp_path)
    before, after = files(project.root), approved_at_once(project)
    shutil.copytree(project.root, tmp_path / "before")
    for number in range(100):
        shutil.rmtree(project.root)
        shutil.copytree(tmp_path / "before", project.root)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, "fsync", lambda file: None)  # to save time
            patch.setattr(transaction, "_restore", lambda path, old: None)
            patch.setattr(transaction, "_remove_if_empty", lambda folder: None)
            interrupt(patch, number)
            try:
                project.approve("*")
            except KeyboardInterrupt:
                pass
            else:
                break
        for name, contents in files(project.root).items():
            if name.endswith(".png"):
                assert contents in (before.get(name), after.get(name))
                sidecar, note = read_sidecar(project.root / name)
                assert name.startswith(".glshade") or sidecar or "it belongs to another picture; approve the picture" in note
        project.approve("*")
        assert files(project.root) == after
    assert 5 < number < 99


def test_a_folder_that_cannot_be_written_is_named(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    project.compare(GREY)
    project.root.write_text("no folder")
    with pytest.raises(GlshadeError, match="baselines: cannot be written: Not a directory; nothing was approved"):
        project.approve()
    project.root.unlink()

    make = os.mkdir

    def refuse(path: str, *arguments: Any) -> None:
        if transaction.STAGE in path:
            raise PermissionError(13, "Permission denied", path)
        make(path, *arguments)

    project.root.mkdir()
    with monkeypatch.context() as patch:
        patch.setattr(os, "mkdir", refuse)
        with pytest.raises(GlshadeError, match=f"^{project.root}: cannot be written: Permission denied; nothing was approved$"):
            project.approve()
    project.root.rmdir()

    def full(*arguments: Any) -> None:
        raise OSError(28, "No space left on device", *arguments)

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(GlshadeError, match="cannot be written: No space left on device; nothing was approved"):
        project.approve()
    assert not project.root.exists()


SCENE = """
objects = [{ shape = "sphere", material = { brdf = "lambert", kd = 0.5 } }]
film = { size = [24, 16], background = [0.1, 0.1, 0.1, 0.5] }
"""


@pytest.fixture
def scene(project: Project) -> Path:
    path = project.folder / "scenes/ball.toml"
    path.parent.mkdir()
    path.write_text(SCENE)
    return path


def run_scene(project: Project, scene: Path, *overrides: str, name: str = "balls/ball.png") -> list[Case]:
    """Compares a black picture with the baseline of a scene."""
    digest = scene_digest(load(scene, [split(text) for text in overrides]))
    origin: Any = {"scene": str(scene), "overrides": overrides, "scene_digest": digest}
    black = np.zeros((16, 24, 4), dtype=np.float32 if name.endswith(".exr") else np.uint8)
    return project.compare({name: black}, driver=LLVMPIPE, **origin)


@pytest.mark.parametrize("name", ["balls/ball.png", "balls/ball.exr"])
def test_the_reference_makes_a_baseline(project: Project, scene: Path, name: str) -> None:
    (case,) = run_scene(project, scene, "film.exposure=1", name=name)
    (approval,) = project.approve(from_reference=True)
    assert (approval.path, approval.what) == (name, "new")
    sidecar = project.sidecar(name)
    assert (sidecar.made_by, sidecar.driver) == ("reference", None)
    assert (sidecar.scene, sidecar.overrides) == ("../../scenes/ball.toml", ("film.exposure=1",))
    assert sidecar.scene_path(project.root / name) == scene
    assert sidecar.scene_digest == case.scene_digest
    expected = render(load(scene, {"film.exposure": 1}))
    expected = expected if name.endswith(".exr") else displayed(expected, "srgb")
    (part,) = picture_file.parts(project.root / name)
    assert np.array_equal(picture_file.read_part(project.root / name, part), expected.pixels)
    # A run that does not name the scene goes on with that of the sidecar.
    project.compare({name: np.zeros((16, 24, 4), dtype=expected.pixels.dtype)})
    (approval,) = project.approve(from_reference=True)
    assert approval.what == "unchanged"
    # Approving the picture of a driver in its place is possible, and told.
    (approval,) = project.approve()
    sidecar = project.sidecar(name)
    assert (sidecar.scene, sidecar.overrides) == ("../../scenes/ball.toml", ("film.exposure=1",))
    assert approval.notes == (
        "the reference had made the old picture; `--from reference` approves the reference's picture again",
    )


def test_scenes_that_the_reference_cannot_draw(project: Project, scene: Path) -> None:
    project.compare(GREY)
    assert project.refused(from_reference=True) == [
        "ball.png: neither the run nor a sidecar names a scene file that the reference could draw"
    ]
    run_scene(project, scene, 'film.aovs=["depth"]', name="ball.exr")
    (line,) = project.refused(from_reference=True)
    assert "film.aovs: the reference draws the picture alone, without layers" in line
    run_scene(project, scene)
    scene.write_text(SCENE.replace("0.5 }", "0.6 }"))
    (line,) = project.refused(from_reference=True)
    assert line == f"balls/ball.png: {scene} has changed since this run; run the test again"
    scene.write_text("objects = 3")
    (line,) = project.refused(from_reference=True)
    assert line.startswith(f"{scene}: objects: ")
    scene.unlink()
    assert len(project.refused(from_reference=True)) == 1


def test_results_of_another_machine(project: Project, scene: Path) -> None:
    """The paths in the results are those of the other machine, where the project lay elsewhere."""
    run_scene(project, scene)
    elsewhere = project.folder.with_name("elsewhere")
    project.folder.rename(elsewhere)
    moved = Project(elsewhere)
    for options in ({}, {"from_reference": True}):
        moved.approve("*", **options)
        sidecar = moved.sidecar("balls/ball.png")
        assert sidecar.scene_path(moved.root / "balls/ball.png") == elsewhere / "scenes/ball.toml"
    assert not project.folder.exists()


def test_the_reference_does_not_creep(project: Project, scene: Path) -> None:
    run_scene(project, scene)
    project.approve(from_reference=True)
    for exposure in range(1, 6):
        run_scene(project, scene, f"film.exposure={exposure * 0.01}")
        project.approve("*", from_reference=True)
    assert project.sidecar("balls/ball.png").first.sha256 == project.sidecar("balls/ball.png").sha256
