"""Property: the GLSL struct of a model repeats the parameters of its Python class: the names, their order and their types."""

from __future__ import annotations

import re

import pytest

from glshade import BRDFS
from glshade.glsl.shaders import SHIPPED


def struct_fields(file: str, struct: str) -> list[tuple[str, str]]:
    """Returns (kind, name) of each field of a struct in a shader file."""
    text = (SHIPPED / file).read_text(encoding="utf-8")
    found = re.search(rf"struct {struct} \{{(.*?)\}};", text, re.S)
    assert found, f"{file} has no struct {struct}"
    return re.findall(r"^\s*(\w+) (\w+);", found[1], re.M)


@pytest.mark.parametrize("name", BRDFS)
def test_the_struct_has_the_parameters(name: str) -> None:
    model = BRDFS[name]
    kinds = {True: "vec3", False: "float"}
    declared = [(kinds[model.is_colour(parameter)], parameter) for parameter in model.parameters()]
    assert struct_fields(f"brdf/{name}.glsl", BRDFS.class_name(name)) == declared


@pytest.mark.parametrize("name", BRDFS)
def test_the_file_declares_the_tables(name: str) -> None:
    text = (SHIPPED / f"brdf/{name}.glsl").read_text(encoding="utf-8")
    model = BRDFS[name]
    assert re.findall(r"^uniform sampler3D u_(\w+);", text, re.M) == list(model.tables)
    assert set(model.tables.values()) <= set(model.model_fields)
    assert set(model().volumes()) == set(model.tables) <= set(model().data())


@pytest.mark.parametrize("name", BRDFS)
def test_what_a_model_declares_is_sound(name: str) -> None:
    model = BRDFS[name]
    assert model.parameters(), "a model without a parameter is a constant"
    for parameter, declared in model.parameters().items():
        assert declared.description
        low, high = declared.usual
        assert declared.low <= low < high <= (high if declared.high is None else declared.high), parameter
        if declared.same_as is not None:
            assert declared.same_as in model.parameters()
    assert model.source, "who found it, where and when"
    assert model() == model(brdf=name), "every parameter has a default"
