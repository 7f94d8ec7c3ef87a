"""docs/brdfs.md agrees with the models' declarations and has a picture of each. Its costs are those of one machine."""

from __future__ import annotations

import importlib
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import pytest

from glshade import BRDFS
from glshade.bench.brdfs import Cost, Costs
from glshade.brdfs import Brdf, Colour, Parameter, parameter
from glshade.driver.census import KINDS, Operations
from glshade.driver.clock import Spread
from glshade.image import file as picture_file
from glshade.presets import PRESETS

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "script"))
book = importlib.import_module("book")
pages = importlib.import_module("pages")
PAGE = (ROOT / "docs" / "brdfs.md").read_text(encoding="utf-8")


class Tinted(Brdf):
    """A model whose parameters are all colours."""

    source: ClassVar[str] = "this test"

    brdf: Literal["tinted"] = "tinted"
    tint: Colour = parameter((0.5, 0.5, 0.5), Parameter("reflectance", base=True))
    shade: Colour = parameter((0.2, 0.2, 0.2), Parameter("reflectance of ambient light"))


@pytest.fixture
def copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a copy of the page (brdfs.md) and of its pictures (pictures/), which a test may change."""
    shutil.copy(book.PAGE, tmp_path / "brdfs.md")
    shutil.copytree(book.PICTURES, tmp_path / "pictures")
    monkeypatch.setattr(book, "PAGE", tmp_path / "brdfs.md")
    monkeypatch.setattr(book, "PICTURES", tmp_path / "pictures")
    return tmp_path


def section(name: str) -> str:
    return PAGE.split(f"\n## {name}\n")[1].split("\n## ")[0]


def test_it_is_current() -> None:
    done = subprocess.run([sys.executable, ROOT / "script" / "book.py", "--check"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", list(BRDFS))
def test_a_section_says_all_that_the_model_declares(name: str) -> None:
    model, text = BRDFS[name], section(name)
    assert model.source in text
    for key, declared in model.parameters().items():
        assert re.search(rf"^\| `{key}` \| (number|colour) \|.*{re.escape(declared.description)}", text, re.MULTILINE)
    for option in model.choices():
        assert f"| `{option}` | option | " in text
    for law, words in (("reciprocity", "Reciprocity"), ("energy", "Energy")):
        said = f"- {words}: not kept: {model.breaks[law]}." if law in model.breaks else f"- {words}: kept"
        assert said in text
    assert all(f"- Limit: {limit.says}" in text for limit in model.limits())
    assert all(f"[`{preset}`](#presets)" in text for preset, one in PRESETS.items() if one.material["brdf"] == name)


def test_every_preset_has_its_row() -> None:
    assert re.findall(r"^\| `(\w+)` \| \[`", section("presets".title()), re.MULTILINE) == list(PRESETS)


class TestCheck:
    """--check finds outdated words and missing parts; it ignores measured figures."""

    def test_other_figures_are_no_fault(self, copy: Path) -> None:
        before = book.faults()
        changed = re.sub(r"\d\.\d \(\d\.\d to \d\.\d\)", "7.7 (7.6 to 7.8)", PAGE)
        assert changed != PAGE
        (copy / "brdfs.md").write_text(changed)
        assert book.faults() == before

    def test_other_words_are(self, copy: Path) -> None:
        (copy / "brdfs.md").write_text(PAGE.replace("- Reciprocity: kept.", "- Reciprocity: perhaps.", 1))
        assert "docs/brdfs.md is not what the models say" in book.faults()

    def test_a_model_without_costs_or_picture_is(self, copy: Path) -> None:
        (copy / "brdfs.md").write_text(re.sub(r"(<!-- cost of phong -->\n).*?(<!-- end -->)", r"\1\2", PAGE, flags=re.DOTALL))
        (copy / "pictures" / "phong.png").rename(copy / "pictures" / "fong.png")
        found = book.faults()
        assert "docs/brdfs.md has no cost of phong" in found
        assert "docs/images/brdfs has no picture of phong" in found
        assert "docs/images/brdfs/fong.png is of no model" in found

    def test_no_page_at_all_is(self, copy: Path) -> None:
        (copy / "brdfs.md").unlink()
        assert len(book.faults()) == 1 + len(BRDFS)


class TestMeasured:
    """The measured text between the marks."""

    @staticmethod
    def costs(operations: Any) -> Costs:
        one, other = Spread(4.96, 4.8, 5.64), Spread(-0.01, -0.02, 0.31)
        rows = [Cost(name, said, one, other, operations, 1234) for name in BRDFS for said in ("", "fresnel schlick")]
        return Costs("llvmpipe", "4.5", 2, "core", {"pixel": 64, "vertex": 64}, 7, tuple(rows))

    def test_a_row_for_each_model_and_option(self) -> None:
        kinds = dict.fromkeys(KINDS, 0) | {"add": 3, "mul": 2}
        found = book.measured(self.costs(Operations(kinds)))
        whole = found["cost of all"]
        assert "llvmpipe; 4.5, with 2 threads" in " ".join(whole.split())
        assert whole.count("| [`phong`](#phong) | 5.0 (4.8 to 5.6) | 0.0 (0.0 to 0.3) | 5 | 1,234 |") == 1
        assert whole.count("| &nbsp; fresnel schlick |") == len(BRDFS)
        assert "| default | 5.0 (4.8 to 5.6) | 0.0 (0.0 to 0.3) | 5: 3 add, 2 mul | 1,234 |" in found["cost of phong"]

    def test_a_driver_that_shows_no_operations(self) -> None:
        found = book.measured(self.costs(None))
        assert "| default | 5.0 (4.8 to 5.6) | 0.0 (0.0 to 0.3) | - | 1,234 |" in found["cost of lambert"]

    def test_it_is_kept_when_only_the_words_are_written(self) -> None:
        text = book.page(book.measured(self.costs(None)))
        assert book.page(book.kept(text)) == text
        assert book.words(text) == book.words(book.page({}))
        assert text != book.page({})

    def test_errors_are_those_of_the_other_page(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        (tmp_path / "accuracy.md").write_text(
            "# A\n\n## B\n\n| `phong` | 4 | 1.53 | 1.60 | both near n | exponent 32 | 4.9e-08 | 1.1e-07 |\n"
            "\n## C\n\n| `phong` | 2e-06 | 1.2e-07 | 1.1e-07 |\n"
        )
        monkeypatch.setattr(book, "ACCURACY", tmp_path / "accuracy.md")
        (name, line), *others = book.errors().items()
        assert (name, others) == ("phong", [])
        assert "1.60 x conditioning at worst (promised: 4), 1.2e-07 x max(1, f cos) at usual parameters" in line
        monkeypatch.setattr(book, "ACCURACY", tmp_path / "none.md")
        assert book.errors() == {}


class TestPictures:
    """The pictures in docs/images/brdfs, and the samples that they show."""

    @pytest.mark.parametrize("name", list(BRDFS))
    def test_four_spheres_and_their_lobes(self, name: str) -> None:
        pixels = picture_file.read(book.PICTURES / f"{name}.png")[0][..., :3]
        side = book.SIDE
        assert pixels.shape == (side + side * 3 // 4, 4 * side, 3)
        # A sphere stands before white, and no two materials look alike.
        tiles = [pixels[:side, i * side : (i + 1) * side] for i in range(4)]
        for tile in tiles:
            assert (tile[0, 0] > 0.95).all()
            assert (tile.min(axis=2) < 0.9).mean() > 0.5
        assert all(np.abs(one - other).max() > 0.02 for i, one in enumerate(tiles) for other in tiles[:i])

    @pytest.mark.parametrize("name", list(BRDFS))
    def test_every_model_has_four_different_samples(self, name: str) -> None:
        found = book.materials(BRDFS[name])
        assert len(found) == 4
        assert all(one != other for i, one in enumerate(found) for other in found[:i])

    def test_the_first_scalar_varies_where_a_model_names_no_samples(self) -> None:
        assert BRDFS["burley"].samples == ()
        assert book.samples(BRDFS["burley"]) == [{"roughness": x} for x in (0.0, 0.33, 0.67, 1.0)]
        # The usual exponents cover three decades, so the samples have equal ratios.
        assert book.samples(BRDFS["phong"]) == [{"exponent": x} for x in (1.0, 10.0, 100.0, 1000.0)]

    def test_the_first_colour_varies_where_a_model_has_no_scalars(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(book, "BRDFS", {"tinted": Tinted})
        assert [one.tint for one in book.materials(Tinted)] == [(x, x, x) for x in (0.1, 0.3, 0.6, 1.0)]
        text = book.page({})
        assert "From left to right: tint 0.1; tint 0.3; tint 0.6; tint 1." in text
        assert "| `tint` | colour | 0.5 |" in text

    def test_they_are_small(self) -> None:
        assert sum(path.stat().st_size for path in book.PICTURES.iterdir()) < 1.5e6


def test_tables_of_markdown() -> None:
    assert pages.table(("a", "b"), [("x", 1), ("|l + v|", 2)]) == "| a | b |\n|---|---|\n| x | 1 |\n| \\|l + v\\| | 2 |\n"
