// SPDX-License-Identifier: Apache-2.0
#include "base/frames.h"
#include "base/sibling_program.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/io/input_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

namespace {

struct UiOptions {
    std::vector<std::string> inputs;
    std::string preset, input_space, stereo;
    std::optional<double> frame;
    std::vector<int> size;
    bool follows = false;
};

/// Of a sequence the frame of --frame, else the first that is there.
Result<std::string> opened_file(const UiOptions& o, const std::string& input) {
    if (!is_sequence(input)) return input;
    const std::vector<int> frames = frames_on_disk(input);
    const auto at = o.frame ? std::find_if(frames.begin(), frames.end(),
                                           [&](int f) { return double(f) == *o.frame; })
                            : frames.begin();
    if (at == frames.end())
        return Error{"frame-missing", o.frame ? fmt::format("no frame {:g} of {}; frames: {}",
                                                            *o.frame, input, frame_list(frames))
                                              : "no frame found of " + input};
    return frame_file(input, *at);
}

int run_ui(const UiOptions& o) {
    std::vector<std::string> inputs;
    for (const std::string& name : o.inputs) {
        const auto input = opened_file(o, name);
        if (!input) return report(input.error());
        if (!input->empty()) inputs.push_back(*input);
    }
    if (inputs.size() > 1 && are_frames(inputs))
        return report({"bad-frames", fmt::format("{} and {} are frames of a sequence, not AOVs of "
                                                 "one image; open it as shot.####.exr",
                                                 inputs[0], inputs[1])});
    std::vector<std::string> arguments;
    if (!o.preset.empty()) arguments.insert(arguments.end(), {"--preset", o.preset});
    if (o.frame) arguments.insert(arguments.end(), {"--frame", fmt::format("{}", *o.frame)});
    if (!o.input_space.empty()) arguments.insert(arguments.end(), {"--input-space", o.input_space});
    if (!o.stereo.empty()) arguments.insert(arguments.end(), {"--stereo", o.stereo});
    if (o.follows) arguments.emplace_back("--follow");
    if (!o.size.empty()) {
        arguments.emplace_back("--size");
        for (const int v : o.size) arguments.push_back(std::to_string(v));
    }
    // What follows is no option, whatever a file is called
    if (!inputs.empty()) arguments.emplace_back("--");
    arguments.insert(arguments.end(), inputs.begin(), inputs.end());
    return report(run_sibling("velatura-comp-ui", arguments,
                              "the window was not built; it needs Dear ImGui, GLFW and OpenGL "
                              "(Debian: libimgui-dev libglfw3-dev libgl-dev)"));
}

}  // namespace

void add_ui_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<UiOptions>();
    Command command = app.add_subcommand("ui", "Open the light mixer window");
    command.add_option("input", o->inputs,
                       "File of light layers, sequence (shot.####.exr), preset (.json), or several "
                       "files of one AOV each (see `mix`)");
    command.add_option("--preset", o->preset, "Preset to open (JSON)").type_name("FILE");
    command.add_option("--frame", o->frame, "Frame at which keyed values are read")
        .default_text("that of the file");
    command
        .add_option("--input-space", o->input_space,
                    "Color space of the file, overrides its header (see `mix`)")
        .type_name("SPACE");
    add_stereo_option(command, o->stereo);
    command.add_flag("--follow", o->follows, "Read the file again when a render replaces it");
    command.add_option("--size", o->size, "Window size").size(16384).default_text("1600 960");
    command.example("velatura-comp ui shot.exr");
    command.callback([&run, o] { run = [o] { return run_ui(*o); }; });
}

}  // namespace velatura::compositor::cli
