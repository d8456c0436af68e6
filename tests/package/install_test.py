#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs a build into a folder, moves that, and uses it from there. Usage: install_test.py BUILD"""
import gzip
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
BUILD = pathlib.Path(sys.argv.pop(1)).resolve()
QUICK = ["--res", "16", "12", "--spp", "1", "--guiding", "off", "--progress", "none"]

sys.path.insert(0, str(HERE))
from make_image import image  # noqa: E402


def run(*command, **options):
    environment = {name: value for name, value in os.environ.items() if name != "VELATURA_PLUGIN_PATH"}
    environment |= {"ASAN_OPTIONS": "detect_leaks=0:new_delete_type_mismatch=0"} | options.pop("env", {})
    return subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8",
                          env=environment, **options)


class Installation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        top = pathlib.Path(cls.temporary.name)
        installed = run("cmake", "--install", BUILD, "--prefix", top / "first")
        if installed.returncode:
            raise RuntimeError(installed.stderr)
        # Nothing may depend on where it was installed
        cls.place = top / "elsewhere" / "moved here"
        cls.place.parent.mkdir()
        (top / "first").rename(cls.place)
        cls.velatura = cls.place / "bin" / "velatura"
        cls.scene = top / "scene" / "surface.usda"
        cls.scene.parent.mkdir()
        shutil.copy(HERE / "surface.usda", cls.scene)
        (cls.scene.parent / "image.hdr").write_bytes(image())
        cls.top = top

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_holds_what_a_user_needs(self):
        for name in ("bin/velatura", "bin/velatura-comp", "share/doc/velatura/copyright", "share/man/man1/velatura.1.gz",
                     "share/man/man1/velatura-comp.1.gz", "share/man/man1/velatura-render.1.gz",
                     "share/bash-completion/completions/velatura", "share/zsh/vendor-completions/_velatura-comp",
                     "share/fish/vendor_completions.d/velatura.fish", "lib/cmake/velatura/velatura-config.cmake"):
            self.assertTrue((self.place / name).is_file(), name)
        text = (self.place / "share/doc/velatura/copyright").read_text()
        self.assertIn("Apache License", text)
        self.assertIn("OpenSubdiv", text)

    def test_plugins_are_those_of_the_build(self):
        folder = self.place / "lib/velatura/plugins"
        built = sorted(p.name for p in (BUILD / "plugins").iterdir() if (p / "plugin.txt").exists())
        self.assertEqual(sorted(p.name for p in folder.iterdir()) if folder.exists() else [], built)
        for name in built:
            self.assertTrue((folder / name / f"velatura_{name}.so").exists(), name)
            self.assertTrue((folder / name / "plugin.txt").exists(), name)

    def test_renders_with_its_plugins(self):
        if not {"openimageio", "subdivision"} <= {p.name for p in (BUILD / "plugins").glob("*")}:
            self.skipTest("built without the plugins of the scene")
        made = run(self.velatura, "render", self.scene, "-o", self.top / "installed.exr", *QUICK)
        # A note says that this scene has no RenderSettings
        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertNotRegex(made.stderr, "error|warning", made.stdout)
        run(BUILD / "bin/velatura", "render", self.scene, "-o", self.top / "built.exr", *QUICK)
        self.assertEqual((self.top / "installed.exr").read_bytes(), (self.top / "built.exr").read_bytes())

    def test_a_program_alone_says_which_folders_it_searched(self):
        alone = self.top / "alone" / "bin"
        alone.mkdir(parents=True)
        shutil.copy(self.velatura, alone)
        made = run(alone / "velatura", "render", self.scene, "-o", self.top / "alone.exr", *QUICK)
        if "plugin" not in made.stderr:
            self.skipTest("plugins are installed at the configured prefix")
        self.assertEqual(made.returncode, 1, made.stderr)
        self.assertIn("[plugin-missing]", made.stderr)
        self.assertIn(str(self.top / "alone/lib/velatura/plugins"), made.stderr)
        self.assertTrue((self.top / "alone.exr").exists())

    def commands(self):
        """(program, words of the command) of every command that has a help text."""
        for program in ("velatura", "velatura-comp"):
            text = run(self.place / "bin" / program, "--help").stdout
            listed = text.partition("\nCommands:\n")[2].partition("\n\n")[0]
            yield program, []
            for word in re.findall(r"^  (\S+) ", listed, re.MULTILINE):
                yield program, [word]

    def test_man_pages_and_completions_know_every_option(self):
        shells = ("share/bash-completion/completions/{}", "share/zsh/vendor-completions/_{}")
        count = 0
        for program, words in self.commands():
            text = run(self.place / "bin" / program, *words, "--help-all").stdout
            packed = (self.place / "share/man/man1" / f"{'-'.join([program, *words])}.1.gz").read_bytes()
            # Neither a name nor a time, which would differ between equal builds
            self.assertEqual(packed[:8], b"\x1f\x8b\x08\x00\x00\x00\x00\x00")
            page = gzip.decompress(packed).decode().replace("\\-", "-")
            scripts = [(self.place / shell.format(program)).read_text() for shell in shells]
            fish = (self.place / f"share/fish/vendor_completions.d/{program}.fish").read_text()
            for option in re.findall(r"^ +(?:-\w, )?(--[\w-]+)", text, re.MULTILINE):
                count += 1
                self.assertRegex(page, rf"\\fB{option}\\fR", f"{program} {words}")
                for script in scripts:
                    self.assertIn(option, script)
                self.assertIn(f"-l {option[2:]} ", fish)
        self.assertGreater(count, 100)

    def complete(self, program, *words):
        """What bash offers for the last of the words."""
        script = self.place / "share/bash-completion/completions" / program
        line = " ".join(f"'{word}'" for word in (program, *words))
        code = (f"compopt() {{ echo FILES; }}; source '{script}'; COMP_WORDS=({line}); COMP_CWORD={len(words)}; "
                f"_{program.replace('-', '_')}; printf '%s\\n' \"${{COMPREPLY[@]}}\"")
        done = run("bash", "-c", code)
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def test_bash_completes_commands_options_and_values(self):
        self.assertEqual(self.complete("velatura", "ren"), ["render"])
        self.assertIn("--spp", self.complete("velatura", "render", "scene.usda", "--s"))
        self.assertNotIn("--spp", self.complete("velatura", "info", "--"))
        self.assertEqual(self.complete("velatura", "render", "--mode", "t"), ["tile"])
        self.assertEqual(self.complete("velatura", "render", "--mode", "=", "t"), ["tile"])
        self.assertEqual(self.complete("velatura", "render", ""), ["FILES"])
        self.assertEqual(self.complete("velatura", "render", "-o", "x"), ["FILES"])
        self.assertEqual(self.complete("velatura", "render", "--spp", ""), [])
        self.assertIn("denoise", self.complete("velatura-comp", ""))

    def build(self, source, name):
        """Builds a project against the installed tree. Returns: the folder of its programs."""
        if "-fsanitize" in (BUILD / "CMakeCache.txt").read_text():
            self.skipTest("libraries with sanitizers need programs with sanitizers")
        build = self.top / name
        for command in (["-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={self.place}", "-DCMAKE_BUILD_TYPE=Release"],
                        ["--build", build]):
            done = run("cmake", *command)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return build

    def test_installed_headers_and_libraries_build_the_examples(self):
        build = self.build(HERE.parent.parent / "examples", "examples")
        small = self.scene.parent / "small.usda"
        small.write_text('#usda 1.0\n(\n    subLayers = [@surface.usda@]\n    renderSettingsPrimPath = "/Render"\n)\n'
                         'def RenderSettings "Render"\n{\n    uniform int2 resolution = (64, 48)\n}\n')
        for program, folder in ((build / "velatura_example_relight", "outside"), (BUILD / "bin/velatura_example_relight", "within")):
            (self.top / folder).mkdir()
            done = run(program, small, self.top / folder / "first.exr", self.top / folder / "second.exr",
                       env={**os.environ, "VELATURA_PLUGIN_PATH": str(self.place / "lib/velatura/plugins")})
            self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("first.exr", "second.exr"):
            self.assertEqual((self.top / "outside" / name).read_bytes(), (self.top / "within" / name).read_bytes(), name)
        self.assertNotEqual((self.top / "outside/first.exr").read_bytes(), (self.top / "outside/second.exr").read_bytes())

    def test_find_package_builds_a_program(self):
        build = self.build(HERE / "example", "example")
        run(self.velatura, "render", self.scene, "-o", self.top / "layers.exr", "--bounces", "1", *QUICK)
        printed = run(build / "print_layers", self.top / "layers.exr")
        self.assertEqual(printed.stdout.split()[:3], ["b0", "b1", "tail"], printed.stderr)
        self.assertIn("C_sky", printed.stdout)


if __name__ == "__main__":
    unittest.main()
