"""Settings: the plugin's options on pytest's command line, and their twins in pytest's configuration file."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import pytest

UPDATES = ("none", "missing", "failed", "all", "variant")
SUMMARIES = ("html", "json", "junit")
# The values of the environment variable CI that mean "this is no CI". Every CI service sets another one, usually "true".
NO_CI = ("", "0", "false")


@dataclass(frozen=True)
class Settings:
    """The plugin's settings.

    start: the folder in which pytest was started, absolute.
    baselines: the folder of the baselines, absolute.
    results: the folder that gets the results, absolute.
    update: which baselines are written: one of UPDATES.
    summary: the summaries that are written, a subset of SUMMARIES.
    stability: how often each picture is drawn.
    disallow_unused: whether a baseline that no test has used fails the run.
    update_refused: True where the configuration file asks for updates, and they are refused because this is CI.
    """

    start: Path
    baselines: Path
    results: Path
    update: str
    summary: tuple[str, ...]
    stability: int
    disallow_unused: bool
    update_refused: bool = False


def read_settings(config: pytest.Config) -> Settings:
    """Returns the settings. Errors: pytest.UsageError, which names the option or the key of the configuration file."""
    update = _choice(config, "update", "none", UPDATES)
    refused = update != "none" and os.environ.get("CI", "").lower() not in NO_CI and not config.getoption("glshade_force")
    if refused and config.getoption("glshade_update") is not None:
        raise pytest.UsageError(
            f"--glshade-update {update} is refused because the environment variable CI is set, and nobody would look at the "
            "new baselines; add --glshade-force to write them anyway"
        )
    return Settings(
        start=config.invocation_params.dir,
        baselines=_folder(config, "baseline-path", "baselines"),
        results=_folder(config, "results-path", "glshade-results"),
        update="none" if refused else update,
        summary=_summaries(config),
        stability=_count(config, "stability"),
        disallow_unused=bool(_text(config, "disallow-unused")[0]),
        update_refused=refused,
    )


def _text(config: pytest.Config, name: str) -> tuple[str | None, str]:
    """Returns the value of an option, None where it is not given, and the place where it was given, for messages."""
    key = f"glshade_{name.replace('-', '_')}"
    value = config.getoption(key)
    if value is not None:
        return value, f"--glshade-{name}"
    return config.getini(key), key


def _choice(config: pytest.Config, name: str, default: str, allowed: tuple[str, ...]) -> str:
    """Returns the value of an option with a list of allowed values. Errors: pytest.UsageError."""
    value, place = _text(config, name)
    if value and value not in allowed:
        raise pytest.UsageError(f"{place}: {value!r} is none of {', '.join(allowed)}")
    return value or default


def _summaries(config: pytest.Config) -> tuple[str, ...]:
    """Returns the summaries to write. Errors: pytest.UsageError."""
    value, place = _text(config, "summary")
    kinds = tuple(kind.strip() for kind in (value or "html").split(","))
    for kind in kinds:
        if kind not in SUMMARIES:
            raise pytest.UsageError(f"{place}: {kind!r} is none of {', '.join(SUMMARIES)}; write commas between several")
    return kinds


def _count(config: pytest.Config, name: str) -> int:
    """Returns the value of an option that is a whole number of at least 1. Errors: pytest.UsageError."""
    value, place = _text(config, name)
    try:
        count = int(value or 1)
    except ValueError:
        count = 0
    if count < 1:
        raise pytest.UsageError(f"{place}: {value!r} is no whole number of at least 1")
    return count


def _folder(config: pytest.Config, name: str, default: str) -> Path:
    """Returns the folder that an option names.

    A path on the command line is relative to the folder in which pytest was started, and one in the configuration file is
    relative to that file's folder.
    """
    value, place = _text(config, name)
    if not value:
        return config.rootpath / default
    from_command_line = place.startswith("--")
    start = config.invocation_params.dir if from_command_line else (config.inipath or config.rootpath / "pytest.ini").parent
    return Path(os.path.abspath(start / value))
