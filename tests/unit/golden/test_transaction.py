"""Transactions: all files are replaced, or none, wherever the work is interrupted."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from glshade.golden import transaction as module
from glshade.golden.transaction import Transaction, all_or_none

BEFORE = {"a.png": "old", "sub/b.png": "old", "c.png": "old", "link.png": "old"}
AFTER = {"a.png": "new", "sub/b.png": "new", "link.png": "new", "sub/deep/d.png": "new"}


def tree(root: Path) -> dict[str, Any]:
    """Returns path -> contents of all files and folders below a folder; a link counts as what it leads to."""
    return {str(path.relative_to(root)): path.read_text() if path.is_file() else "" for path in root.rglob("*")}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "root"
    for name, text in BEFORE.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    (tmp_path / "elsewhere.png").write_text("old")
    (root / "link.png").unlink()
    (root / "link.png").symlink_to("../elsewhere.png")
    return root


def change(root: Path) -> None:
    """Replaces, adds and deletes files."""
    with all_or_none(root) as transaction:
        for name, text in AFTER.items():
            replace(transaction, root / name, text)
        transaction.replace(root / "c.png", None)


def interrupted(root: Path, names: Iterable[str]) -> None:
    """Replaces files, and is then interrupted by Ctrl-C."""
    with all_or_none(root) as transaction:
        for name in names:
            replace(transaction, root / name, "new")
        raise KeyboardInterrupt


def replace(transaction: Transaction, path: Path, text: str) -> None:
    new = transaction.temporary()
    new.write_text(text)
    transaction.replace(path, new)


def test_all_files_are_replaced(root: Path) -> None:
    change(root)
    assert {name: text for name, text in tree(root).items() if text} == AFTER
    assert not list(root.rglob(".*"))
    # A link is replaced, and not the file to which it leads.
    assert not (root / "link.png").is_symlink()
    assert (root.parent / "elsewhere.png").read_text() == "old"


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt(), MemoryError()])
@pytest.mark.parametrize("name", ["os.replace", "os.link", "Path.unlink", "Path.mkdir", "os.fsync"])
def test_an_interruption_anywhere_changes_nothing(
    root: Path, monkeypatch: pytest.MonkeyPatch, name: str, error: BaseException
) -> None:
    """Each call of the function fails in turn, until there are no more calls."""
    owner: Any = {"os": os, "Path": Path}[name.partition(".")[0]]
    original = getattr(owner, name.partition(".")[2])
    before = tree(root)
    for failing in range(100):
        copy = root.with_name(f"copy{failing}")
        shutil.copytree(root, copy, symlinks=True)
        calls = 0

        def fail(*arguments: Any, failing: int = failing, **options: Any) -> Any:
            nonlocal calls
            calls += 1
            if calls == failing + 1:
                raise error
            return original(*arguments, **options)

        with monkeypatch.context() as patch:
            patch.setattr(owner, name.partition(".")[2], fail)
            try:
                change(copy)
            except type(error):
                assert tree(copy) == before
            else:
                # A folder that cannot be written to the disk, and a missing link, are no errors.
                assert {path: text for path, text in tree(copy).items() if text} == AFTER
        if calls <= failing:
            break
    assert 1 <= failing < 99


def test_a_file_system_without_hard_links(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: Any, **options: Any) -> None:
        raise OSError("no links here")

    monkeypatch.setattr(os, "link", refuse)
    before = tree(root)
    with pytest.raises(KeyboardInterrupt):
        interrupted(root, BEFORE)
    assert tree(root) == before
    assert (root / "link.png").is_symlink()


def test_the_folder_is_made_and_removed_again(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        interrupted(tmp_path / "x/y", ["z/a.png"])
    assert tree(tmp_path) == {}
    with all_or_none(tmp_path / "x/y") as transaction:
        replace(transaction, tmp_path / "x/y/z/a.png", "new")
    assert tree(tmp_path)["x/y/z/a.png"] == "new"


def test_an_error_in_undoing_does_not_stop_the_rest(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    restore = module._restore

    def fail_once(path: Path, old: Path) -> None:
        if path.name == "b.png":
            raise OSError("cannot be undone")
        restore(path, old)

    monkeypatch.setattr(module, "_restore", fail_once)
    with pytest.raises(OSError, match="cannot be undone"):
        interrupted(root, BEFORE)
    assert {name: text for name, text in tree(root).items() if text} == {**BEFORE, "sub/b.png": "new"}
