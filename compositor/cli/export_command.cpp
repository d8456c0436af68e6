// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "base/frames.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/look_command_options.h"
#include "compositor/exports/export.h"
#include "compositor/exports/web_page.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::cli {

namespace {

struct ExportOptions {
    std::vector<std::string> inputs;
    std::string program, output, file;
    // Of the page
    std::string layers, display, view;
    std::optional<double> max_size_mb;

    const std::string& input() const { return inputs[0]; }

    bool is_page() const { return program == "web"; }

    LookOptions look;
};

/// Errors: those of the writers.
Result<std::string> script_of(const ExportOptions& o,
                              const LayerStack& stack,
                              const mix::MixPlan& plan,
                              const Look& look) {
    const std::string& file = o.file.empty() ? o.input() : o.file;
    if (o.program == "nuke") {
        const std::string folder = std::filesystem::path(o.output).parent_path().string();
        return exports::nuke_script(stack, plan, look, file, folder);
    }
    const auto recipe = exports::mix_recipe(stack, plan, look, file);
    if (!recipe) return recipe.error();
    return o.program == "oiio" ? exports::oiio_script(*recipe) : exports::blender_script(*recipe);
}

/// Of a sequence, that which says what its frames hold: the one of --frame, else the first.
Result<std::string> layout_file(const ExportOptions& o) {
    if (!is_sequence(o.input()) || o.look.frame) return o.look.input_of_frame(o.input());
    const std::vector<int> frames = frames_on_disk(o.input());
    if (frames.empty()) return Error{"frame-missing", "no frame found of " + o.input()};
    return frame_file(o.input(), frames.front());
}

/// `shot.0012` of `dir/shot.0012.exr`.
std::string title_of(const std::string& path) {
    return std::filesystem::path(path).stem().string();
}

int write_page(const ExportOptions& o, const LayerStack& stack, const Look& look) {
    exports::WebOptions options;
    if (o.max_size_mb) options.max_bytes = size_t(*o.max_size_mb * 1e6);
    options.layers = o.layers;
    options.title = title_of(stack.path());
    const auto page = exports::web_page(stack, look, options);
    if (!page) return report(page.error());
    for (const std::string& warning : page->warnings) warn(o.input() + ": " + warning);
    if (const auto written = write_file_atomically(o.output, page->html); !written)
        return report(written.error());
    const image::Window& frame = stack.image().display;
    const bool is_scaled = page->width != frame.width() || page->height != frame.height();
    fmt::print("{}: {:.1f} MB, {} layers at {}x{}{}; colors by {}\n", o.output,
               double(page->html.size()) / 1e6, page->layers, page->width, page->height,
               is_scaled
                   ? fmt::format(", scaled down from {}x{} to stay within --max-size {:g} MB",
                                 frame.width(), frame.height(), double(options.max_bytes) / 1e6)
                   : "",
               page->display);
    fmt::print(
        "faders at 0: {:.3f} % of the 8-bit values are those of the render{}; largest "
        "difference {} of 255 steps\n",
        100 * page->equal_share, is_scaled ? " at that size" : "", page->largest_difference);
    return done;
}

/// Options that only the page has, or only scripts.
Result<void> check_options(const ExportOptions& o) {
    if (o.is_page()) {
        if (o.output.empty()) return Error{"bad-output", "export web needs -o FILE.html"};
        if (!o.file.empty())
            return Error{"bad-output", "--file is for scripts: a page holds the image itself"};
        return {};
    }
    if (o.max_size_mb) return Error{"bad-output", "--max-size is for `export web`"};
    for (const auto& [name, value] :
         {std::pair("--layers", o.layers), {"--display", o.display}, {"--view", o.view}}) {
        if (!value.empty())
            return Error{"bad-output",
                         fmt::format("{} is for `export web`: a script reads all layers, and "
                                     "display transforms are left to the program",
                                     name)};
    }
    return {};
}

int run_export(const ExportOptions& o) {
    if (const auto checked = check_options(o); !checked) return report(checked.error());
    if (o.inputs.size() > 1)
        return report(
            {"export-several",
             fmt::format("an export reads one file; join them first (velatura-comp mix {} {} "
                         "… --with-layers -o all.exr) and export that",
                         o.inputs[0], o.inputs[1])});
    const auto asked = o.look.look_of_frame();
    if (!asked) return report(asked.error());
    const auto input = layout_file(o);
    if (!input) return report(input.error());
    const auto stack = LayerStack::load(*input, ForeignFiles::Plain);
    if (!stack) return report(stack.error());
    for (const std::string& note : stack->notes()) warn(o.input() + ": " + note);
    Look look = o.look.fitted(*stack, *asked);
    if (!o.display.empty()) look.display = o.display;
    if (!o.view.empty()) look.view = o.view;
    if (o.is_page()) return write_page(o, *stack, look);
    const auto plan = mix::plan_mix(*stack, look);
    if (!plan) return report(plan.error());
    for (const std::string& note : plan->notes) warn(o.input() + ": " + note);
    const auto script = script_of(o, *stack, *plan, look);
    if (!script) return report(script.error());
    if (o.output.empty()) {
        fmt::print("{}", *script);
        return done;
    }
    const auto written = write_file_atomically(o.output, *script);
    return written ? done : report(written.error());
}

}  // namespace

void add_export_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<ExportOptions>();
    Command command = app.add_subcommand(
        "export",
        "Write a script that rebuilds a mix in Nuke, oiiotool or Blender, or a page with a "
        "light mixer for web browsers");
    command
        .add_option(
            "program", o->program,
            "Program: nuke (a group with a knob per fader), oiio (a shell script for oiiotool), "
            "blender, or web (one HTML file with the layers and a fader per row)")
        .required()
        .one_of({"nuke", "oiio", "blender", "web"});
    command
        .add_option(
            "input", o->inputs,
            "File of light layers, or shot.####.exr; join several files of one AOV each with "
            "`mix --with-layers` first")
        .required()
        .reads();
    command.add_option("-o,--output", o->output, "Script file, or .html file")
        .type_name("FILE")
        .default_text("print the script")
        .writes();
    command
        .add_option("--file", o->file,
                    "Image or sequence that the script reads, e.g. shot.####.exr")
        .type_name("FILE")
        .default_text("the input")
        .reads();
    Command page = command.add_group("Page (web)");
    page.add_option("--max-size", o->max_size_mb,
                    "Size of the file in MB, beyond which the image is scaled down")
        .range(0.1, 1000.0)
        .default_text("25");
    page.add_option(
            "--layers", o->layers,
            "Layers of the faders: lobe-matrix (each lobe of each bounce of each light), matrix "
            "(each bounce of each light), light or bounce")
        .one_of({"lobe-matrix", "matrix", "light", "bounce"})
        .default_text("matrix where it is stored, else light and bounce");
    page.add_option("--display", o->display, "OpenColorIO display").type_name("NAME");
    page.add_option("--view", o->view, "OpenColorIO view: ACES, sRGB or Raw in the built-in config")
        .type_name("NAME");
    o->look.add_to(command);
    command.example(
        "velatura-comp export nuke shot.exr --gain key=+1st -o mix.nk\n"
        "velatura-comp export web shot.exr -o shot.html");
    command.callback([&run, o] { run = [o] { return run_export(*o); }; });
}

}  // namespace velatura::compositor::cli
