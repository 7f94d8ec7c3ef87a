"""The pytest plugin: compares the pictures of tests with baselines, and with the float64 reference (docs/ci.md).

pytest loads this module in every run, also where no test uses it. So it imports nothing, and keeps to what pytest must know at
its start. The rest of the plugin is loaded when an option is given, or when a test asks for the fixture.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Generator
    from pathlib import Path

    from glshade.golden.pytest_plugin.process import Process
    from glshade.golden.pytest_plugin.regression import RenderRegression

KEY: pytest.StashKey[Process] = pytest.StashKey()
MARK = "glshade_compare"
FIXTURE = "render_regression"
# The options on the command line: name, placeholder of the value, help. Each has a twin in pytest's configuration file.
OPTIONS = (
    ("baseline-path", "FOLDER", "folder of the baselines [ROOT/baselines]"),
    ("results-path", "FOLDER", "folder for the results [ROOT/glshade-results]"),
    ("update", "WHICH", "baselines to write: none, missing, failed, all or variant [none]"),
    ("summary", "KINDS", "summaries to write: html, json, junit, with commas between several [html]"),
    ("stability", "N", "draw each picture N times, and fail if the drawings differ [1]"),
    ("shaders", "FOLDERS", "folders of shaders that files *.test.glsl include, with commas between several"),
    ("disallow-unused", "", "fail the run if there are baselines that no test uses"),
)


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    """Adds the options."""
    group = parser.getgroup("glshade", "glshade: regression tests of pictures")
    for name, value, help in OPTIONS:
        key = f"glshade_{name.replace('-', '_')}"
        kind: dict[str, Any] = {"metavar": value} if value else {"action": "store_const", "const": True}
        twin: Any = "string" if value else "bool"
        group.addoption(f"--glshade-{name}", dest=key, default=None, help=help, **kind)
        parser.addini(key, help, type=twin, default=None)
    # This option has no twin: a file that always forces updates would make their refusal pointless.
    group.addoption("--glshade-force", action="store_true", help="allow --glshade-update in CI")
    # pytest rewrites the assert statements of every package that contains a plugin. That would make `import glshade` a third
    # slower in every run where pytest cannot store what it has compiled, and glshade's asserts are no tests.
    getattr(pluginmanager.rewrite_hook, "_must_rewrite", set()).discard("glshade")
    getattr(pluginmanager.rewrite_hook, "_marked_for_rewrite_cache", {}).clear()


def pytest_configure(config: pytest.Config) -> None:
    """Checks the options that are given. Errors: pytest.UsageError."""
    config.addinivalue_line(
        "markers", f"{MARK}(rule=None, name=None, mask=None): compares the picture that the test returns with its baseline"
    )
    keys = [f"glshade_{name.replace('-', '_')}" for name, _, _ in OPTIONS]
    if any(config.getoption(key) is not None or config.getini(key) is not None for key in keys):
        _process(config)


def _process(config: pytest.Config) -> Process:
    """Returns the plugin's state in this process, made at the first call. Errors: pytest.UsageError for a bad option."""
    if KEY not in config.stash:
        from glshade.golden.pytest_plugin.process import start

        process = config.stash[KEY] = start(config)
        if process.settings.disallow_unused:
            from glshade.golden.pytest_plugin.unused import Watcher

            config.pluginmanager.register(Watcher(process))
    return config.stash[KEY]


@pytest.fixture
def render_regression(request: pytest.FixtureRequest) -> RenderRegression:
    """Compares pictures with baselines: `check(picture)`, `same(a, b)`, `laws(scene)` and `digits(model)`."""
    from glshade.golden.pytest_plugin.regression import RenderRegression

    return RenderRegression.of(_process(request.config), request)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collects files of unit tests that are written in GLSL."""
    if not file_path.name.endswith(".test.glsl"):
        return None
    from glshade.golden.pytest_plugin.glsl_tests import ShaderTestFile

    file: pytest.Collector = ShaderTestFile.from_parent(parent, path=file_path)
    return file


def pytest_itemcollected(item: pytest.Item) -> None:
    """Gives a test with the mark the fixture."""
    if isinstance(item, pytest.Function) and item.get_closest_marker(MARK) and FIXTURE not in item.fixturenames:
        item.fixturenames.append(FIXTURE)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Fails a test whose mark could have no effect."""
    # A mark of a whole module holds for its doctests, too, which return nothing.
    if isinstance(item, pytest.Function) and item.get_closest_marker(MARK):
        from glshade.golden.pytest_plugin.marked import check_test

        check_test(item)


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> Generator[None, object, object]:
    """Compares the picture that a test with the mark returns."""
    marker = pyfuncitem.get_closest_marker(MARK)
    if marker is None:
        return (yield)
    from glshade.golden.pytest_plugin.marked import comparing

    regression: Any = pyfuncitem.funcargs[FIXTURE]
    with comparing(pyfuncitem, marker, regression):
        return (yield)


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Gives a worker of pytest-xdist the name of the run."""
    node.workerinput["glshade_run"] = _process(node.config).run


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any, error: object) -> None:
    """Takes the counts of a worker of pytest-xdist that has ended."""
    _process(node.config).add(getattr(node, "workeroutput", {}).get("glshade"), lost=bool(error))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Writes the summaries. A worker of pytest-xdist leaves them to the controller, and tells it the counts."""
    process = session.config.stash.get(KEY, None)
    if process is None:
        return
    if process.worker:
        session.config.workeroutput["glshade"] = vars(process.counts)  # type: ignore[attr-defined]
    elif process.settings.disallow_unused or process.used():
        from glshade.golden.pytest_plugin.finish import finish_run

        finish_run(session, process)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Prints what the plugin has written, and why it fails the run."""
    for text, fails in config.stash[KEY].lines if KEY in config.stash else ():
        terminalreporter.write_line(text, red=fails, bold=fails)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Closes the OpenGL contexts."""
    import sys

    glsl_tests = sys.modules.get("glshade.golden.pytest_plugin.glsl_tests")
    if glsl_tests is not None:
        glsl_tests.close(config)
    process = config.stash.get(KEY, None)
    if process is not None and process.active is not None:
        process.active.close()
