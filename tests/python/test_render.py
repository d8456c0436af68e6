# SPDX-License-Identifier: Apache-2.0
import gc
import json
import keyword
import os
import re
import signal
import threading
import time

import exr
import numpy
import pytest
import velatura
from conftest import ROOT, SMALL, words_of


@pytest.mark.parametrize("options", [
    {},
    {"halves": True, "float_layers": True, "cryptomatte": ["object", "material"]},
    {"exr_layout": "single", "exr_compression": "piz", "layers": ["bounce", "light"]},
    {"crop": (0.25, 0.75, 0, 1), "filter": "box", "seed": 7, "frames": 5, "clamp_indirect": 2.5},
    {"resumable": True, "lpe": "dd=C<RD>L", "sampler": "blue-noise", "max_depth": 3, "adaptive": False},
], ids=lambda o: ",".join(o) or "defaults")
def test_write_gives_the_file_of_the_command(scene, tmp_path, command, options):
    options = {**SMALL, **options}
    typed = {k: ("off" if v is False else v) for k, v in options.items()}
    command("velatura", "render", scene, "-o", tmp_path / "command.exr", *words_of(typed), "--progress", "none")
    frame = velatura.render(scene, **options)
    assert frame.write(tmp_path / "module.exr") == [str(tmp_path / "module.exr")]
    assert (tmp_path / "module.exr").read_bytes() == (tmp_path / "command.exr").read_bytes()


def test_output_writes_all_files_of_the_command(scene, tmp_path, command):
    options = {**SMALL, "deep": True, "stats": tmp_path / "a.json"}
    (tmp_path / "command").mkdir()
    velatura.render(scene, output=tmp_path / "a.exr", **options)
    command("velatura", "render", scene, "-o", tmp_path / "command/a.exr", "--deep", "--progress", "none", *words_of(SMALL))
    for name in ("a.exr", "a.deep.exr"):
        assert (tmp_path / name).read_bytes() == (tmp_path / "command" / name).read_bytes()
    assert (tmp_path / "a.json").stat().st_size > 100


def test_resume_continues_the_file(scene, tmp_path):
    velatura.render(scene, output=tmp_path / "a.exr", resumable=True, **{**SMALL, "spp": 2})
    velatura.render(scene, output=tmp_path / "a.exr", resume=True, **SMALL)
    velatura.render(scene, output=tmp_path / "b.exr", resumable=True, **SMALL)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_arrays_have_the_bits_of_the_file(scene, tmp_path):
    frame = velatura.render(scene, halves=True, cryptomatte="object", **SMALL)
    frame.write(tmp_path / "a.exr")
    channels = exr.read(tmp_path / "a.exr")
    read = velatura.Layers.open(tmp_path / "a.exr")
    assert list(read) == list(frame.layers)
    seen = set()
    for name, array in frame.layers.items():
        assert array.shape[:2] == (12, 20) and array.dtype in (numpy.float32, numpy.uint32)
        assert array.tobytes() == read[name].tobytes()
        for index, channel in enumerate(frame.layers.channels(name)):
            full = channel if name in ("rgba", channel) else f"{name}.{channel}"
            expected = channels[full].astype(array.dtype)
            assert array[:, :, index].tobytes() == expected.tobytes(), full
            seen.add(full)
    assert seen == set(channels)
    assert frame.layers["sampleCount"].dtype == numpy.uint32
    assert frame.layers.channels("rgba") == ["R", "G", "B", "A"]
    assert frame["rgba"][:, :, :3].sum() > 0


def test_arrays_are_read_only_and_share_memory_that_outlives_the_frame(scene):
    frame = velatura.render(scene, **SMALL)
    first, second = frame.layers["b1"], frame["b1"]
    assert first.__array_interface__["data"] == second.__array_interface__["data"]
    assert first.flags.c_contiguous and not first.flags.owndata
    with pytest.raises(ValueError):
        first[0, 0, 0] = 1
    with pytest.raises(ValueError):
        first.flags.writeable = True
    kept = first.copy()
    del frame, second
    gc.collect()
    velatura.render(scene, **{**SMALL, "seed": 3}).layers["b1"]
    assert (first == kept).all()


def test_layers_are_a_mapping(scene):
    layers = velatura.render(scene, **SMALL).layers
    assert len(layers) == len(layers.keys()) == len(list(layers))
    assert "b0" in layers and "nothing" not in layers
    assert layers.bounces == ["b0", "b1", "b2", "tail"]
    assert set(layers.groups) >= {"Key", "Sky"}
    assert layers.window == layers.display == (0, 0, 20, 12)
    assert layers.header["velatura/samples"]["seed"] == "0"
    with pytest.raises(KeyError, match="nothing"):
        layers["nothing"]


