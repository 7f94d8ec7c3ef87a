"""Binaries and Linker: cached programs are found again, damaged ones are ignored, and all draw the same picture."""

from __future__ import annotations

import ctypes
import errno
import os
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from glshade import BRDFS, Renderer, ShaderError, evaluate
from glshade.files import Cache
from glshade.gl.binaries import Binaries
from glshade.gl.context import Context, open_context
from glshade.gl.linker import GL_NUM_PROGRAM_BINARY_FORMATS, GL_VERSION, Linker
from glshade.gl.program import Program
from glshade.glsl.source import Source, Stage

KEY, OTHER = "0" * 64, "1" * 64
BINARY = (0x875F, bytes(range(256)) * 40)


@pytest.fixture
def binaries(tmp_path: Path) -> Binaries:
    return Binaries(Cache(tmp_path))


# --- files -----------------------------------------------------------------------------------------------------------


def test_what_is_kept_is_recalled(binaries: Binaries) -> None:
    assert binaries.recall(KEY) is None
    binaries.keep(KEY, BINARY)
    assert binaries.recall(KEY) == BINARY
    assert binaries.recall(OTHER) is None
    binaries.keep(KEY, (1, b"another"))
    assert Binaries(Cache(binaries.folder.parent)).recall(KEY) == (1, b"another")
    assert [file.name for file in binaries.folder.iterdir()] == [f"{KEY}.bin"]


def test_an_entry_is_replaced_as_a_whole(binaries: Binaries) -> None:
    """A reader that has opened the old file still reads the old content."""
    binaries.keep(KEY, BINARY)
    with binaries.path(KEY).open("rb") as old:
        binaries.keep(KEY, (1, b"another"))
        assert old.read().endswith(BINARY[1])


def test_the_folder_is_the_users(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "there"))
    assert Binaries().folder == tmp_path / "there" / "glshade" / "programs"
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert Binaries().folder == tmp_path / ".cache" / "glshade" / "programs"


@pytest.mark.parametrize(
    "spoil",
    [
        lambda entry: b"",
        lambda entry: bytes(len(entry)),
        lambda entry: entry[:10],
        lambda entry: entry[:60],
        lambda entry: entry[: len(entry) // 2],
        lambda entry: entry[:-1],
        lambda entry: entry + b"\0",
        lambda entry: entry[:-1] + bytes([entry[-1] ^ 1]),
        lambda entry: entry[:51] + bytes([entry[51] ^ 1]) + entry[52:],
        lambda entry: entry.replace(b"program 1", b"program 2"),
        lambda entry: np.random.default_rng(1).bytes(len(entry)),
    ],
)
def test_a_damaged_entry_is_ignored_and_replaced(spoil: Any, binaries: Binaries) -> None:
    binaries.keep(KEY, BINARY)
    path = binaries.path(KEY)
    path.write_bytes(spoil(path.read_bytes()))
    assert binaries.recall(KEY) is None
    binaries.keep(KEY, BINARY)
    assert binaries.recall(KEY) == BINARY


def test_an_entry_belongs_to_its_key(binaries: Binaries) -> None:
    binaries.keep(KEY, BINARY)
    binaries.path(KEY).rename(binaries.path(OTHER))
    assert binaries.recall(OTHER) is None


def test_a_folder_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "cache"):
        binaries = Binaries(Cache(folder))
        binaries.keep(KEY, BINARY)
        assert binaries.recall(KEY) is None
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]


@pytest.mark.parametrize("call", ["write_bytes", "replace", "scandir"])
@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS, errno.EACCES])
def test_a_disk_that_refuses(call: str, code: int, binaries: Binaries, monkeypatch: pytest.MonkeyPatch) -> None:
    binaries.keep(OTHER, BINARY)

    def refuse(path: Any, *more: Any) -> None:
        if call == "write_bytes":
            path.touch()
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(Path if call == "write_bytes" else os, call, refuse)
    again = Binaries(Cache(binaries.folder.parent))
    again.keep(KEY, BINARY)
    monkeypatch.undo()
    assert {file.name for file in binaries.folder.iterdir()} - {f"{KEY}.bin"} == {f"{OTHER}.bin"}, "nothing half done stays"
    assert again.recall(OTHER) == BINARY


