// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "base/frames.h"
#include "compositor/command_outcome.h"
#include "compositor/commands.h"
#include "compositor/export.h"
#include "compositor/look_command_options.h"

#include <fmt/format.h>

#include <map>
#include <memory>
#include <string>

namespace velatura::compositor {

namespace {

struct ExportOptions {
    std::string program, input, output, file;
    LookOptions look;
};

using Writer = std::string (*)(const MixRecipe&);

const std::map<std::string, Writer>& writers() {
    static const std::map<std::string, Writer> table = {
        {"nuke", nuke_script}, {"oiio", oiio_script}, {"blender", blender_script}};
    return table;
}

/// Of a sequence, that which says what its frames hold: the one of --frame, else the first.
Result<std::string> layout_file(const ExportOptions& o) {
    if (!is_sequence(o.input) || o.look.frame) return o.look.input_of_frame(o.input);
    const std::vector<int> frames = frames_on_disk(o.input);
    if (frames.empty()) return Error{"frame-missing", "there is no frame of " + o.input};
    return frame_file(o.input, frames.front());
}

int run_export(const ExportOptions& o) {
    const auto asked = o.look.look_of_frame();
    if (!asked) return report(asked.error());
    const auto input = layout_file(o);
    if (!input) return report(input.error());
    const auto stack = LayerStack::load(*input, ForeignFiles::Plain);
    if (!stack) return report(stack.error());
    const Look look = o.look.fitted(*stack, *asked);
    const auto plan = plan_mix(*stack, look);
    if (!plan) return report(plan.error());
    for (const std::string& note : plan->notes) warn(o.input + ": " + note);
    const auto recipe = mix_recipe(*stack, *plan, look, o.file.empty() ? o.input : o.file);
    if (!recipe) return report(recipe.error());
    const std::string script = writers().at(o.program)(*recipe);
    if (o.output.empty()) {
        fmt::print("{}", script);
        return done;
    }
    const auto written = write_file_atomically(o.output, script);
    return written ? done : report(written.error());
}

}  // namespace

void add_export_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<ExportOptions>();
    Command command =
        app.add_subcommand("export", "A script that rebuilds a mix in another program");
    std::vector<std::string> programs;
    for (const auto& [name, writer] : writers()) programs.push_back(name);
    command.add_option("program", o->program, "nuke, oiio (a shell script for oiiotool) or blender")
        .required()
        .one_of(programs);
    command.add_option("input", o->input, "File of light layers, or shot.####.exr")
        .required()
        .reads();
    command.add_option("-o,--output", o->output, "The script (default: print it)").writes();
    command
        .add_option("--file", o->file,
                    "What the script reads, where that is not the input: shot.####.exr")
        .reads();
    o->look.add_to(command);
    command.callback([&run, o] { run = [o] { return run_export(*o); }; });
}

}  // namespace velatura::compositor
