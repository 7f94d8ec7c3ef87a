"""Costs of the models and the census of operations. No test depends on the speed of the machine."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from glshade import BRDFS, Renderer, ShaderError
from glshade.bench.brdfs import NOTHING, operations, size, source, variants
from glshade.driver.census import KINDS, Census, Operations, censuses, count
from glshade.driver.clock import Spread, difference, seconds
from glshade.driver.workload import Workload
from glshade.gl.program import Program
from glshade.glsl.shaders import expand
from glshade.glsl.source import Code, Source, Stage

# A stage as Mesa 22 prints it.
OLD = """NIR before handing off to driver:
shader: MESA_SHADER_FRAGMENT
impl main {
	block block_0:
	vec1 32 ssa_0 = load_const (0x3f800000 = 1.000000)
	vec4 32 ssa_20 = (float32)txf ssa_19 (coord), ssa_0 (lod), 0 (texture), 0 (sampler)
	vec3 32 ssa_27 = intrinsic load_ubo (ssa_25, ssa_26) (access=0, align_mul=1073741824)
	vec1 32 ssa_32 = fneg ssa_20.x
	vec3 32 ssa_33 = fmul ssa_27, ssa_20.xyz
	vec1 32 ssa_34 = fdot3 ssa_33, ssa_27
	vec1 32 ssa_35 = frsq! ssa_34
	vec1 32 ssa_36 = flt32 ssa_0, ssa_35
	vec1 32 ssa_37 = b32csel ssa_36, ssa_35, ssa_0
	loop {
		block block_1:
		vec1 32 ssa_38 = phi block_0: ssa_0, block_2: ssa_40
		if ssa_36 {
			vec1 32 ssa_39 = fexp2 ssa_38
		} else {
		}
		vec1 32 ssa_40 = fdiv ssa_39, ssa_35
	}
	vec4 32 ssa_92 = vec4 ssa_88, ssa_89, ssa_90, ssa_1
	intrinsic store_deref (ssa_91, ssa_92) (wrmask=xyzw /*15*/, access=0)
"""
# A stage as Mesa prints it since 23.3.
NEW = """shader: MESA_SHADER_VERTEX
impl main {
    block b0:  // preds:
    con 32    %0 = load_const (0x3f800000 = 1.000000)
    con 32x4  %1 = @load_ubo (%0 (0x0), %0) (access=none, align_mul=256)
    div 32x3  %2 = fmul %1.xyz, %1.yzx
    div 32    %3 = ffma! %2.x, %2.y, %2.z
    div 1     %4 = flt %3, %0 (1.000000)
    32        %5 = bcsel %4, %3, %0
    32        %6 = i2f32 %0
    32x2      %7 = (float32)tex %1.xy (coord), 0 (texture), 0 (sampler)
    block b1:
}
"""


def counted(**kinds: int) -> dict[str, int]:
    """Returns the counts of all kinds of operations, 0 where none is given."""
    return {kind: kinds.get(kind, 0) for kind in KINDS}


class TestCount:
    """The parser of a driver's printed code."""

    def test_old_and_new_mesa(self) -> None:
        fragment = Operations(counted(mul=6, add=2, sqrt=1, select=2, exp=1, div=1), textures=1, branches=1, loops=1)
        assert count(OLD) == Census(None, fragment)
        assert fragment.total == 13
        vertex = Operations(counted(mul=3, fma=1, select=2, int=1), textures=1)
        assert count(NEW) == Census(vertex, None)
        assert count(NEW + OLD) == Census(vertex, fragment)

    def test_output_without_code(self) -> None:
        assert count("") is None
        assert count("libEGL warning: whatever\n") is None

    def test_a_stage_that_is_printed_again_is_counted_once(self) -> None:
        assert count(OLD + OLD.replace("fdiv", "fadd")) == count(OLD)

    def test_an_unknown_operation_is_counted_as_other(self) -> None:
        census = count(OLD.replace("frsq!", "fnovel_thing!"))
        assert census is not None
        assert census.fragment is not None
        assert (census.fragment.arithmetic["other"], census.fragment.total) == (1, 13)

    def test_difference_and_text(self) -> None:
        census = count(OLD)
        assert census is not None
        assert census.fragment is not None
        rest = census.fragment - Operations(counted(mul=6, add=1), branches=1)
        assert str(rest) == "1 add, 1 div, 1 sqrt, 1 exp, 2 select, 1 texture, 1 loop"
        assert rest.as_dict() == {
            **counted(add=1, div=1, sqrt=1, exp=1, select=2),
            "textures": 1,
            "branches": 0,
            "loops": 1,
        } | {"total": 6}
        assert str(rest - rest) == "nothing"


class TestCensus:
    """Operations that the driver at hand reports for whole programs."""

