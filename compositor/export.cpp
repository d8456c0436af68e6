// SPDX-License-Identifier: Apache-2.0
#include "compositor/export.h"

#include "base/frames.h"
#include "base/unique_names.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>
#include <tuple>

namespace velatura::compositor {

namespace {

using layers::ChannelPlace;

/// Empty where the file has one part.
std::string part_of(const image::Image& image, const ChannelPlace& place) {
    return image.parts.size() < 2 ? std::string() : image.parts[place.part].name;
}

const std::string& name_of(const image::Image& image, const ChannelPlace& place) {
    return image.parts[place.part].channels[place.channel].name;
}

/// Where OpenImageIO lists a suffix among those of its layer.
size_t rank_of(std::string suffix) {
    constexpr std::array<std::array<std::string_view, 2>, 10> order = {{{"r", "red"},
                                                                        {"g", "green"},
                                                                        {"b", "blue"},
                                                                        {"real", "real"},
                                                                        {"imag", "imag"},
                                                                        {"a", "alpha"},
                                                                        {"ar", "ra"},
                                                                        {"ag", "ga"},
                                                                        {"ab", "ba"},
                                                                        {"z", "depth"}}};
    for (char& c : suffix) c = char(std::tolower(static_cast<unsigned char>(c)));
    const auto at = std::find_if(order.begin(), order.end(), [&](const auto& names) {
        return suffix == names[0] || suffix == names[1];
    });
    return size_t(at - order.begin());
}

/// The number of a channel as OpenImageIO counts those of a part: by layer, there R G B A first,
/// then as the file has them, by name. Numbers are what oiiotool takes for any name.
size_t number_of(const image::Part& part, const std::string& channel) {
    struct Key {
        std::string layer;
        size_t rank;
        std::string name;

        bool operator<(const Key& k) const {
            return std::tie(layer, rank, name) < std::tie(k.layer, k.rank, k.name);
        }
    };

    const auto key_of = [](const std::string& name) {
        const size_t dot = name.rfind('.');
        const bool is_bare = dot == std::string::npos;
        return Key{is_bare ? "" : name.substr(0, dot),
                   rank_of(is_bare ? name : name.substr(dot + 1)), name};
    };
    const Key key = key_of(channel);
    return size_t(std::count_if(part.channels.begin(), part.channels.end(),
                                [&](const image::Channel& c) { return key_of(c.name) < key; }));
}

/// Letters, digits and `_`, which every program takes for a name.
std::string plain_name(const std::string& layer) {
    std::string name = layer;
    for (char& c : name) {
        const bool is_plain =
            (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
        if (!is_plain) c = '_';
    }
    return name;
}

bool is_silent(const std::array<float, 3>& gain) {
    return gain[0] == 0.0f && gain[1] == 0.0f && gain[2] == 0.0f;
}

/// By name where oiiotool takes it for one, else by number.
std::string channel_list(const MixRecipe::Term& term) {
    std::string names, numbers;
    bool is_plain = true;
    for (size_t c = 0; c < 3; ++c) {
        const char* const comma = c == 0 ? "" : ",";
        const std::string& name = term.channels[c];
        names += comma + name;
        numbers += fmt::format("{}{}", comma, term.places[c]);
        is_plain = is_plain && !name.empty() && std::isdigit(uint8_t(name[0])) == 0 &&
                   std::all_of(name.begin(), name.end(), [](char k) {
                       return k == '.' || plain_name(std::string(1, k))[0] == k;
                   });
    }
    return is_plain ? names : numbers;
}

std::array<float, 3> scaled(std::array<float, 3> gain, float factor) {
    for (float& g : gain) g *= factor;
    return gain;
}

/// Unless it would add nothing.
void add_term(const LayerStack& stack,
              const std::string& layer,
              const std::array<float, 3>& gain,
              MixRecipe& recipe) {
    MixRecipe::Term term{layer, {}, gain};
    if (is_silent(gain)) return;
    for (size_t c = 0; c < 3; ++c) {
        const auto place = stack.place(layer, c);
        if (!place) return;
        term.channels[c] = name_of(stack.image(), *place);
        term.part = part_of(stack.image(), *place);
        term.places[c] = number_of(stack.image().parts[place->part], term.channels[c]);
    }
    recipe.terms.push_back(std::move(term));
}

/// For a POSIX shell.
std::string shell_quoted(const std::string& text) {
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

/// For Tcl, between double quotes.
std::string tcl_quoted(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '\n') {
            quoted += "\\n";
            continue;
        }
        if (std::string_view("\"\\$[]").find(c) != std::string_view::npos) quoted += '\\';
        quoted += c;
    }
    return quoted + "\"";
}

/// What Nuke calls a layer of an EXR: the channel's layer, or the part's of bare channels, of
/// letters, digits and `_`.
std::string nuke_layer(const MixRecipe::Term& term) {
    if (term.layer == "rgba" && term.channels[0] == "R") return "rgba";
    const size_t dot = term.channels[0].rfind('.');
    if (dot == std::string::npos) return term.part.empty() ? "rgba" : plain_name(term.part);
    return plain_name(term.channels[0].substr(0, dot));
}

/// What Blender calls a layer: the last word before the channel.
std::string blender_pass(const MixRecipe::Term& term) {
    const size_t dot = term.channels[0].rfind('.');
    if (dot == std::string::npos) return "Combined";
    const std::string layer = term.channels[0].substr(0, dot);
    const size_t before = layer.rfind('.');
    return before == std::string::npos ? layer : layer.substr(before + 1);
}

/// JSON strings are Python strings as well.
std::string python_quoted(const std::string& text) {
    return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

/// Names the file, in the one form that the programs share, and the frames that are there.
Result<void> name_file(const std::string& file, const std::string& loaded, MixRecipe& recipe) {
    recipe.file = with_hashes(file);
    recipe.is_sequence = is_sequence(file);
    if (!recipe.is_sequence) return {};
    const size_t end = recipe.file.rfind('#') + 1;
    const size_t begin = recipe.file.find_last_not_of('#', end - 1) + 1;
    std::string number = fmt::format("{:0{}}", 7, end - begin);
    if (recipe.file.substr(0, begin) + number + recipe.file.substr(end) != frame_path(file, 7))
        return Error{"export-sequence",
                     fmt::format("{}: the number of the frame stands in a folder or more than "
                                 "once, which other programs do not read; name the files with "
                                 "one ####",
                                 file)};
    const std::vector<int> frames = frames_on_disk(file);
    recipe.first_frame = frames.empty() ? frame_in_name(loaded).value_or(1) : frames.front();
    recipe.last_frame = frames.empty() ? recipe.first_frame : frames.back();
    return {};
}

/// The look on one line of a comment.
std::string comment(const MixRecipe& recipe) {
    // Quoted, so that no name ends the line
    return fmt::format(
        "# The mix of {}, by velatura-comp export. Scene-linear, premultiplied.\n# {}\n",
        python_quoted(recipe.file), recipe.look);
}

}  // namespace

Result<MixRecipe> mix_recipe(const LayerStack& stack,
                             const MixPlan& plan,
                             const Look& look,
                             const std::string& file) {
    const image::Image& image = stack.image();
    if (!image.text(layers::split_attribute).empty()) {
        return Error{"export-split", file +
                                         " keeps its layers in files beside it; export needs one "
                                         "file (--exr-layout multipart or single)"};
    }
    MixRecipe recipe;
    if (const auto named = name_file(file, stack.path(), recipe); !named) return named.error();
    recipe.width = image.display.width();
    recipe.height = image.display.height();
    recipe.look = nlohmann::json::parse(look_to_json(look)).dump();
    recipe.pixel_aspect = image.pixel_aspect_ratio;
    const image::Window &all = image.display, &stored = image.data;
    recipe.offset = {(double(stored.x0) + stored.x1 - all.x0 - all.x1) / 2,
                     (double(all.y0) + all.y1 - stored.y0 - stored.y1) / 2};
    if (const auto alpha = stack.place("rgba", 3)) {
        recipe.has_alpha = true;
        recipe.alpha_part = part_of(image, *alpha);
        recipe.alpha_channel = name_of(image, *alpha);
        recipe.alpha_place = number_of(image.parts[alpha->part], recipe.alpha_channel);
    }
    const float exposure = std::exp2(look.exposure_stops);
    for (const MixPlan::Term& term : plan.all_terms()) {
        if (has_mattes(term)) {
            return Error{"export-matte",
                         fmt::format("{} is gained within a matte, which a script cannot say: "
                                     "leave --matte out, or mix to .exr",
                                     term.layer)};
        }
        const std::array<float, 3> gain = scaled(term.gain, exposure);
        add_term(stack, term.layer, gain, recipe);
        // What a clamp took is gained as the rest of its layer
        if (term.clamp_layer.empty()) continue;
        add_term(stack, term.clamp_layer, scaled(gain, plan.clamp_share(term, 0)), recipe);
    }
    // All muted: black, of the right size
    if (recipe.terms.empty()) {
        add_term(stack, "rgba", {1, 1, 1}, recipe);
        for (MixRecipe::Term& term : recipe.terms) term.gain = {0, 0, 0};
    }
    return recipe;
}

namespace {

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
    script += fmt::format("in=${{1:-{}}}\nout=${{2:-mix{}.exr}}\n", shell_quoted(recipe.file),
                          recipe.is_sequence ? ".####" : "");
    // oiiotool's own # are four digits each
    script += "mix() {\n  case $2 in */*) mkdir -p \"${2%/*}\" ;; esac\n  oiiotool --wildcardoff";
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
        script += " \\\n  \"$1\"";
        if (!parts[i].empty()) script += " --subimage " + shell_quoted(parts[i]);
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

std::string nuke_script(const MixRecipe& recipe) {
    std::string script = "#! nuke\n" + comment(recipe) + "version 12.0 v1\n";
    UniqueNames nodes;
    std::vector<std::string> names;
    for (const MixRecipe::Term& term : recipe.terms) {
        const std::string layer = nuke_layer(term);
        names.push_back(nodes.make(plain_name(term.layer)));
        if (layer != "rgba")
            script +=
                fmt::format("add_layer {{{0} {0}.red {0}.green {0}.blue {0}.alpha}}\n", layer);
    }
    script += fmt::format(
        "Read {{\n inputs 0\n file {}\n{} raw true\n name Layers\n}}\nset layers [stack 0]\n",
        tcl_quoted(recipe.file),
        recipe.is_sequence ? fmt::format(" first {0}\n last {1}\n origfirst {0}\n origlast {1}\n",
                                         recipe.first_frame, recipe.last_frame)
                           : std::string());
    for (size_t i = 0; i < recipe.terms.size(); ++i) {
        const MixRecipe::Term& term = recipe.terms[i];
        if (i > 0) script += "push $layers\n";
        script += fmt::format("Shuffle {{\n in {}\n alpha black\n name take_{}\n}}\n",
                              nuke_layer(term), names[i]);
        script +=
            fmt::format("Multiply {{\n channels rgb\n value {{{} {} {} 1}}\n name gain_{}\n}}\n",
                        term.gain[0], term.gain[1], term.gain[2], names[i]);
        if (i > 0)
            script += fmt::format(
                "Merge2 {{\n inputs 2\n operation plus\n output rgb\n name add_{}\n}}\n", names[i]);
    }
    if (recipe.has_alpha) {
        script += "set mix [stack 0]\npush $layers\npush $mix\n";
        script += "Copy {\n inputs 2\n from0 rgba.alpha\n to0 rgba.alpha\n name alpha\n}\n";
    }
    return script;
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


def mixed(kind, first, second, name, column):
    """A node that adds or multiplies two sockets, or a socket and a colour."""
    node = tree.nodes.new("CompositorNodeMixRGB")
    node.blend_type, node.label, node.location = kind, name, (250 * column, -200 * row)
    node.inputs[0].default_value = 1
    tree.links.new(first, node.inputs[1])
    if isinstance(second, tuple):
        node.inputs[2].default_value = second + (1,)
    else:
        tree.links.new(second, node.inputs[2])
    return node.outputs[0]


def socket(layer):
    """Output of a layer; a file with a single layer has the output Image."""
    found = source.outputs.get(layer) or (layer == "Combined" and source.outputs.get("Image"))
    if not found:
        sys.exit(f"Blender has no pass {layer!r} of {FILE}")
    return found


total = None
for row, (layer, gain) in enumerate(TERMS):
    # Factors of sockets are cut at 0: what is taken away is subtracted
    for kind, sign in (("ADD", 1), ("SUBTRACT", -1)):
        part = tuple(max(sign * g, 0.0) for g in gain)
        if total is not None and not any(part):
            continue
        term = mixed("MULTIPLY", socket(layer), part, layer, 2)
        total = term if total is None else mixed(kind, total, term, kind.lower() + " " + layer, 3)
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
        output = arguments[1]
        if number:
            before, hashes, after = split(output)
            output = before + number + after
        render.filepath = os.path.abspath(output)
        bpy.ops.render.render(write_still=True)
)PY";
    return script;
}

}  // namespace velatura::compositor
