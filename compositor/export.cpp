// SPDX-License-Identifier: Apache-2.0
#include "compositor/export.h"

#include "image/layer_header.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace velatura::compositor {

namespace {

/// The name of the part that holds a channel; empty where the file has one part, or none holds it.
std::string part_of(const image::Image& image, const std::string& channel) {
    if (image.parts.size() < 2) return "";
    for (const image::Part& part : image.parts) {
        if (part.find(channel)) return part.name;
    }
    return "";
}

bool is_silent(const std::array<float, 3>& gain) {
    return gain[0] == 0.0f && gain[1] == 0.0f && gain[2] == 0.0f;
}

std::string channel_list(const std::string& layer) {
    return layer == "rgba" ? "R,G,B" : fmt::format("{0}.R,{0}.G,{0}.B", layer);
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
    const image::Channel* red = stack.channel(layer, 0);
    if (!red || is_silent(gain)) return;
    recipe.terms.push_back({layer, part_of(stack.image(), red->name), gain});
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

/// JSON strings are Python strings as well.
std::string python_quoted(const std::string& text) {
    return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
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
    if (!image.text(image::split_attribute).empty()) {
        return Error{"export-split", file +
                                         " keeps its layers in files beside it; export needs one "
                                         "file (--exr-layout multipart or single)"};
    }
    MixRecipe recipe;
    recipe.file = file;
    recipe.width = image.display.width();
    recipe.height = image.display.height();
    recipe.look = nlohmann::json::parse(look_to_json(look)).dump();
    recipe.has_alpha = image.find("A") != nullptr;
    recipe.alpha_part = part_of(image, "A");
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
    if (recipe.terms.empty()) recipe.terms.push_back({"rgba", part_of(image, "R"), {0, 0, 0}});
    return recipe;
}

std::string oiio_script(const MixRecipe& recipe) {
    std::string script =
        "#!/bin/sh\n" + comment(recipe) +
        "# Usage: sh SCRIPT [IN.exr [OUT.exr]]; needs oiiotool 2.4 or newer.\nset -eu\n";
    script += fmt::format("in=${{1:-{}}}\nout=${{2:-mix.exr}}\n", shell_quoted(recipe.file));
    script += "exec oiiotool";
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
        script += " \\\n  \"$in\"";
        if (!parts[i].empty()) script += " --subimage " + shell_quoted(parts[i]);
        script += fmt::format(" --label part{} --pop", i);
    }
    for (size_t i = 0; i < recipe.terms.size(); ++i) {
        const MixRecipe::Term& term = recipe.terms[i];
        script += fmt::format(" \\\n  {} --ch {} --chnames R,G,B --mulc {},{},{}{}",
                              label_of(term.part), channel_list(term.layer), term.gain[0],
                              term.gain[1], term.gain[2], i == 0 ? "" : " --add");
    }
    if (recipe.has_alpha)
        script += fmt::format(" \\\n  {} --ch A --chappend", label_of(recipe.alpha_part));
    return script + " \\\n  --eraseattrib '^velatura/.*' -d float -o \"$out\"\n";
}

std::string nuke_script(const MixRecipe& recipe) {
    std::string script = "#! nuke\n" + comment(recipe) + "version 12.0 v1\n";
    for (const MixRecipe::Term& term : recipe.terms) {
        if (term.layer != "rgba")
            script +=
                fmt::format("add_layer {{{0} {0}.red {0}.green {0}.blue {0}.alpha}}\n", term.layer);
    }
    script += fmt::format(
        "Read {{\n inputs 0\n file {}\n raw true\n name Layers\n}}\nset layers [stack 0]\n",
        tcl_quoted(recipe.file));
    for (size_t i = 0; i < recipe.terms.size(); ++i) {
        const MixRecipe::Term& term = recipe.terms[i];
        if (i > 0) script += "push $layers\n";
        script += fmt::format("Shuffle {{\n in {}\n alpha black\n name take_{}\n}}\n", term.layer,
                              term.layer);
        script +=
            fmt::format("Multiply {{\n channels rgb\n value {{{} {} {} 1}}\n name gain_{}\n}}\n",
                        term.gain[0], term.gain[1], term.gain[2], term.layer);
        if (i > 0)
            script += fmt::format(
                "Merge2 {{\n inputs 2\n operation plus\n output rgb\n name add_{}\n}}\n",
                term.layer);
    }
    if (recipe.has_alpha) {
        script += "set mix [stack 0]\npush $layers\npush $mix\n";
        script += "Copy {\n inputs 2\n from0 rgba.alpha\n to0 rgba.alpha\n name alpha\n}\n";
    }
    return script;
}

std::string blender_script(const MixRecipe& recipe) {
    std::string script = comment(recipe) +
                         "# In Blender: open in the text editor and run. Without a window: blender "
                         "-b -P SCRIPT -- [IN.exr [OUT.exr]]\n"
                         "import os\nimport sys\n\nimport bpy\n\n";
    script += fmt::format(
        "FILE = {}\nWIDTH, HEIGHT = {}, {}\n# Layer, factor of red, green, blue\nTERMS = [\n",
        python_quoted(recipe.file), recipe.width, recipe.height);
    for (const MixRecipe::Term& term : recipe.terms) {
        const std::string output = term.layer == "rgba" ? "Combined" : term.layer;
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
source.image = bpy.data.images.load(os.path.abspath(arguments[0] if arguments else FILE))


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


total = None
for row, (layer, gain) in enumerate(TERMS):
    term = mixed("MULTIPLY", source.outputs[layer], gain, layer, 2)
    total = term if total is None else mixed("ADD", total, term, "+ " + layer, 3)
if HAS_ALPHA:
    alpha = tree.nodes.new("CompositorNodeSetAlpha")
    alpha.mode, alpha.location = "REPLACE_ALPHA", (1000, 0)
    tree.links.new(total, alpha.inputs[0])
    tree.links.new(source.outputs["Alpha"], alpha.inputs[1])
    total = alpha.outputs[0]
for place, kind in enumerate(("CompositorNodeComposite", "CompositorNodeViewer")):
    output = tree.nodes.new(kind)
    output.use_alpha, output.location = HAS_ALPHA, (1250, -200 * place)
    tree.links.new(total, output.inputs[0])

if len(arguments) > 1:
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.image_settings.color_mode = "RGBA" if HAS_ALPHA else "RGB"
    render.use_compositing, render.use_sequencer = True, False
    render.filepath = os.path.abspath(arguments[1])
    bpy.ops.render.render(write_still=True)
)PY";
    return script;
}

}  // namespace velatura::compositor
