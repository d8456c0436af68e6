// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "base/frames.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/look_command_options.h"
#include "compositor/exports/export.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

namespace {

struct ExportOptions {
    std::vector<std::string> inputs;
    std::string program, output, file;

    const std::string& input() const { return inputs[0]; }

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

int run_export(const ExportOptions& o) {
    if (o.inputs.size() > 1)
        return report(
            {"export-several",
             fmt::format("a script reads one file; join them first (velatura-comp mix {} {} "
                         "… --with-layers -o all.exr) and export that",
                         o.inputs[0], o.inputs[1])});
    const auto asked = o.look.look_of_frame();
    if (!asked) return report(asked.error());
    const auto input = layout_file(o);
    if (!input) return report(input.error());
    const auto stack = LayerStack::load(*input, ForeignFiles::Plain);
    if (!stack) return report(stack.error());
    for (const std::string& note : stack->notes()) warn(o.input() + ": " + note);
    const Look look = o.look.fitted(*stack, *asked);
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
        "export", "Write a script that rebuilds a mix in Nuke, oiiotool or Blender");
    command
        .add_option(
            "program", o->program,
            "Program: nuke (a group with a knob per fader), oiio (a shell script for oiiotool) "
            "or blender")
        .required()
        .one_of({"nuke", "oiio", "blender"});
    command
        .add_option(
            "input", o->inputs,
            "File of light layers, or shot.####.exr; join several files of one AOV each with "
            "`mix --with-layers` first")
        .required()
        .reads();
    command.add_option("-o,--output", o->output, "Script file")
        .type_name("FILE")
        .default_text("print it")
        .writes();
    command
        .add_option("--file", o->file,
                    "Image or sequence that the script reads, e.g. shot.####.exr")
        .type_name("FILE")
        .default_text("the input")
        .reads();
    o->look.add_to(command);
    command.example("velatura-comp export nuke shot.exr --gain key=+1st -o mix.nk");
    command.callback([&run, o] { run = [o] { return run_export(*o); }; });
}

}  // namespace velatura::compositor::cli