def test_unknown_option_names_the_nearest(scene):
    with pytest.raises(TypeError, match="unknown option 'sp'.*did you mean 'spp'"):
        velatura.render(scene, sp=16)
    with pytest.raises(TypeError, match="target_error"):
        velatura.Renderer(scene, taget_error="1%")
    with pytest.raises(TypeError, match="memory_limit.*of the command alone"):
        velatura.render(scene, memory_limit="1G")


@pytest.mark.parametrize("options, text", [
    ({"spp": -1}, "spp"), ({"spp": "many"}, "spp"), ({"filter": "bx"}, "did you mean 'box'"), ({"halves": 1}, "halves"),
    ({"samples": "0:2", "spp": 1}, "reaches beyond --spp 1"), ({"stats": "a.json"}, "stats needs output"),
    ({"frames": "1-3"}, "one frame"), ({"output": "a.png"}, ".exr"), ({"lpe": "x=C<"}, "lpe"),
])
def test_wrong_values_are_usage_errors(scene, options, text):
    with pytest.raises(ValueError, match=re.escape(text)) as raised:
        velatura.render(scene, **{**SMALL, **options})
    assert isinstance(raised.value, velatura.UsageError)


# A value of each option of a render
VALUES = {
    "camera": "/World/Cam", "settings": "", "pass_": "", "frames": 5, "purpose": ["render", "proxy"], "material_purpose": "preview", "working_space": "acescg",
    "search_path": "FOLDER", "session": "LAYER", "variant": None, "set": "/World/Ball.radius=0.5", "output": "FOLDER/o.exr",
    "res": "8x8", "image_width": 8, "crop": (0, 1, 0, 0.5), "exr_layout": "single", "exr_compression": "zips", "float_layers": True, "spp": 2,
    "time": "10s", "target_error": "90%", "require_target": True, "forecast": "1%", "adaptive": False, "max_depth": 2,
    "caustics": "path", "clamp_direct": 5, "clamp_indirect": 5.5, "firefly_guard": "off", "filter": "box", "seed": 3, "texture_bias": -0.5,
    "dicing_rate": 2, "subdivision_level": 1, "dicing_limit": 1, "bounces": "auto", "lights": "off", "layers": "bounce",
    "casters": "/World/Ball", "lpe": ["dd=C<RD>L", "k=C.{2}<L.'Key'>"], "lpe_strict": True, "halves": True,
    "cryptomatte": "object", "cryptomatte_levels": 2, "cryptomatte_through": "refraction", "deep": True, "deep_samples": 2, "resume": True, "resumable": True,
    "checkpoint": "5m", "snapshot": "5m", "samples": "0:2", "rates_from": None, "for_mix": None, "stats": "FOLDER/s.json", "strict": True, "require_assets": True, "display": "127.0.0.1:1", "display_layers": "b1", "preview": "FOLDER/p.png", "every": "3s",
    "missing_textures": "error", "threads": 3, "volume_memory": 1, "instance_limit": 1, "mode": "tile", "tile": 16,
    "accel": "bvh", "bvh_quality": "fast", "volume_bounds": "one", "asset_root": "FOLDER", "confine": True, "sandbox": True,
    "missing_assets": "ignore", "limit": "prims=1000", "guiding": "on", "splitting": "off", "sampler": "independent",
    "effects": "-volumes", "integrator": "whitted", "light_sampling": "light", "light_selection": "power",
    "roulette": "cutoff", "cutoff": 0.1,
}
# Options that need others
WITH = {"cryptomatte_levels": {"cryptomatte": "object"}, "cryptomatte_through": {"cryptomatte": "object"}, "deep_samples": {"deep": True, "output": "FOLDER/o.exr"},
        "deep": {"output": "FOLDER/o.exr"}, "resume": {"output": "FOLDER/o.exr"}, "checkpoint": {"output": "FOLDER/o.exr"},
        "snapshot": {"output": "FOLDER/o.exr"}, "stats": {"output": "FOLDER/o.exr"}, "samples": {"spp": None}, "image_width": {"res": None},
        "cutoff": {"roulette": "cutoff"}, "casters": {"layers": "bounce,light,shadow,caster"},
        "display_layers": {"display": "127.0.0.1:1"}, "every": {"preview": "FOLDER/p.png"}}


