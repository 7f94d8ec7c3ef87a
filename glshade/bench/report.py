"""Report: writes the results of `glshade bench`, and the machine they were measured on, as JSON and as tables."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from glshade.bench.contest import ContestRow, ContestTable
from glshade.bench.growth import AN_OBJECT, NEAR_LINEAR, Growth
from glshade.bench.jobs import TARGET, Jobs
from glshade.bench.works import BY_HAND, DOOR, GLSHADE, WORKS
from glshade.driver.clock import Spread
from glshade.version import __version__

# Version of the JSON object. It is raised if a key changes its meaning or is removed; added keys do not raise it.
SCHEMA = 1

# (title, rows of text). The first row holds the headings.
Table = tuple[str, list[tuple[str, ...]]]


@dataclass
class BenchReport:
    """The results of one run.

    repeat: number of rounds that were counted, at most
    small: True if the works were reduced, to see that they work
    contests: name of a work -> its table
    growths: the series that were measured
    jobs: the frame rates for each number of jobs; None if they were not measured
    """

    repeat: int
    small: bool
    contests: dict[str, ContestTable] = field(default_factory=dict)
    growths: list[Growth] = field(default_factory=list)
    jobs: Jobs | None = None

    def as_dict(self) -> dict[str, Any]:
        """Returns the report as JSON types."""
        return {
            "schema": SCHEMA,
            "date": date.today().isoformat(),
            "machine": machine(),
            "versions": versions([row.program for row in self._rows()]),
            "repeat": self.repeat,
            "small": self.small,
            "works": {name: table.as_dict() for name, table in self.contests.items()},
            "growth": [growth.as_dict() for growth in self.growths],
            "jobs": self.jobs and self.jobs.as_dict(),
        }

    @property
    def failed(self) -> list[str]:
        """The names of the works at which glshade itself has no result."""
        return [name for name, table in self.contests.items() if table.rows[0].fault is not None]

    def tables(self) -> Iterator[Table]:
        """Yields a table for each work that was measured, and one each for growth and jobs if these were measured."""
        for name, table in self.contests.items():
            yield f"{name}: {table.what}", list(_contest(table))
        if self.growths:
            yield "growth of the time of a frame with what is in it", list(_growths(self.growths))
        if self.jobs:
            yield f"jobs: {WORKS['W4'].what}", list(_jobs(self.jobs))

    def heading(self) -> list[str]:
        """Returns lines that describe the machine, the versions, the drivers and the rounds."""
        host = machine()
        named = ", ".join(f"{name} {number}" for name, number in versions([r.program for r in self._rows()]).items())
        drivers = dict.fromkeys(row.driver for row in self._rows() if row.driver)
        lines = [f"{host['cpu']}, {host['threads']} threads; {host['system']}; Python {host['python']}", named]
        if drivers:
            lines.append(f"drivers: {'; '.join(drivers)}")
        lines.append(f"median, and least to most, of {self.repeat} rounds in turn; ratio: glshade's time over the program's")
        if self.small:
            lines.append("small: the works are reduced, so the times are not comparable")
        return lines

    def _rows(self) -> list[ContestRow]:
        return [row for table in self.contests.values() for row in table.rows]


def machine() -> dict[str, Any]:
    """Returns the name of the CPU, the number of cores that this process may use, the system and the version of Python."""
    threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return {"cpu": _cpu(), "threads": threads, "system": platform.platform(terse=True), "python": platform.python_version()}


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


def versions(programs: Sequence[str]) -> dict[str, str]:
    """Returns the version of glshade and of each program's library: name -> version, "?" if unknown.

    The first word of a program's name is its library. "python", the bare interpreter, is left out.
    """
    numbers = {GLSHADE: __version__}
    for name in dict.fromkeys(program.split()[0] for program in programs if program not in (DOOR, "python")):
        try:
            numbers.setdefault(name, version(name))
        except PackageNotFoundError:
            numbers[name] = "?"
    return numbers


def markdown(report: BenchReport) -> str:
    """Returns the heading and the tables as GitHub's Markdown."""
    parts = ["\n".join(f"- {line}" for line in report.heading())]
    for title, (heads, *rows) in report.tables():
        lines = [heads, ("---",) * len(heads), *rows]
        parts.append(f"### {title[0].upper()}{title[1:]}\n\n" + "\n".join(f"| {' | '.join(line)} |" for line in lines))
    return "\n\n".join(parts) + "\n"


