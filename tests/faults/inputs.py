# SPDX-License-Identifier: Apache-2.0
"""What happens to a render whose scene cannot be read, or is written over while it is read."""
import pathlib
import struct
import subprocess
import tempfile
import zlib

from workshop import DOCUMENTED, Workshop, expect

LAYERS = {
    "root.usda": """#usda 1.0
(
    subLayers = [@lights.usda@]
    upAxis = "Y"
)
def Camera "Cam"
{
    float2 clippingRange = (0.1, 1000)
    double3 xformOp:translate = (0, 0, 8)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def "Ball" (references = @ball.usdc@) { double3 xformOp:translate = (-1.5, 0, 0); uniform token[] xformOpOrder = ["xformOp:translate"]; }
def "Packed" (references = @packed.usdz@) { double3 xformOp:translate = (1.5, 0, 0); uniform token[] xformOpOrder = ["xformOp:translate"]; }
def Mesh "Wall" (apiSchemas = ["MaterialBindingAPI"])
{
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-4, -3, -2), (4, -3, -2), (4, 3, -2), (-4, 3, -2)]
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
    rel material:binding = </Wall/Mat>
    def Material "Mat"
    {
        token outputs:surface.connect = </Wall/Mat/Look.outputs:surface>
        def Shader "Look"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </Wall/Mat/Picture.outputs:rgb>
            token outputs:surface
        }
        def Shader "Picture"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @wall.png@
            float2 inputs:st.connect = </Wall/Mat/St.outputs:result>
            float3 outputs:rgb
        }
        def Shader "St"
        {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }
    }
}
""",
    "lights.usda": """#usda 1.0
def SphereLight "Lamp" (apiSchemas = ["ShapingAPI"])
{
    float inputs:intensity = 40
    asset inputs:shaping:ies:file = @lamp.ies@
    double3 xformOp:translate = (0, 3, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Sky" { asset inputs:texture:file = @sky.exr@; float inputs:intensity = 0.5; }
""",
}
IES = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 100\n0 45 90\n0\n100 80 10\n"


def part(kind, name):
    """A layer of one gprim, of so many numbers that its file has several pages."""
    times = ", ".join(f"{i}: {1 + i % 7 / 10}" for i in range(2000))
    return f'#usda 1.0\n(\n    defaultPrim = "{name}"\n)\ndef {kind} "{name}"\n{{\n    double {"radius" if kind == "Sphere" else "size"} = 1.5\n    double other.timeSamples = {{ {times} }}\n}}\n'


def stored_zip(name, data):
    """One member at a multiple of 64 bytes, as .usdz has them."""
    extra = -(30 + len(name) + 4) % 64
    field = struct.pack("<HH", 0x1986, extra) + bytes(extra)
    numbers = (20, 0, 0, 0, 33, zlib.crc32(data), len(data), len(data), len(name))
    body = struct.pack("<4sHHHHHIIIHH", b"PK\3\4", *numbers, len(field)) + name + field + data
    index = struct.pack("<4sHHHHHHIIIHHHHHII", b"PK\1\2", 20, *numbers, 0, 0, 0, 0, 0, 0) + name
    return body + index + struct.pack("<4sHHHHIIH", b"PK\5\6", 0, 0, 1, 1, len(index), len(body), 0)


def run(*command):
    done = subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
    expect(done.returncode == 0, f"{command}: {done.stdout}{done.stderr}")


def make_scene(arguments, folder):
    """A scene of several files of all kinds, made by the programs that are tested. Returns its root layer."""
    folder.mkdir()
    for name, text in LAYERS.items():
        (folder / name).write_text(text)
    (folder / "lamp.ies").write_text(IES)
    (folder / "part.usda").write_text(part("Sphere", "Ball"))
    run(arguments.bin / "velatura", "flatten", folder / "part.usda", "-o", folder / "ball.usdc")
    (folder / "part.usda").write_text(part("Cube", "Box"))
    run(arguments.bin / "velatura", "flatten", folder / "part.usda", "-o", folder / "box.usdc")
    (folder / "packed.usdz").write_bytes(stored_zip(b"box.usdc", (folder / "box.usdc").read_bytes()))
    run(arguments.bin / "velatura", "render", arguments.scenes / "transport/lens.usda", "-o", folder / "sky.exr", "--res", "32", "16", "--spp", "4", "--layers", "none", "-q")
    run(arguments.bin / "velatura-comp", "mix", folder / "sky.exr", "-o", folder / "wall.png")
    for name in ("part.usda", "box.usdc"):
        (folder / name).unlink()
    return folder / "root.usda"