def test_every_option_of_the_command_is_known(command):
    text = command("velatura", "render", "--help-all")
    options = {name.replace("-", "_") + "_" * keyword.iskeyword(name) for name in re.findall(r"^ +(?:-\w, )?--([\w-]+)", text, re.MULTILINE)}
    commands_alone = {"help", "help_all", "progress", "quiet", "verbose", "replay", "paths", "memory_limit", "overwrite_input"}
    assert set(velatura.render_options()) == options - commands_alone
    assert set(VALUES) == set(velatura.render_options())


@pytest.mark.parametrize("name", sorted(VALUES))
def test_every_option_renders(scene, tmp_path, name):
    (tmp_path / "layer.usda").write_text("#usda 1.0\n")
    places = {"FOLDER": str(tmp_path), "LAYER": str(tmp_path / "layer.usda")}

    def placed(value):
        for word, place in places.items():
            value = value.replace(word, place) if isinstance(value, str) else value
        return value

    options = {"res": (8, 8), "spp": 2, "guiding": "off", **WITH.get(name, {}), name: VALUES[name]}
    frame = velatura.render(scene, **{k: placed(v) for k, v in options.items()})
    assert frame.layers["rgba"].shape[2] == 4


def test_progress_is_called_in_the_calling_thread(scene):
    seen = []
    velatura.render(scene, progress=lambda p: seen.append((p.fraction, p.spp, threading.get_ident())),
                    res=(96, 72), spp=16, guiding="off")
    assert seen and all(0 <= fraction <= 1 for fraction, _, _ in seen)
    assert {ident for _, _, ident in seen} == {threading.get_ident()}


ENDLESS = {"res": (64, 48), "spp": 1 << 30, "guiding": "off"}


def test_cancel_from_another_thread(scene):
    renderer = velatura.Renderer(scene, **ENDLESS)
    begun = threading.Event()
    canceled_at = []

    def cancel():
        begun.wait()
        canceled_at.append(time.monotonic())
        renderer.cancel()

    thread = threading.Thread(target=cancel)
    thread.start()
    with pytest.raises(velatura.Canceled) as raised:
        renderer.render(lambda p: begun.set() if p.spp >= 1 else None)
    print(f"canceled after {1000 * (time.monotonic() - canceled_at[0]):.0f} ms")
    thread.join()
    assert raised.value.frame.reason == "interrupted"
    assert raised.value.frame.layers["rgba"].shape == (48, 64, 4)
    # It can render again
    with pytest.raises(velatura.Canceled):
        renderer.render(lambda p: False)


def test_exceptions_of_progress_and_signals_end_the_render(scene):
    def fail(progress):
        raise LookupError("mine")
    with pytest.raises(LookupError, match="mine"):
        velatura.render(scene, progress=fail, **ENDLESS)
    with pytest.raises(KeyboardInterrupt):
        velatura.render(scene, progress=lambda p: signal.raise_signal(signal.SIGINT), **ENDLESS)


def test_other_threads_run_while_it_renders(scene):
    counts = []
    ended = threading.Event()

    def count():
        while not ended.is_set():
            counts.append(1)
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    renderer = velatura.Renderer(scene, **ENDLESS)
    with pytest.raises(velatura.Canceled):
        renderer.render(lambda p: len(counts) < 20)
    ended.set()
    thread.join()


