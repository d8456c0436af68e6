// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/view_options.h"
#include "base/sibling_program.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace velatura::app {

void declare_view_options(Command& command, ViewOptions& o) {
    declare_render_options(command, o.render);
    Command group = command.add_group("Window");
    group.add_option("--preset", o.preset, "Preset of the mixer to open (JSON)").type_name("FILE");
    group.add_option("--edits", o.edits, "USD layer that edits of the camera are saved to, .usda")
        .type_name("FILE")
        .default_text("SCENE.edits.usda");
    group.add_option("--size", o.size, "Window size").size(16384).default_text("1600 960");
    group.add_option("--script", o.script, "Script of mouse and key events to play before quitting")
        .type_name("FILE");
    group.add_flag("--times", o.prints_times, "Print the times of frames, mixes and drafts");
    command.example("velatura view shot.usda --res 960 540 --spp 256");
}

void add_view_command(Command& app,
                      std::function<int()>& run,
                      const std::vector<std::string>& words) {
    Command command =
        app.add_subcommand("view", "Render a USD scene in a window with the light mixer");
    const auto options = std::make_shared<ViewOptions>();
    declare_view_options(command, *options);
    // The options belong to the window's program, which reads them again
    command.callback([words, options, &run] {
        run = [words] {
            std::vector<std::string> rest = words;
            if (!rest.empty()) rest.erase(rest.begin());
            return fail(
                run_sibling("velatura-view", rest,
                            "the window was not built; it needs Dear ImGui, GLFW and OpenGL "
                            "(Debian: libimgui-dev libglfw3-dev libgl-dev)"));
        };
    });
}

}  // namespace velatura::app
