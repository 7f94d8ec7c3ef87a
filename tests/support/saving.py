"""Saving: the ways in which programs save a file. Each function replaces the text of a file."""

from __future__ import annotations

import os
import time
from pathlib import Path


def in_place(path: Path, text: str) -> None:
    path.write_text(text)


def rename(path: Path, text: str) -> None:
    new = path.with_name(f".{path.name}.new")
    new.write_text(text)
    os.replace(new, path)


def like_vim(path: Path, text: str) -> None:
    backup = path.with_name(f"{path.name}~")
    probe = path.with_name("4913")
    probe.touch()
    probe.unlink()
    os.rename(path, backup)
    path.write_text(text)
    backup.unlink()


def truncate_then_write(path: Path, text: str) -> None:
    with path.open("w") as file:
        file.flush()
        time.sleep(0.05)
        file.write(text)


def gone_and_back(path: Path, text: str) -> None:
    path.unlink()
    time.sleep(0.05)
    path.write_text(text)


def swapped_link(path: Path, text: str) -> None:
    target = path.with_name(f".{path.stem}-{abs(hash(text))}")
    target.write_text(text)
    link = path.with_name(".link")
    link.symlink_to(target.name)
    os.replace(link, path)


STYLES = (in_place, rename, like_vim, truncate_then_write, gone_and_back, swapped_link)