def test_two_threads_with_a_renderer_each_give_the_bits_of_one_alone(scene):
    options = [{**SMALL, "spp": 16, "seed": 1, "threads": 1}, {**SMALL, "spp": 16, "seed": 2, "threads": 5, "res": (40, 24)}]
    alone = [velatura.render(scene, **o).layers["rgba"].tobytes() for o in options]
    results = [[], []]

    def work(index):
        for _ in range(5):
            results[index].append(velatura.render(scene, **options[index]).layers["rgba"].tobytes())

    threads = [threading.Thread(target=work, args=(i,)) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for index in range(2):
        assert results[index] == [alone[index]] * 5


def test_one_renderer_renders_in_one_thread_at_a_time(scene):
    renderer = velatura.Renderer(scene, **ENDLESS)
    codes = []

    def second(progress):
        try:
            renderer.render()
        except velatura.Error as error:
            codes.append(error.code)
        return False

    with pytest.raises(velatura.Canceled):
        renderer.render(second)
    assert codes == ["renderer-busy"]


def resident_mb():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def test_a_hundred_renders_leak_nothing(scene):
    def render():
        frame = velatura.render(scene, **{**SMALL, "res": (80, 45), "spp": 1})
        return frame.layers["rgba"].nbytes

    for _ in range(20):
        render()
    gc.collect()
    before = resident_mb()
    for _ in range(100):
        render()
    gc.collect()
    # A frame has more than 1 MB of layers alone
    assert resident_mb() - before < 20


def test_plan_is_that_of_the_command(scene, command):
    expected = json.loads(command("velatura", "plan", scene, "--json", *words_of(SMALL)))
    assert velatura.plan(scene, **SMALL) == expected


def test_a_study_is_read_as_a_dict(scene, tmp_path, command):
    command("velatura", "study", scene, "-o", tmp_path / "study", "--res", 16, 12, "--spp", 2, "--time", "3s", "--rounds", 2,
            "--knobs", "sampler", "--progress", "none", "-q")
    report = velatura.read_study(tmp_path / "study")
    assert report == json.loads((tmp_path / "study/report.json").read_text()) and len(report) > 3
    with pytest.raises(velatura.Error, match="report.json"):
        velatura.read_study(tmp_path)


def test_errors_have_their_place(tmp_path):
    bad = tmp_path / "bad.usda"
    bad.write_text('#usda 1.0\ndef Xform "A"\n{\n    double x = \n}\n')
    with pytest.raises(velatura.Error, match=r"bad\.usda:4:16: error") as raised:
        velatura.render(bad, **SMALL)
    assert [(d.line, d.column) for d in raised.value.diagnostics if d.severity == "error"] == [(4, 16)]
    with pytest.raises(velatura.Error, match="nowhere.usda"):
        velatura.Renderer(tmp_path / "nowhere.usda")


def test_missing_assets_are_an_error_before_the_first_sample(scene):
    scene.write_text(scene.read_text() + 'def "Lost" (references = @lost.usda@)\n{\n}\n')
    seen = []
    with pytest.raises(velatura.Error, match=r"ball\.usda:\d+:\d+: error.*lost\.usda") as raised:
        velatura.render(scene, progress=seen.append, **SMALL)
    assert raised.value.code == "missing-assets" and not seen
    frame = velatura.render(scene, missing_assets="ignore", **SMALL)
    errors = [d for d in frame.diagnostics if d.severity == "error"]
    assert [d.code for d in errors] == ["usd-unresolved-asset"]
    assert errors[0].file.endswith("ball.usda") and errors[0].line > 0


def test_settings_of_the_process_must_not_differ(scene):
    confined = velatura.Renderer(scene, confine=True, **SMALL)
    with pytest.raises(velatura.Error, match="whole process") as raised:
        velatura.render(scene, **SMALL)
    assert raised.value.code == "process-settings"
    confined.render()
    del confined
    gc.collect()
    velatura.render(scene, **SMALL)


def test_no_render_writes_over_its_scene(scene):
    usd = scene.with_suffix(".exr")
    usd.write_text(scene.read_text())
    scene.write_text("#usda 1.0\n(\n    subLayers = [@ball.exr@]\n)\n")
    before = usd.read_text()
    with pytest.raises(velatura.Error):
        velatura.render(scene, output=usd, missing_assets="ignore", **SMALL)
    assert usd.read_text() == before


def test_plugins_are_found_beside_the_module(tmp_path):
    """Subdivision surfaces need a plugin, which is below the tree that the module lies in."""
    if not (ROOT / "build").exists():
        pytest.skip("not in a build tree")
    path = tmp_path / "cage.usda"
    path.write_text('''#usda 1.0
def Mesh "Cage"
{
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 2, 3, 5, 4, 4, 5, 7, 6, 6, 7, 1, 0, 1, 7, 5, 3, 6, 0, 2, 4]
    point3f[] points = [(-1, -1, 1), (1, -1, 1), (-1, 1, 1), (1, 1, 1), (-1, 1, -1), (1, 1, -1), (-1, -1, -1), (1, -1, -1)]
}
def DomeLight "Sky"
{
}
''')
    renderer = velatura.Renderer(path, **SMALL)
    plugins = {p["name"]: p for p in renderer.plan["needs"]["plugins"]} if renderer.plan["needs"]["plugins"] else {}
    if "subdivision" not in plugins:
        pytest.skip("built without the plugin")
    frame = renderer.render()
    assert not [d for d in frame.diagnostics if d.code.startswith("plugin")]
