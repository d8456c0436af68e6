// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/image_needs.h"
#include "app/prepare_frame.h"

#include <memory>

namespace velatura::app {

namespace {

int render_and_warn(const RenderJob& job, const FrameInput& input, Diagnostics& diagnostics) {
    if (!job.replay) warn_of_many_channels(job, input, diagnostics);
    return render_frame(job, input, diagnostics);
}

}  // namespace

void add_render_command(Command& app, std::function<int()>& run) {
    Command command =
        app.add_subcommand("render", "Render a USD scene to an OpenEXR file of light layers");
    auto arguments = std::make_shared<RenderArguments>();
    declare_render_options(command, *arguments);
    command.example(
        "velatura render shot.usda -o shot.exr --res 1280 720 --spp 256 --bounces 2 --halves");
    command.callback([arguments, &run] {
        run = [arguments] { return for_each_frame(*arguments, render_and_warn); };
    });
}

}  // namespace velatura::app