    @staticmethod
    def fragment(body: str) -> Source:
        lines = f"#version 330 core\nuniform vec3 u_a;\nuniform sampler2D u_t;\nout vec4 o;\nvoid main() {{\n    {body}\n}}\n"
        return Source(expand("pass/picture.vert", {}), Stage(lines, tuple(("x.frag", i) for i in range(1, 8))))

    def test_counts_operations_that_are_asked_for(self, renderer: Renderer) -> None:
        bodies = {
            "o = vec4(u_a, 1.0);": {},
            "o = vec4(sqrt(u_a), 1.0);": {"sqrt": 3},
            "o = vec4(u_a * u_a.yzx + u_a.zxy, 1.0);": {"mul": 3, "add": 3},
            "o = vec4(exp2(u_a.x), log2(u_a.y), u_a.x / u_a.y, 1.0);": {"exp": 2, "div": 1},
            "o = texture(u_t, u_a.xy);": {},
        }
        counts = censuses([self.fragment(body) for body in bodies], renderer.context.backend)  # type: ignore[arg-type]
        if "Mesa" not in renderer.context.version:
            assert counts == [None] * len(bodies)
            pytest.skip("only Mesa shows its intermediate code")
        for census, (body, kinds) in zip(counts, bodies.items(), strict=True):
            assert census is not None
            assert census.fragment is not None
            arithmetic = {kind: number for kind, number in census.fragment.arithmetic.items() if number}
            if census.fragment.arithmetic["fma"]:
                pytest.skip("this driver fuses multiplications and additions")
            assert arithmetic == kinds, body
            assert census.fragment.textures == ("texture(" in body), body
            # The vertex stage computes the corners of the triangle that covers the picture from gl_VertexID.
            assert census.vertex is not None
            assert census.vertex.arithmetic["add"] == census.vertex.arithmetic["mul"] == 2

    def test_a_compile_error_names_file_and_line(self, renderer: Renderer) -> None:
        backend: Any = renderer.context.backend
        with pytest.raises(ShaderError, match=r"x\.frag:6.*nonsense"):
            censuses([self.fragment("o = nonsense;")], backend)

    def test_a_driver_that_shows_nothing(self, monkeypatch: pytest.MonkeyPatch, renderer: Renderer) -> None:
        backend: Any = renderer.context.backend
        monkeypatch.setattr("glshade.driver.census.ENVIRONMENT", {"ST_DEBUG": ""})
        assert censuses([self.fragment("o = vec4(1.0);")], backend) == [None]
        assert operations([BRDFS["phong"]()], backend) == [None]


class TestModels:
    """The materials that are measured, and their programs."""

    def test_variants_are_defaults_options_and_the_anisotropic(self) -> None:
        assert list(variants(BRDFS["lambert"])) == [""]
        metal = variants(BRDFS["metal"])
        assert list(metal) == ["", "fresnel schlick", "anisotropic"]
        assert metal["fresnel schlick"].chosen() == {"fresnel": "schlick"}
        assert metal["anisotropic"].needs_tangents
        assert not metal[""].needs_tangents

    def test_operations_match_the_formulas(self, renderer: Renderer) -> None:
        backend: Any = renderer.context.backend
        nothing, lambert, phong = operations([BRDFS[name]() for name in ("ambient", "lambert", "phong")], backend)
        if nothing is None or lambert is None or phong is None:
            pytest.skip("only Mesa shows its intermediate code")
        assert nothing.total == 0
        # Lambert has two dot products, kd / pi times one of them, the sum, and a test for directions below the horizon.
        assert 10 <= lambert.arithmetic["mul"] + lambert.arithmetic["fma"] <= 12
        assert lambert.arithmetic["select"] >= 1
        assert lambert.arithmetic["exp"] == lambert.arithmetic["sqrt"] == 0
        # Phong adds a power.
        assert phong.arithmetic["exp"] >= 1
        assert phong.total > lambert.total

    def test_the_directions_of_the_timed_program(self, renderer: Renderer) -> None:
        """Both directions are above the horizon in every round, and differ between places and between rounds."""
        large = 1e4  # the rest of the sum is at most 6 and thus negligible
        value = f"(dot(f.n, l) > 0.0 && dot(f.n, v) > 0.0 ? vec3(l.x, v.x, 0.0) : vec3(1.0)) * {large}"
        text = {"model": f"vec3 value(Frame f, vec3 l, vec3 v) {{\n    return {value};\n}}\n"}
        gl, sums = renderer.context.gl, []
        with gl:
            program = Program(renderer.context, Source(expand("pass/cost.vert", text), None), varyings=("v_value",))
            gl.simple_framebuffer((1, 1)).use()
            for rounds in range(9):
                program.set_integer("u_count", rounds)
                result = gl.buffer(reserve=12 * 4096)
                gl.vertex_array(program.gl, []).transform(result, moderngl.POINTS, vertices=4096)
                sums.append(np.frombuffer(result.read(), dtype=np.float32).reshape(-1, 3).astype(float) / large)
        assert np.abs(sums[-1][:, 2]).max() < 0.01
        for component in (0, 1):
            each = np.diff(np.array(sums)[:, :, component], axis=0)
            assert np.ptp(each, axis=1).min() > 0.3
            assert np.median(np.abs(np.diff(each, axis=0)), axis=1).min() > 0.05

