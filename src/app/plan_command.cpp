// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/plan_report.h"
#include "app/prepare_frame.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>

namespace velatura::app {

namespace {

int print_plan(const RenderJob& job,
               const FrameInput& input,
               bool as_json,
               Diagnostics& diagnostics) {
    warn_of_many_channels(job, input, diagnostics);
    const PlanNeeds needs = plan_needs(job, input, diagnostics);
    if (as_json) {
        nlohmann::ordered_json j = plan_json(input.plan);
        j["scene"] = input.scene_name;
        j["frame"] = input.frame;
        j["needs"] = needs_json(needs);
        fmt::print("{}\n", j.dump(2));
        return Done;
    }
    fmt::print("{}, frame {:g}, {} x {} pixels\n{}{}", input.scene_name, input.frame,
               input.scene.settings.width, input.scene.settings.height,
               plan_text(input.plan, job.arguments.verbosity > 0), needs_text(needs));
    return Done;
}

}  // namespace

void add_plan_command(Command& app, std::function<int()>& run) {
    Command command = app.add_subcommand("plan",
                                         "List the features that a render with these options "
                                         "would use, and why; takes all options of render");
    auto arguments = std::make_shared<RenderArguments>();
    auto as_json = std::make_shared<bool>(false);
    declare_render_options(command, *arguments);
    command.add_flag("--json", *as_json, "Print JSON");
    command.example("velatura plan shot.usda --memory-limit 8G");
    command.callback([arguments, as_json, &run] {
        run = [arguments, as_json] {
            return for_each_frame(*arguments, [&](const RenderJob& job, const FrameInput& input,
                                                  Diagnostics& diagnostics) {
                return print_plan(job, input, *as_json, diagnostics);
            });
        };
    });
}

}  // namespace velatura::app
