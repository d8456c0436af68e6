# SPDX-License-Identifier: Apache-2.0
import json
import re

import exr
import numpy
import pytest
import velatura
from conftest import SMALL


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    import conftest
    folder = tmp_path_factory.mktemp("mix")
    (folder / "ball.usda").write_text(conftest.SCENE)
    frame = velatura.render(folder / "ball.usda", halves=True, cryptomatte="object", clamp_indirect=0.5,
                            layers="bounce,light,matrix,shadow,data", **SMALL)
    frame.write(folder / "a.exr")
    return folder / "a.exr"


MIXES = [
    ([], {}),
    (["--gain=Key=+1.5st", "--gain=indirect=2"], {"gain": {"Key": "+1.5st", "indirect": 2}}),
    (["--tint=Sky=1,.9,.8", "--kelvin=Key=3200", "--exposure=0.5"],
     {"tint": {"Sky": (1, .9, .8)}, "kelvin": {"Key": 3200}, "exposure": 0.5}),
    (["--mute=Sky", "--shadow=Key=0.5"], {"mute": "Sky", "shadow": {"Key": 0.5}}),
    (["--solo=Key", "--clamp=all=1"], {"solo": ["Key"], "clamp": {"all": 1}}),
    (["--gain=Key=3", "--matte=CryptoObject:/World/Ball"], {"gain": {"Key": (3, "CryptoObject:/World/Ball")}}),
    (["--rows=lamps=Key,Sky", "--gain=lamps=0.25"], {"rows": {"lamps": ["Key", "Sky"]}, "gain": {"lamps": 0.25}}),
]


@pytest.mark.parametrize("words, controls", MIXES, ids=lambda v: " ".join(v) if isinstance(v, list) else "")
def test_mix_has_the_bits_of_the_command(file, tmp_path, command, words, controls):
    command("velatura-comp", "mix", file, "-o", tmp_path / "mix.exr", *words)
    expected = exr.read(tmp_path / "mix.exr")
    mixed = velatura.Layers.open(file).mix(**controls)
    assert mixed.dtype == numpy.float32 and mixed.shape == (12, 20, 4)
    for index, channel in enumerate("RGBA"):
        assert mixed[:, :, index].tobytes() == expected[channel].tobytes()


def test_a_frame_mixes_without_a_file(file):
    frame = velatura.render(file.with_name("ball.usda"), halves=True, **SMALL)
    frame.write(file.with_name("b.exr"))
    gain = {"Key": 2}
    assert (frame.layers.mix(gain=gain) == velatura.Layers.open(file.with_name("b.exr")).mix(gain=gain)).all()
    assert (frame.layers.mix() == frame.layers["rgba"]).all()


def test_rows_sum_to_the_image(file):
    layers = velatura.Layers.open(file)
    total = sum(layers[f"C_{group}"].astype(numpy.float64) for group in layers.groups)
    assert numpy.allclose(total, layers["rgba"][:, :, :3], rtol=2e-3, atol=1e-3)


def test_presets_are_those_of_the_command(file, tmp_path, command):
    preset = tmp_path / "look.json"
    command("velatura-comp", "mix", file, "-o", tmp_path / "a.exr", "--gain=Key=+1st", "--mute=Sky", "--save-preset", preset)
    look = velatura.Look(gain={"Key": "+1st"}, mute="Sky")
    assert json.loads(look.json) == json.loads(preset.read_text())
    assert look.difference(velatura.Look(preset)) == []
    layers = velatura.Layers.open(file)
    expected = layers.mix(look)
    assert (layers.mix(preset) == expected).all() and (layers.mix(velatura.Look(preset)) == expected).all()
    look.save(tmp_path / "saved.json")
    assert (tmp_path / "saved.json").read_text() == preset.read_text()
    louder = velatura.Look(look, exposure=1)
    assert louder.exposure == 1 and look.exposure == 0
    assert len(look.difference(louder)) == 1


def test_keyed_values_need_a_frame(file):
    layers = velatura.Layers.open(file)
    look = velatura.Look(gain={"Key": "1@1,3@11"})
    with pytest.raises(velatura.UsageError, match="frame"):
        layers.mix(look)
    assert (layers.mix(look, frame=6) == layers.mix(gain={"Key": 2})).all()


def test_write_mix_writes_the_files_of_the_command(file, tmp_path, command):
    layers = velatura.Layers.open(file)
    for end in ("", "--with-layers"):
        command("velatura-comp", "mix", file, "-o", tmp_path / "a.exr", "--gain=Key=2", *([end] if end else []))
        layers.write_mix(tmp_path / "b.exr", gain={"Key": 2}, with_layers=bool(end))
        assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    with pytest.raises(velatura.UsageError, match="with_layers"):
        layers.write_mix(tmp_path / "b.png", with_layers=True)


def test_noise_is_that_of_the_command(file, command):
    layers = velatura.Layers.open(file)
    expected = json.loads(command("velatura-comp", "noise", file, "--json", "--gain=Key=+2st", "--target=1%"))
    assert layers.noise(gain={"Key": "+2st"}, target="1%") == expected
    assert layers.noise(gain={"Key": "+2st"}, target=0.01) == expected
    assert expected["mix"]["value"] > 0


def test_noise_needs_halves(file):
    frame = velatura.render(file.with_name("ball.usda"), **SMALL)
    with pytest.raises(velatura.Error) as raised:
        frame.layers.noise()
    assert raised.value.code == "halves-not-stored"


@pytest.mark.parametrize("controls, kind, text", [
    ({"gain": {"Kye": 2}}, velatura.UsageError, "Key"), ({"gain": {"Key": "loud"}}, velatura.UsageError, "loud"),
    ({"gains": {"Key": 2}}, TypeError, "did you mean 'gain'"), ({"gain": 2}, velatura.UsageError, "expected a dict"),
    ({"exposure": 1000}, velatura.UsageError, "exposure"), ({"gain": {"Key": (2, "Nothing:x")}}, velatura.Error, "Nothing"),
])
def test_wrong_controls_are_errors(file, controls, kind, text):
    with pytest.raises(kind, match=re.escape(text)):
        velatura.Layers.open(file).mix(**controls)


def test_lenient_skips_what_the_file_lacks(file):
    layers = velatura.Layers.open(file)
    assert (layers.mix(gain={"Nobody": 2, "Key": 2}, lenient=True) == layers.mix(gain={"Key": 2})).all()


def test_other_files_are_refused_or_foreign(file, tmp_path):
    with pytest.raises(velatura.Error):
        velatura.Layers.open(tmp_path / "nowhere.exr")
    velatura.Layers.open(file).write_mix(tmp_path / "beauty.exr")
    assert set(velatura.Layers.open(tmp_path / "beauty.exr", foreign=True)) >= {"rgba"}
