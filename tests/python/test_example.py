# SPDX-License-Identifier: Apache-2.0
"""The programs of examples/ in Python, and the code of docs/reference/python.md."""
import re
import subprocess
import sys

import velatura
from conftest import ROOT, SMALL


def test_error_against_time(scene):
    done = subprocess.run([sys.executable, "-B", ROOT / "examples/error_against_time.py", scene, "Key"], capture_output=True,
                          encoding="utf-8")
    assert done.returncode == 0, done.stderr
    rows = [(float(spp), float(error)) for spp, error in re.findall(r"^ *(\d+) spp .*? ([\d.]+) %", done.stdout, re.MULTILINE)]
    # Adaptive sampling: on average
    assert len(rows) == 5 and all(abs(spp / wanted - 1) < 0.3 for (spp, _), wanted in zip(rows, (4, 8, 16, 32, 64)))
    # 16 times the samples: a quarter of the error by independent samples, a 16th by the best points
    errors = [error for _, error in rows]
    assert errors == sorted(errors, reverse=True) and 2 < errors[0] / errors[-1] < 16
    means = [float(mean) for mean in re.findall(r"^ *[+-]\d stops +([\d.]+)", done.stdout, re.MULTILINE)]
    assert len(means) == 5 and means == sorted(means)


def blocks():
    """Python code of the page, by paragraphs."""
    page = (ROOT / "docs/reference/python.md").read_text()
    return re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)


def test_the_code_of_the_page_runs(scene, tmp_path, monkeypatch, capsys):
    night = """def Xform "World" (
    variants = { string look = "day" }
    prepend variantSets = "look"
)
{
    variantSet "look" = {
        "day" {
        }
        "night" {
            over "Key"
            {
                float inputs:intensity = 3
            }
        }
    }
"""
    text = scene.read_text().replace('def Xform "World"\n{\n', night).replace('DomeLight "Sky"', 'DomeLight "rim"')
    key = 'SphereLight "Key"\n    {\n'
    assert key in text
    (tmp_path / "shot.usda").write_text(text.replace(key, key + '        string velatura:light:group = "key"\n'))
    monkeypatch.chdir(tmp_path)
    original = velatura.render
    monkeypatch.setattr(velatura, "render", lambda scene, **options: original(scene, **{**options, **SMALL}))
    code = blocks()
    assert len(code) == 3
    names = {}
    for block in code:
        exec(compile(block, "python.md", "exec"), names)
    assert (tmp_path / "shot.exr").exists()
    assert (tmp_path / "scene.usda").exists()
    assert "shot.usda:" in capsys.readouterr().out
