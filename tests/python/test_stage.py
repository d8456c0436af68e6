# SPDX-License-Identifier: Apache-2.0
import numpy
import pytest
import velatura


@pytest.fixture
def stage(scene):
    return velatura.Stage.open(scene)


def test_prims_have_paths_types_and_children(stage):
    world = stage["/World"]
    assert (world.path, world.name, world.type) == ("/World", "World", "Xform")
    assert [child.name for child in world.children] == ["Cam", "Ball", "Floor", "Key", "Sky"]
    assert [prim.path for prim in stage.traverse()][:2] == ["/World", "/World/Cam"]
    assert stage["/World/Ball"].is_a("Gprim") and not stage["/World/Cam"].is_a("Gprim")
    assert "/World/Ball" in stage and "/World/Bell" not in stage
    with pytest.raises(KeyError, match="/World/Bell"):
        stage["/World/Bell"]
    assert stage.up_axis == "Y" and stage.metadata("defaultPrim") == "World"
    assert len(stage.layers) == 1


def test_values_are_those_of_python(stage):
    ball = stage["/World/Ball"]
    assert ball.get("radius") == 1.0
    assert ball.get("xformOpOrder") == ["xformOp:translate"]
    assert ball.get("xformOp:translate") == (0.0, 1.0, 0.0)
    assert ball.get("orientation") == "rightHanded"  # the fallback of its schema
    assert not ball["orientation"].is_authored
    assert ball.get("nothing") is None
    with pytest.raises(KeyError, match="nothing"):
        ball["nothing"]
    color = ball["primvars:displayColor"]
    assert color.type == "color3f[]"
    assert numpy.allclose(color.get(), [(0.8, 0.3, 0.2)])


def test_arrays_share_the_memory_of_the_stage(stage):
    points = stage["/World/Floor"]["points"]
    first, second = points.get(), points.get()
    assert first.shape == (4, 3) and first.dtype == numpy.float32
    assert first.__array_interface__["data"] == second.__array_interface__["data"]
    assert not first.flags.writeable
    kept = first.copy()
    del stage, points, second
    assert (first == kept).all()


def test_time_samples_are_interpolated(stage):
    intensity = stage["/World/Key"]["inputs:intensity"]
    assert intensity.times == [1.0, 11.0]
    assert intensity.get(6) == 40.0 and intensity.get(1) == 30.0


def test_opinions_have_their_place(tmp_path, scene):
    top = tmp_path / "top.usda"
    top.write_text('#usda 1.0\n(\n    subLayers = [@ball.usda@]\n)\nover "World"\n{\n    over "Ball"\n    {\n'
                   '        double radius = 2\n    }\n}\n')
    stage = velatura.Stage.open(top)
    radius = stage["/World/Ball"]["radius"]
    assert radius.get() == 2.0 and radius.place.endswith("top.usda:9:25")
    opinions = radius.opinions()
    assert [o["value"] for o in opinions[:2]] == ["2", "1"]
    assert [o["decides"] for o in opinions[:2]] == [True, False]
    assert opinions[1]["place"].rsplit("/", 1)[1].startswith("ball.usda:")
    assert "top.usda:9" in stage.explain("/World/Ball.radius")
    assert [layer.rsplit("/", 1)[1] for layer, _, _ in stage["/World/Ball"].stack] == ["top.usda", "ball.usda"]


def test_overrides_and_variants(tmp_path, scene):
    assert velatura.Stage.open(scene, set="/World/Ball.radius=3")["/World/Ball"].get("radius") == 3.0
    with pytest.raises(velatura.UsageError, match="Bell"):
        velatura.Stage.open(scene, set="/World/Bell.radius=3")
    with pytest.raises(TypeError, match="no option 'spp'"):
        velatura.Stage.open(scene, spp=3)


def test_diagnostics_have_file_line_and_column(tmp_path):
    path = tmp_path / "lost.usda"
    path.write_text('#usda 1.0\ndef "A" (\n    references = @nowhere.usda@\n)\n{\n}\n')
    stage = velatura.Stage.open(path)
    errors = [d for d in stage.diagnostics if d.severity == "error"]
    assert [(d.code, d.line) for d in errors] == [("usd-unresolved-asset", 3)]
    assert str(errors[0]).startswith(f"{path}:3:") and "nowhere.usda" in errors[0].message
    with pytest.raises(velatura.Error, match=r"lost\.usda:3:\d+: error"):
        velatura.Stage.open(path, strict=True)


def test_a_file_that_cannot_be_read_is_an_error_with_its_place(tmp_path):
    path = tmp_path / "bad.usda"
    path.write_text("#usda 1.0\ndef Sphere {\n")
    with pytest.raises(velatura.Error, match=r"bad\.usda:2:12"):
        velatura.Stage.open(path)
    with pytest.raises(velatura.Error, match="nowhere"):
        velatura.Stage.open(tmp_path / "nowhere.usda")
