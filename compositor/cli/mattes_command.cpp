// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/io/image_name.h"
#include "compositor/io/join_mattes.h"
#include "layers/layer_file.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

namespace {

struct MattesArguments {
    std::vector<std::string> inputs;
    std::string output, frames;
    std::optional<int> levels;
};

int join_one(const std::vector<std::string>& inputs, const std::string& output, int levels) {
    std::vector<MatteInput> files;
    for (const std::string& path : inputs) {
        auto file = read_mattes(path);
        if (!file) return report(file.error());
        for (const std::string& note : file->notes) warn(path + ": " + note);
        files.push_back(std::move(*file));
    }
    const auto joined = join_mattes(files, levels);
    if (!joined) return report(joined.error());
    for (const std::string& note : joined->notes) warn(output + ": " + note);
    if (const auto written = layers::write_image_file(output, joined->image); !written)
        return report(written.error());
    fmt::print("{}\n", output);
    return done;
}

int run_mattes(const MattesArguments& o) {
    if (!is_exr(o.output)) return report({"bad-output", o.output + " is not an .exr file"});
    return run_frames({o.inputs, {o.output}, o.frames}, [&](const FrameNames& names) {
        std::vector<std::string> files;
        for (const std::string& input : o.inputs) files.push_back(names.input(input));
        return join_one(files, names.output(o.output), o.levels.value_or(0));
    });
}

}  // namespace

void add_mattes_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<MattesArguments>();
    Command command = app.add_subcommand(
        "mattes", "Join the Cryptomattes of renders that are composited over each other");
    command
        .add_option(
            "inputs", o->inputs,
            "Files from front to back, of any renderer, or shot.####.exr: each covers those "
            "after it by its alpha")
        .required()
        .reads();
    command
        .add_option("-o,--output", o->output,
                    "File of the joined Cryptomattes, with the names of all files")
        .type_name("FILE")
        .required()
        .writes();
    command
        .add_option("--levels", o->levels,
                    "Cryptomatte depth: IDs stored per pixel, by coverage; by default as many as "
                    "the files have together")
        .range(1, 64)
        .default_text("all");
    add_frames_option(command, o->frames);
    command.example("velatura-comp mattes character.exr set.exr -o mattes.exr");
    command.callback([&run, o] { run = [o] { return run_mattes(*o); }; });
}

}  // namespace velatura::compositor::cli