    def test_size_counts_only_the_model_and_no_comments(self, monkeypatch: pytest.MonkeyPatch) -> None:
        assert 100 < size(BRDFS["lambert"]()) < size(BRDFS["phong"]())
        text = source(BRDFS["lambert"](), "fragment").fragment
        assert text is not None
        assert size(BRDFS["lambert"]()) < len(text.text)
        before = size(BRDFS["lambert"]())
        commented = Code([*NOTHING["model"].entries, "", "// a comment of some length", ""])
        monkeypatch.setitem(NOTHING, "model", commented)
        assert size(BRDFS["lambert"]()) == before

    @pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed")
    @pytest.mark.parametrize("stage", ["vertex", "fragment"])
    def test_a_second_compiler_accepts_the_programs(self, stage: str, tmp_path: Path) -> None:
        for name in ("lambert", "ashikhmin_shirley"):
            program = source(BRDFS[name](), stage)
            text = program.vertex if stage == "vertex" else program.fragment
            assert text is not None
            file = tmp_path / f"{name}.{stage[:4]}"
            file.write_text(text.text)
            done = subprocess.run(["glslangValidator", file], capture_output=True, text=True, timeout=60)
            assert done.returncode == 0, done.stdout


class TestClock:
    """Differences of times."""

    def test_a_spread_has_median_and_range(self) -> None:
        assert Spread.of([3.0, 1.0, 2.0]) == Spread(2.0, 1.0, 3.0)
        assert Spread(1 / 3, 0.0, 1.0).as_dict() == {"median": 0.3333, "low": 0.0, "high": 1.0}

    def test_a_difference_pairs_rounds_and_leaves_out_the_first(self, monkeypatch: pytest.MonkeyPatch) -> None:
        calls: list[str] = []
        times = {"with": iter([99.0, 5.0, 6.0, 9.0]), "without": iter([98.0, 1.0, 2.0, 3.0])}

        def stopwatch(context: Any, draw: Any) -> float:
            calls.append(draw)
            return next(times[draw])

        monkeypatch.setattr("glshade.driver.clock.seconds", stopwatch)
        draws: Any = ("with", "without")
        assert difference(Any, *draws, repeat=3) == Spread(4.0, 4.0, 6.0)  # type: ignore[arg-type]
        assert calls == ["without", "with"] * 4

    def test_the_time_grows_with_the_work(self, renderer: Renderer) -> None:
        with renderer.context.gl:
            bench = Workload(renderer.context, "vertex", source(None, "vertex"))
            once = min(seconds(renderer.context, bench.without) for _ in range(3))
            bench.rounds *= 8
            assert 4 < min(seconds(renderer.context, bench.without) for _ in range(3)) / once < 12


class TestCommand:
    """glshade bench brdfs."""

    def test_json(self, glshade: Any) -> None:
        done = glshade("bench", "brdfs", "lambert", "metal", "--repeat", "2", "--json")
        assert (done.returncode, done.stderr) == (0, "")
        result = json.loads(done.stdout)
        rows = {(row["model"], row["variant"]): row for row in result["rows"]}
        assert [key[0] for key in rows][:2] == ["lambert", "metal"]
        assert len(rows) == 1 + len(variants(BRDFS["metal"]))
        for row in rows.values():
            for stage in ("pixel_ns", "vertex_ns"):
                assert row[stage]["low"] <= row[stage]["median"] <= row[stage]["high"]
        # Metal with exact Fresnel and Smith's shadowing has twelve times the operations of Lambert, so it is slower anywhere.
        for stage in ("pixel_ns", "vertex_ns"):
            assert rows["metal", ""][stage]["median"] > 3 * rows["lambert", ""][stage]["median"] > 0
        assert result["threads"] >= 1
        assert result["clock"] in ("core", "wall")

    def test_table_and_names(self, glshade: Any) -> None:
        done = glshade("bench", "brdfs", "lambert", "--repeat", "1")
        assert done.returncode == 0
        driver, conditions, heading, row = done.stdout.splitlines()
        assert "threads; nanoseconds" in conditions
        assert heading.split()[:2] == ["model", "pixel"]
        # The operations are listed, or shown as "-".
        assert "add" in row or row.split()[-2] == "-"
        assert row.split()[0] == "lambert"
        assert driver
        wrong = glshade("bench", "brdfs", "lamber")
        assert wrong.returncode == 2
        assert "no model is named 'lamber'; did you mean \"lambert\"?" in wrong.stderr