def test_a_folder_without_the_right_to_write(binaries: Binaries) -> None:
    binaries.keep(OTHER, BINARY)
    binaries.folder.chmod(0o500)
    try:
        if os.access(binaries.folder, os.W_OK):
            pytest.skip("this user may write everywhere")
        binaries.keep(KEY, BINARY)
        assert binaries.recall(KEY) is None
        assert binaries.recall(OTHER) == BINARY
    finally:
        binaries.folder.chmod(0o700)


def test_the_least_recently_used_programs_go(tmp_path: Path) -> None:
    """Temporary files of a killed process count toward the limit and are removed too."""
    limit = 20 * len(BINARY[1])
    binaries = Binaries(Cache(tmp_path, limit))
    binaries.folder.mkdir()
    left = binaries.folder / ".left"
    left.write_bytes(b"x" * 1000)
    os.utime(left, (0, 0))
    for number in range(60):
        binaries.keep(f"{number:064}", BINARY)
        os.utime(binaries.path(f"{number:064}"), (number + 1, number + 1))
        assert sum(file.stat().st_size for file in binaries.folder.iterdir()) <= limit
    assert not left.exists()
    kept = [number for number in range(60) if binaries.path(f"{number:064}").exists()]
    assert len(kept) >= 9
    assert kept == list(range(60 - len(kept), 60)), "the newest"
    # An entry that is read becomes the most recently used one.
    assert binaries.recall(f"{kept[0]:064}") == BINARY
    # Another process with a lower limit removes the entries of this one.
    other = Binaries(Cache(tmp_path, limit // 4))
    other.keep(KEY, BINARY)
    assert sum(file.stat().st_size for file in binaries.folder.iterdir()) <= limit // 4
    assert other.recall(KEY) == BINARY
    assert other.recall(f"{kept[0]:064}") == BINARY


def test_many_writers(tmp_path: Path) -> None:
    """A concurrent reader finds a complete entry or none."""
    recalled: list[Any] = []
    values = [(writer, bytes([writer]) * (5000 + writer)) for writer in range(6)]

    def write(writer: int) -> None:
        binaries = Binaries(Cache(tmp_path, 50_000))
        for turn in range(40):
            binaries.keep(f"{turn % 5:064}", values[writer])
            recalled.append(binaries.recall(f"{(turn + writer) % 5:064}"))

    threads = [threading.Thread(target=write, args=(writer,)) for writer in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(recalled) == 240
    assert {value for value in recalled if value} <= set(values)
    assert any(recalled)
    assert not [file for file in (tmp_path / "programs").iterdir() if file.name.startswith(".")]


# --- programs --------------------------------------------------------------------------------------------------------


def stage(text: str, name: str) -> Stage:
    return Stage(text, tuple((name, number) for number, _ in enumerate(text.splitlines(), 1)))


def source(name: str, value: str = "") -> Source:
    """Returns a program with one uniform of this name."""
    vertex = "#version 330 core\nin vec2 a_p;\nvoid main() {\n    gl_Position = vec4(a_p, 0.0, 1.0);\n}\n"
    fragment = f"#version 330 core\nuniform float {name};\nout vec4 o;\nvoid main() {{\n    o = vec4({value or name});\n}}\n"
    return Source(stage(vertex, "v.vert"), stage(fragment, "f.frag"))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("GLSHADE_PROGRAM_CACHE", raising=False)
    return tmp_path / "glshade" / "programs"


@pytest.fixture
def context(folder: Path, renderer: Renderer) -> Iterator[Context]:
    """A context with an empty cache, made current."""
    backend: Any = renderer.context.backend
    opened = open_context(backend, program_cache=True)
    with opened.gl:
        if opened.linker is None:
            pytest.skip("the driver offers no program binaries")
        yield opened
    opened.release()


def entry(context: Context, source: Source) -> tuple[Linker, str]:
    assert context.linker is not None
    assert source.fragment is not None
    return context.linker, context.linker.key(source.vertex.text, source.fragment.text)


def test_a_program_is_kept_and_found(context: Context, folder: Path) -> None:
    """A cached program is loaded and not compiled: with another program's binary under its key, the other program results."""
    first, second = source("u_one"), source("u_two")
    assert Program(context, first).uniforms == ("u_one",)
    assert Program(context, second).uniforms == ("u_two",)
    linker, key = entry(context, first)
    assert {file.stem for file in folder.iterdir()} == {key, entry(context, second)[1]}
    binaries = Binaries(Cache(folder.parent))
    own, other = binaries.recall(key), binaries.recall(entry(context, second)[1])
    assert own
    assert other
    assert own[1] != other[1]
    binaries.keep(key, other)
    assert Program(context, first).uniforms == ("u_two",)
    # A program with a damaged entry is compiled from its text and cached again.
    path = binaries.path(key)
    path.write_bytes(path.read_bytes()[:-3])
    program = Program(context, first)
    assert program.uniforms == ("u_one",)
    assert binaries.recall(key) is not None
    program = Program(context, first)
    assert program.interface == {"attributes": {"a_p": "vec2"}, "uniforms": {"u_one": "float"}, "blocks": {}}
    assert linker.offers_binaries


@pytest.mark.parametrize("binary", [(0x875F, b"not a program" * 100), (0xDEAD, b"\0" * 64), (0x875F, b"\0")])
def test_what_the_driver_refuses_is_replaced(binary: tuple[int, bytes], context: Context, folder: Path) -> None:
    """An undamaged entry from another driver passes glshade's checks, but the driver rejects it."""
    wanted = source("u_one")
    _, key = entry(context, wanted)
    binaries = Binaries(Cache(folder.parent))
    binaries.keep(key, binary)
    program = Program(context, wanted)
    assert program.uniforms == ("u_one",)
    assert context.gl.error == "GL_NO_ERROR"
    assert binaries.recall(key) not in (None, binary)
    program.write("u_one", np.float32(0.25))
    assert pixel(context, program) == 0.25
    again = Program(context, wanted)
    assert pixel(context, again) == 0, "uniforms start at zero"
    again.write("u_one", np.float32(0.5))
    assert pixel(context, again) == 0.5


def pixel(context: Context, program: Program) -> float:
    gl = context.gl
    target = gl.framebuffer([gl.texture((1, 1), 4, dtype="f4")])
    target.use()
    gl.enable_only(moderngl.NOTHING)
    corners = gl.buffer(np.array([[-1, -1], [3, -1], [-1, 3]], dtype=np.float32).tobytes())
    gl.vertex_array(program.gl, [(corners, "2f", "a_p")]).render(moderngl.TRIANGLES)
    return float(np.frombuffer(target.read(components=4, dtype="f4"), dtype=np.float32)[0])


def test_errors_are_the_same(context: Context, folder: Path, renderer: Renderer) -> None:
    """Messages do not depend on the cache, even if it has an invalid entry for a program that does not compile."""
    backend: Any = renderer.context.backend
    wrong = [source("u_one", "u_two"), source("u_one", "v_none + u_one")]
    # Only linking finds an output and an input of different types.
    vertex = wrong[0].vertex.text.replace("void main() {", "out vec3 v_x;\nvoid main() {\n    v_x = a_p.xyx;")
    fragment = "#version 330 core\nin vec4 v_x;\nout vec4 o;\nvoid main() {\n    o = v_x;\n}\n"
    wrong.append(Source(stage(vertex, "v.vert"), stage(fragment, "f.frag")))
    plain = open_context(backend, program_cache=False)
    assert plain.linker is None
    for bad in wrong:
        messages = []
        for turn in (plain, context, context):
            with turn.gl, pytest.raises(ShaderError) as caught:
                Program(turn, bad)
            messages.append(str(caught.value))
            if turn is context:
                Binaries(Cache(folder.parent)).keep(entry(context, bad)[1], (0x875F, b"not a program"))
        assert len(set(messages)) == 1, messages
        assert ("v_x" if bad is wrong[-1] else "f.frag:5:") in messages[0]
    plain.release()


def test_transform_feedback_is_not_kept(context: Context, folder: Path) -> None:
    direction = [0.6, 0, 0.8]
    for _ in range(2):
        value = evaluate(BRDFS["lambert"](kd=1), direction, direction, on="vertex", context=context)
        assert value == pytest.approx(0.8 / np.pi)
    assert not folder.exists()


def test_an_interruption_is_not_lost(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """ctypes prints exceptions of callbacks and continues, so the Linker must store and raise them."""

    def interrupt(shader: int) -> None:
        raise KeyboardInterrupt

    assert context.linker is not None
    with monkeypatch.context() as patch:
        patch.setitem(context.linker._gl, "glCompileShader", interrupt)
        with pytest.raises(KeyboardInterrupt):
            Program(context, source("u_one"))
    assert Program(context, source("u_one")).uniforms == ("u_one",)


class Other:
    """A context object like the context's own, except that it returns another address for one function."""

    def __init__(self, context: Context, name: str, function: Any) -> None:
        assert context.linker is not None
        self._linker, self._name, self._function = context.linker, name, function

    def load_opengl_function(self, name: str) -> int:
        if name == self._name:
            return ctypes.cast(self._function, ctypes.c_void_p).value or 0
        return self._linker.load_opengl_function(name)


def test_another_driver_finds_nothing(context: Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    window = Other(context, "", None)
    binaries = Binaries(Cache(tmp_path))

    def key(window: Other, backend: str = "egl") -> str:
        return Linker(window, binaries, backend).key("vertex", "fragment")

    signature = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint)
    get = signature(window.load_opengl_function("glGetString"))
    newer = ctypes.create_string_buffer(b"4.6 (Core Profile) Mesa 99.0")
    lying = signature(lambda name: ctypes.addressof(newer) if name == GL_VERSION else get(name))
    keys = [key(window), key(window, "osmesa"), key(Other(context, "glGetString", lying))]
    with monkeypatch.context() as patch:
        patch.setattr("glshade.gl.linker.__version__", "99.0")
        keys.append(key(window))
    with monkeypatch.context() as patch:
        patch.setattr("glshade.gl.linker.processor", lambda: "flags: another")
        keys.append(key(window))
    for name, value in (("LP_NATIVE_VECTOR_WIDTH", "128"), ("GALLIVM_PERF", "nopt"), ("MESA_GLSL", "nopt")):
        with monkeypatch.context() as patch:
            patch.setenv(name, value)
            keys.append(key(window))
    assert len(set(keys)) == 8
    # The workers of a batch draw with fewer threads than a command that makes one picture.
    monkeypatch.setenv("LP_NUM_THREADS", "3")
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", "elsewhere")
    assert key(window) == keys[0]
    linker = Linker(window, binaries, "egl")
    assert len({linker.key("ab", "c"), linker.key("a", "bc"), linker.key("a", None), linker.key("ab", None)}) == 4


def test_a_driver_without_formats(context: Context, tmp_path: Path) -> None:
    signature = ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.POINTER(ctypes.c_int))

    def none(name: int, value: Any) -> None:
        assert name == GL_NUM_PROGRAM_BINARY_FORMATS
        value[0] = 0

    assert not Linker(Other(context, "glGetIntegerv", signature(none)), Binaries(Cache(tmp_path)), "egl").offers_binaries
    assert not Linker(Other(context, "glProgramBinary", 0), Binaries(Cache(tmp_path)), "egl").offers_binaries


SCENE = """
objects = [{ shape = "sphere", material = { brdf = "phong", kd = 0.5, ks = 0.5, exponent = 20 } }]
film = { size = [40, 30], samples = 4 }
"""


def test_the_same_picture(glshade: Any, folder: Path, tmp_path: Path, renderer: Renderer) -> None:
    """The picture is the same without a cache, when two processes fill it at once, from the cache, and without a folder for it.

    Mesa offers no binaries if its own cache is off.
    """
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    pictures = {}

    def draw(name: str, **environment: str) -> None:
        file = tmp_path / f"{name}.png"
        done = glshade("render", scene, "-o", file, "--backend", renderer.context.backend, **environment)
        assert done.returncode == 0, done.stderr
        assert not done.stderr
        pictures[name] = file.read_bytes()

    draw("off", GLSHADE_PROGRAM_CACHE="0")
    assert not folder.exists()
    draw("other", MESA_SHADER_CACHE_DISABLE="true")
    with ThreadPoolExecutor() as processes:
        list(processes.map(draw, ("filled", "filled at the same time")))
    if not folder.exists():
        pytest.skip("the driver offers no program binaries")
    entries = {file: file.stat().st_ino for file in folder.iterdir()}
    assert len(entries) == 2, "the program of the sphere, and the one that encodes the picture"
    draw("from the cache")
    assert {file: file.stat().st_ino for file in folder.iterdir()} == entries
    for file in entries:
        file.write_bytes(b"")
    draw("damaged")
    assert all(file.stat().st_size > 1000 for file in entries)
    nowhere = tmp_path / "nowhere"
    nowhere.write_text("a file, where a folder should be")
    # Mesa's own cache needs a folder; without one, Mesa writes a warning to stderr and offers no binaries.
    draw("nowhere", XDG_CACHE_HOME=str(nowhere), MESA_SHADER_CACHE_DIR=str(tmp_path))
    assert len(set(pictures.values())) == 1, {name: hash(picture) for name, picture in pictures.items()}
