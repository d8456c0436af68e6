// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/export.h"

#include "compositor/exports/export_recipe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

namespace velatura::compositor::exports {

namespace {

/// By name where oiiotool takes it for one, else by number.
std::string channel_list(const MixRecipe::Term& term) {
    if (has_plain_channels(term))
        return fmt::format("{},{},{}", term.channels[0], term.channels[1], term.channels[2]);
    return fmt::format("{},{},{}", term.places[0], term.places[1], term.places[2]);
}

/// For a POSIX shell.
std::string shell_quoted(const std::string& text) {
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

/// What Blender calls a layer: the last word before the channel.
std::string blender_pass(const MixRecipe::Term& term) {
    const size_t dot = term.channels[0].rfind('.');
    if (dot == std::string::npos) return "Combined";
    const std::string layer = term.channels[0].substr(0, dot);
    const size_t before = layer.rfind('.');
    return before == std::string::npos ? layer : layer.substr(before + 1);
}

/// Says by what a part is read. In a sequence a frame may lack it, where all its layers are black:
/// another part, which has no such channels, gives black as well.
constexpr const char* oiio_part = R"SH(is_sequence=
part() {
  if [ -z "$is_sequence" ] || oiiotool --wildcardoff "$1" --subimage "$2" --pop >/dev/null 2>&1
  then echo "$2"; else echo 0; fi
}
)SH";

/// Calls mix() for the file, or for each frame that is there.
constexpr const char* oiio_frame_loop =
    R"SH(# The last #### of a name, as $before, $hashes and $after
split() {
  after=${1##*#}
  before=${1%"#$after"}
  while [ "${before%#}" != "$before" ]; do before=${before%#}; done
  hashes=${1#"$before"}
  hashes=${hashes%"$after"}
}
case ${in##*/} in
  *'##'* | *'#'.*) ;;
  *) mix "$in" "$out"; exit ;;
esac
if [ -e "$in" ]; then mix "$in" "$out"; exit; fi
case $out in
  *'#'*) ;;
  *) echo "OUT needs #### for the frame: $out" >&2; exit 2 ;;
esac
is_sequence=yes
split "$out"
out_before=$before out_after=$after found=
split "$in"
for file in "$before"*"$after"; do
  number=${file#"$before"}
  number=${number%"$after"}
  case ${number#-} in '' | *[!0-9]*) continue ;; esac
  [ ${#number} -ge ${#hashes} ] || continue
  case $number in 0*) [ ${#number} -eq ${#hashes} ] || continue ;; esac
  mix "$file" "$out_before$number$out_after"
  found=yes
done
[ "$found" ] || { echo "there is no frame of $in" >&2; exit 1; }
)SH";

}  // namespace

std::string oiio_script(const MixRecipe& recipe) {
    std::string script =
        "#!/bin/sh\n" + comment(recipe) +
        "# Usage: sh SCRIPT [IN.exr [OUT.exr]], #### in both for the frames of a sequence; needs "
        "oiiotool 2.4 or\n# newer.\nset -eu\n";
    script += oiio_part;
    script += fmt::format("in=${{1:-{}}}\nout=${{2:-mix{}.exr}}\n", shell_quoted(recipe.file),
                          recipe.is_sequence ? ".####" : "");
    // oiiotool's own # are four digits each
    script += "mix() {\n  case $2 in */*) mkdir -p \"${2%/*}\" ;; esac\n";
    // Each part is read once and has a label; a label stands for an image like a file name
    std::vector<std::string> parts;
    const auto label_of = [&parts](const std::string& part) {
        const auto at = std::find(parts.begin(), parts.end(), part);
        if (at != parts.end()) return fmt::format("part{}", at - parts.begin());
        parts.push_back(part);
        return fmt::format("part{}", parts.size() - 1);
    };
    for (const MixRecipe::Term& term : recipe.terms) label_of(term.part);
    if (recipe.has_alpha) label_of(recipe.alpha_part);
    for (size_t i = 0; i < parts.size(); ++i) {
        if (!parts[i].empty())
            script += fmt::format("  part{}=$(part \"$1\" {})\n", i, shell_quoted(parts[i]));
    }
    script += "  oiiotool --wildcardoff";
    for (size_t i = 0; i < parts.size(); ++i) {
        script += " \\\n  \"$1\"";
        if (!parts[i].empty()) script += fmt::format(" --subimage \"$part{}\"", i);
        script += fmt::format(" --label part{} --pop", i);
    }
    for (size_t i = 0; i < recipe.terms.size(); ++i) {
        const MixRecipe::Term& term = recipe.terms[i];
        script += fmt::format(" \\\n  {} --ch {} --chnames R,G,B --mulc {},{},{}{}",
                              label_of(term.part), channel_list(term), term.gain[0], term.gain[1],
                              term.gain[2], i == 0 ? "" : " --add");
    }
    if (recipe.has_alpha)
        script +=
            fmt::format(" \\\n  {} --ch {} --chnames A --chappend", label_of(recipe.alpha_part),
                        recipe.alpha_channel == "A" ? "A" : std::to_string(recipe.alpha_place));
    return script + " \\\n  --eraseattrib '^velatura/.*' -d float -o \"$2\"\n}\n" + oiio_frame_loop;
}

std::string blender_script(const MixRecipe& recipe) {
    std::string script =
        comment(recipe) +
        "# In Blender: open in the text editor and run. Without a window: blender "
        "-b -P SCRIPT -- [IN.exr [OUT.exr]],\n# #### in both for the frames of a sequence.\n"
        "import os\nimport re\nimport sys\n\nimport bpy\n\n";
    script += fmt::format(
        "FILE = {}\nWIDTH, HEIGHT, PIXEL_ASPECT = {}, {}, {}\n"
        "# Center of the data window minus center of the display window, in pixels, right and up\n"
        "OFFSET = ({}, {})\n# Layer, factor of red, green, blue\nTERMS = [\n",
        python_quoted(recipe.file), recipe.width, recipe.height, recipe.pixel_aspect,
        recipe.offset[0], recipe.offset[1]);
    for (const MixRecipe::Term& term : recipe.terms) {
        const std::string output = blender_pass(term);
        script += fmt::format("    ({}, ({}, {}, {})),\n", python_quoted(output), term.gain[0],
                              term.gain[1], term.gain[2]);
    }
    script += fmt::format("]\nHAS_ALPHA = {}\n", recipe.has_alpha ? "True" : "False");
    script += R"PY(
arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
scene = bpy.context.scene
scene.use_nodes = True
tree = scene.node_tree
tree.nodes.clear()
source = tree.nodes.new("CompositorNodeImage")


def split(path):
    """A name before, at and after its last ####; None for the name of one file."""
    folder, name = os.path.split(path)
    places = list(re.finditer("#+", name))
    if not places or os.path.exists(path) or not re.search("##|#[.]", name):
        return None
    place = places[-1]
    return os.path.join(folder, name[:place.start()]), place.group(), name[place.end():]


def frames_of(path):
    """Numbers, as they are written, and files that are there, by number."""
    if not split(path):
        return [("", path)]
    before, hashes, after = split(path)
    folder, start = os.path.split(before)
    name = re.compile(re.escape(start) + "(-?[0-9]+)" + re.escape(after))
    found = [(name.fullmatch(file), file) for file in os.listdir(folder or ".")]
    found = [(match.group(1), os.path.join(folder, file)) for match, file in found if match]
    found = [(n, file) for n, file in found
             if len(n) >= len(hashes) and (n[0] != "0" or len(n) == len(hashes))]
    if not found:
        sys.exit(f"there is no frame of {path}")
    return sorted(found, key=lambda frame: int(frame[0]))


frames = frames_of(arguments[0] if arguments else FILE)
source.image = bpy.data.images.load(os.path.abspath(frames[0][1]))
if frames[0][0]:
    # In the window; Blender plays no frames below 0
    first, last = int(frames[0][0]), int(frames[-1][0])
    source.image.source = "SEQUENCE"
    source.frame_start, source.frame_offset = first, first - 1
    source.frame_duration = last - first + 1
    scene.frame_start, scene.frame_end = max(first, 0), max(last, 0)


def mixed(kind, first, second, name, place):
    """A node that adds or multiplies two sockets, or a socket and a color."""
    node = tree.nodes.new("CompositorNodeMixRGB")
    node.blend_type, node.label, node.location = kind, name, place
    node.inputs[0].default_value = 1
    tree.links.new(first, node.inputs[1])
    if isinstance(second, tuple):
        node.inputs[2].default_value = second + (1,)
    else:
        tree.links.new(second, node.inputs[2])
    return node.outputs[0]


def socket(layer):
    """Output of a layer; a file with a single layer has the output Image. Frames of a sequence do
    not store layers that are black: None."""
    found = source.outputs.get(layer) or (layer == "Combined" and source.outputs.get("Image"))
    if not found and not frames[0][0]:
        sys.exit(f"Blender has no pass {layer!r} of {FILE}")
    return found or None


def build():
    """The nodes after the source, of the layers that it has."""
    for node in list(tree.nodes):
        if node != source:
            tree.nodes.remove(node)
    total = None
    for row, (layer, gain) in enumerate(TERMS):
        place = socket(layer)
        # Factors of sockets are cut at 0: what is taken away is subtracted
        for kind, sign in (("ADD", 1), ("SUBTRACT", -1)):
            part = tuple(max(sign * g, 0.0) for g in gain)
            if place is None or (total is not None and not any(part)):
                continue
            term = mixed("MULTIPLY", place, part, layer, (500, -200 * row))
            total = term if total is None else mixed(kind, total, term, kind.lower() + " " + layer,
                                                     (750, -200 * row))
    if total is None:
        total = mixed("MULTIPLY", socket("Combined"), (0.0, 0.0, 0.0), "black", (500, 0))
    if HAS_ALPHA:
        alpha = tree.nodes.new("CompositorNodeSetAlpha")
        alpha.mode, alpha.location = "REPLACE_ALPHA", (1000, 0)
        tree.links.new(total, alpha.inputs[0])
        tree.links.new(source.outputs["Alpha"], alpha.inputs[1])
        total = alpha.outputs[0]
    if OFFSET != (0, 0):
        # Blender centers an image that is smaller than the frame and ignores its data window
        moved = tree.nodes.new("CompositorNodeTranslate")
        moved.location = (1125, 0)
        moved.inputs["X"].default_value, moved.inputs["Y"].default_value = OFFSET
        tree.links.new(total, moved.inputs[0])
        total = moved.outputs[0]
    for place, kind in enumerate(("CompositorNodeComposite", "CompositorNodeViewer")):
        output = tree.nodes.new(kind)
        output.use_alpha, output.location = HAS_ALPHA, (1250, -200 * place)
        tree.links.new(total, output.inputs[0])


build()
if len(arguments) > 1:
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    render.pixel_aspect_x, render.pixel_aspect_y = max(PIXEL_ASPECT, 1), max(1 / PIXEL_ASPECT, 1)
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.image_settings.color_mode = "RGBA" if HAS_ALPHA else "RGB"
    render.use_compositing, render.use_sequencer = True, False
    if frames[0][0] and not split(arguments[1]):
        sys.exit(f"OUT needs #### for the frame: {arguments[1]}")
    source.image.source = "FILE"
    for number, file in frames:
        source.image.filepath = os.path.abspath(file)
        source.image.reload()
        # Its outputs are those of this frame
        source.image = source.image
        build()
        output = arguments[1]
        if number:
            before, hashes, after = split(output)
            output = before + number + after
        render.filepath = os.path.abspath(output)
        bpy.ops.render.render(write_still=True)
)PY";
    return script;
}

}  // namespace velatura::compositor::exports