class Reading:
    """A render of that scene, whose files are copied for each trial."""

    def __init__(self, arguments, folder):
        self.files = folder / "scene"
        root = make_scene(arguments, self.files)
        output = folder / "output"
        output.mkdir()
        self.shop = Workshop(arguments, output, root)
        self.shop.quiet = False
        self.kept = {path.name: path.read_bytes() for path in self.files.iterdir()}
        self.shop.finish()
        self.old = self.shop.output.read_bytes()

    def begin(self, output=b"of before"):
        self.shop.clear()
        for name, content in self.kept.items():
            (self.files / name).write_bytes(content)
        self.old = output
        self.shop.output.write_bytes(output)


def check(reading, what, code, text, failed):
    """A render that could not read something: it says so, and leaves a whole image or the old file."""
    shop = reading.shop
    expect(code in DOCUMENTED, f"{what}: exit code {code}: {text}")
    is_old = shop.output.exists() and shop.output.read_bytes() == reading.old
    if code == 0:
        found = shop.hash()
        expect(found == shop.expected or (failed and "[" in text and not found.startswith("unreadable")), f"{what}: exit code 0, another image and no word of it: {text}")
    else:
        expect("error: " in text, f"{what}: exit code {code} and no error: {text}")
        expect(is_old or not shop.output.exists() or not shop.hash().startswith("unreadable"), f"{what}: the file is broken")
    shop.clear()


def try_read(reading, n, how):
    """Returns: whether the render makes an n-th call that reads the scene."""
    what = f"reading, {how} at call {n}"
    reading.shop.clear()
    with tempfile.NamedTemporaryFile() as log:
        environment = {"LD_PRELOAD": str(reading.shop.failing_calls), "VELATURA_FAULT_FOLDER": str(reading.files), "VELATURA_FAULT_AT": str(n), "VELATURA_FAULT_HOW": how,
                       "VELATURA_FAULT_READS": "1", "VELATURA_FAULT_LOG": log.name}
        reading.old = b""
        code, text = reading.shop.run(1, environment=environment)
        failed = pathlib.Path(log.name).read_text().split("\n")[0]
    if not failed:
        expect(code == 0, f"{what}: nothing failed, and exit code {code}: {text}")
        return False
    what += f" ({failed})"
    # Images are read by libraries in other processes, each of which counts calls of its own; they open files once
    is_of_library = "texture-unreadable" in text or "light-texture" in text
    if not is_of_library and (how == "short" or (how == "EINTR" and not failed.startswith(("fstat", "stat", "mmap")))):
        expect(code == 0 and reading.shop.hash() == reading.shop.expected, f"{what}: not tried again, exit code {code}: {text}")
    check(reading, what, code, text, True)
    return True


def try_cut(reading, rng, trial):
    """A file of the scene is cut short at some instant of the render, as by a program that writes it anew in place."""
    name = rng.choice(sorted(reading.kept))
    size = rng.choice([0, rng.randrange(len(reading.kept[name]))])
    what = f"cut {trial}: {name} to {size} of {len(reading.kept[name])} bytes"
    reading.begin()
    reading.shop.output.unlink()
    reading.old = b""
    process = reading.shop.start(2)
    try:
        # Early for the most part, when it is read
        process.wait(rng.uniform(0.0, 0.9) ** 3 * reading.shop.seconds)
    except subprocess.TimeoutExpired:
        pass
    with open(reading.files / name, "r+b") as file:
        file.truncate(size)
    _, text = process.communicate()
    expect(process.returncode >= 0, f"{what}: ended by signal {-process.returncode}: {text}")
    check(reading, what, process.returncode, text, True)
    for name, content in reading.kept.items():
        (reading.files / name).write_bytes(content)
    return process.returncode


def try_readers(shop):
    """Reads the output over and over while checkpoints replace it. Returns how often, and how many different files were seen."""
    shop.clear()
    process = shop.start(1, ["--checkpoint", "0.001s"])
    seen, reads = set(), 0
    while process.poll() is None:
        try:
            seen.add(shop.output.read_bytes())
            reads += 1
        except FileNotFoundError:
            expect(not seen, "readers: the file was gone for a while")
    _, text = process.communicate()
    expect(process.returncode == 0, f"readers: exit code {process.returncode}: {text}")
    copy = shop.folder / "seen.exr"
    for content in seen:
        copy.write_bytes(content)
        done = subprocess.run([shop.bin / "velatura-comp", "verify", copy], capture_output=True, text=True)
        expect(done.returncode == 0, f"readers: a file of {len(content)} bytes that was seen is broken: {done.stdout}{done.stderr}")
    shop.clear()
    return reads, len(seen)
