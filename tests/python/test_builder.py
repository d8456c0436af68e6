# SPDX-License-Identifier: Apache-2.0
"""Scenes that a script writes: the image is that of the same scene in a file."""
import re

import numpy as np
import pytest

import velatura
from conftest import SMALL


def copy_of(stage):
    """A SceneBuilder with all that is authored on the prims of a stage."""
    builder = velatura.SceneBuilder("copy.usda")
    builder.set_metadata("/", "upAxis", stage.up_axis)
    for prim in stage.traverse():
        builder.define(prim.path, prim.type)
        for name in prim.properties:
            attribute = prim[name]
            if not attribute.is_authored:
                continue
            path = f"{prim.path}.{name}"
            builder.set(path, attribute.get(), attribute.type)
            if attribute.times:
                builder.set_samples(path, {t: attribute.get(t) for t in attribute.times}, attribute.type)
    return builder


def assert_same_layers(a, b):
    assert list(a) == list(b)
    for name in a:
        assert a[name].tobytes() == b[name].tobytes(), name


def test_a_scene_in_memory_gives_the_image_of_the_file(scene, tmp_path):
    builder = copy_of(velatura.Stage.open(scene))
    of_file = velatura.render(scene, **SMALL).layers
    assert_same_layers(velatura.render(builder, **SMALL).layers, of_file)
    builder.save(tmp_path / "saved.usda")
    assert (tmp_path / "saved.usda").read_text() == builder.text
    assert_same_layers(velatura.render(tmp_path / "saved.usda", **SMALL).layers, of_file)


def test_edits_between_renders(scene):
    builder = copy_of(velatura.Stage.open(scene))
    first = velatura.render(builder, **SMALL).layers
    builder.set("/World/Key.inputs:intensity", None, "float")
    builder.set_samples("/World/Key.inputs:intensity", {1: 60.0}, "float")
    brighter = velatura.render(builder, **SMALL).layers
    # Twice the light: the layer of the key is twice the other, bit for bit; the others are the same
    np.testing.assert_array_equal(brighter["b0_Key" if "b0_Key" in first else "b1_Key"],
                                  2 * first["b0_Key" if "b0_Key" in first else "b1_Key"])
    assert builder.remove("/World/Ball") and not builder.remove("/World/Ball")
    assert "/World/Ball" not in builder and "/World/Floor" in builder
    empty = velatura.render(builder, **SMALL).layers
    assert empty["depth.Z" if "depth.Z" in first else "rgba"].tobytes() != \
        brighter["depth.Z" if "depth.Z" in first else "rgba"].tobytes()


@pytest.mark.parametrize("type, value", [
    ("bool", True), ("int", -7), ("uint", 4000000000), ("int64", -2**53), ("float", 0.25), ("double", 0.1), ("half", 1.5),
    ("string", "a \"b\" ä"), ("token", "Y"), ("float2", (1.0, 2.5)), ("color3f", (0.25, 0.5, 1.0)), ("int3", (1, 2, 3)),
    ("quatf", (1.0, 0.0, 0.5, 0.0)), ("matrix4d", tuple(tuple(float(4 * i + j) for j in range(4)) for i in range(4))),
    ("timecode", 12.5),
])
def test_values_come_back(type, value):
    builder = velatura.SceneBuilder()
    builder.define("/A")
    builder.set("/A.x", value, type)
    assert velatura.Stage.of(builder)["/A"]["x"].get() == value
    assert velatura.Stage.of(builder)["/A"]["x"].type == type


@pytest.mark.parametrize("type, value", [
    ("int[]", [3, 1, 2]), ("float[]", np.arange(5) / 4), ("point3f[]", np.arange(12).reshape(4, 3)), ("bool[]", [True, False]),
    ("texCoord2f[]", np.zeros((0, 2))), ("uchar[]", np.array([0, 255])), ("double3[]", np.eye(3)[:, ::-1]),
])
def test_arrays_come_back(type, value):
    builder = velatura.SceneBuilder()
    builder.define("/A")
    builder.set("/A.x", value, type)
    np.testing.assert_array_equal(velatura.Stage.of(builder)["/A"]["x"].get(), value)


def test_lists_of_words_connections_and_targets():
    builder = velatura.SceneBuilder()
    builder.define("/A", "Material")
    builder.define("/A/S", "Shader")
    builder.define("/B", "Sphere")
    builder.set("/B.purposes", ["render", "proxy"], "token[]")
    builder.set("/A/S.inputs:file", "wood.png", "asset")
    builder.connect("/A.outputs:surface", ["/A/S.outputs:surface"])
    builder.apply("/B", "MaterialBindingAPI")
    builder.set_targets("/B.material:binding", ["/A"])
    stage = velatura.Stage.of(builder)
    assert stage["/B"]["purposes"].get() == ["render", "proxy"]
    assert stage["/B"].targets("material:binding") == ["/A"]
    assert "MaterialBindingAPI" in stage["/B"].api_schemas
    assert stage["/A/S"]["inputs:file"].get() == "wood.png"
    assert "outputs:surface.connect = </A/S.outputs:surface>" in builder.text


@pytest.mark.parametrize("attribute, value, type, text", [
    ("/A.x", 1, "flot", "\"flot\" is not a value type"), ("/B.x", 1, "float", "no such prim"), ("A.x", 1, "float", "A.x"),
    ("/A.x", 1.5, "int", "values that it cannot hold"), ("/A.x", -1, "uint", "values that it cannot hold"),
    ("/A.x", (1, 2), "float3", "expected the shape [3], found [2]"), ("/A.x", [1, 2], "point3f[]", "shape [n, 3], found [2]"),
    ("/A.x", "one", "float", "expected numbers"), ("/A.x", 1, "token", "expected str"), ("/A", 1, "float", "/A"),
])
def test_wrong_values_are_named(attribute, value, type, text):
    builder = velatura.SceneBuilder()
    builder.define("/A")
    before = builder.text
    with pytest.raises(velatura.UsageError, match=re.escape(text)):
        builder.set(attribute, value, type)
    assert builder.text == before


def test_options_that_need_a_file_are_refused(scene):
    builder = copy_of(velatura.Stage.open(scene))
    with pytest.raises(velatura.UsageError, match="edit the layer"):
        velatura.Renderer(builder, set="/World/Ball.radius=2")
    with pytest.raises(velatura.UsageError, match="file not found"):
        velatura.Renderer(builder, session="missing.usda")


def test_a_session_layer_is_above_the_scene(scene, tmp_path):
    builder = copy_of(velatura.Stage.open(scene))
    (tmp_path / "look.usda").write_text('#usda 1.0\nover "World"\n{\n    over "Ball"\n    {\n        double radius = 0.5\n    }\n}\n')
    session = tmp_path / "look.usda"
    assert_same_layers(velatura.render(builder, session=session, **SMALL).layers, velatura.render(scene, session=session, **SMALL).layers)