def _contest(table: ContestTable) -> Iterator[tuple[str, ...]]:
    """Yields the rows of a work's table."""
    scale = 1.0 if table.unit == "s" else 1e3
    commands = any(row.whole for row in table.rows)
    whole_heads = ("whole command",) if commands else ()
    yield ("program", table.unit, "range", *whole_heads, "ratio", "range", "target", "MB", "picture")
    for row in table.rows:
        label = row.program.replace(BY_HAND, f"{BY_HAND} by hand", 1) if row.program.startswith(BY_HAND) else row.program
        if row.fault is not None:
            yield (label, *["-"] * (7 if commands else 6), row.fault)
            continue
        whole = (_figures(row.whole, 1.0)[0] + " s" if row.whole else "-",) if commands else ()
        aim = "" if row.target is None else f"<= {row.target:.2f}: {_word(row.met)}"
        memory = "" if row.peak is None else f"{row.peak / 1e6:.0f}"
        if row.program == GLSHADE:
            aim = _limit(table)
            if table.memory is not None and row.peak is not None:
                memory += f" (<= {table.memory / 1e6:.0f}: {_word(row.peak <= table.memory)})"
        yield (label, *_figures(row.seconds, scale), *whole, *_figures(row.ratio, 1.0), aim, memory, _picture(row))


def _limit(table: ContestTable) -> str:
    """Returns the limit of glshade's time and whether it is kept; empty if there is no limit."""
    limited = table.limited
    if table.limit is None or limited is None:
        return ""
    scale = 1.0 if table.unit == "s" else 1e3
    over = "" if table.over is None else f" above {table.over}, {_short(limited * scale)} {table.unit}"
    return f"<= {table.limit * scale:g} {table.unit}{over}: {_word(limited <= table.limit)}"


def _picture(row: ContestRow) -> str:
    """Returns how a program's picture compares with glshade's."""
    if row.program in (GLSHADE, DOOR) or row.codes is None:
        return ""
    return "the same" if row.same else f"another ({row.codes} codes)"


def _growths(growths: Sequence[Growth]) -> Iterator[tuple[str, ...]]:
    yield "what", "from, to", "ms", "each", "exponent", "at the end", "target"
    for growth in growths:
        ends = f"{growth.sizes[0]:,}, {growth.sizes[-1]:,}"
        milliseconds = " ".join(f"{spread.median * 1e3:.3g}" for spread in growth.seconds)
        aim = f"<= {NEAR_LINEAR:g}" + (f", <= {AN_OBJECT * 1e6:g} us each" if growth.what == "objects" else "")
        exponents = (f"{growth.exponent:.2f}", f"{growth.at_the_end:.2f}")
        yield (growth.what, ends, milliseconds, f"{growth.each * 1e6:.3g} us", *exponents, f"{aim}: {_word(growth.met)}")


def _jobs(jobs: Jobs) -> Iterator[tuple[str, ...]]:
    yield "jobs", "frames/s", "range", "ratio", "range", "target"
    for count, rate in jobs.rates.items():
        last = count == max(jobs.rates)
        aim = f">= {TARGET:g}: {_word(jobs.met)}" if last else ""
        yield (str(count), *_figures(rate, 1.0), *_figures(jobs.ratio if last else None, 1.0), aim)


def _figures(spread: Spread | None, scale: float) -> tuple[str, str]:
    """Returns (median, range) of a measurement times `scale`, as text. Both texts are empty if there is no measurement."""
    if spread is None:
        return "", ""
    median, low, high = (_short(x * scale) for x in (spread.median, spread.low, spread.high))
    return median, f"{low} to {high}"


def _short(x: float) -> str:
    """Returns a number with three significant digits, or without decimals from 100 on."""
    return f"{x:.0f}" if x >= 100 else f"{x:.1f}" if x >= 10 else f"{x:.2f}"


def _word(met: bool | None) -> str:
    return "yes" if met else "no"
