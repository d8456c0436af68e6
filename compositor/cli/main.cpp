// SPDX-License-Identifier: Apache-2.0
#include "base/command_line.h"
#include "base/help_command.h"
#include "base/process/memory_limit.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"

#include <cstdio>
#include <exception>
#include <functional>
#include <optional>
#include <string>

namespace velatura::compositor::cli {

namespace {

int end_with(const CommandExit& ended) {
    std::fputs(ended.text.c_str(), ended.code == done ? stdout : stderr);
    return ended.code;
}

int run_command(int argc, char** argv) {
    CommandLine app("Mixes, checks and converts the light layers of a render.", "velatura-comp");
    app.add_version_flag(std::string("velatura-comp ") + VELATURA_VERSION);
    app.require_subcommand();
    app.footer(
        "Exit codes: 0 done, 1 file or output error, 2 usage, 3 done in part, 4 check failed or "
        "files differ, 5 merge refused.");
    app.example(
        "velatura-comp info shot.exr\n"
        "velatura-comp mix shot.exr -o shot.png --gain key=+1st");
    std::function<int()> run;
    add_info_command(app, run);
    add_mix_command(app, run);
    add_noise_command(app, run);
    add_request_command(app, run);
    add_ui_command(app, run);
    add_verify_command(app, run);
    add_diff_command(app, run);
    add_merge_command(app, run);
    add_mattes_command(app, run);
    add_view_command(app, run);
    add_export_command(app, run);
    add_denoise_command(app, run);
    add_preset_command(app, run);
    add_bake_command(app, run);
    add_help_command(app, run, {}, end_with).example("velatura-comp help mix");
    if (const std::optional<CommandExit> ended = app.parse(argc, argv)) return end_with(*ended);
    std::fputs(app.notes().c_str(), stderr);
    const int code = run ? run() : int(usage);
    end_warnings();
    return code;
}

}  // namespace

}  // namespace velatura::compositor::cli

int main(int argc, char** argv) {
    using namespace velatura::compositor::cli;
    try {
        velatura::reserve_memory();
        return run_command(argc, argv);
    } catch (const std::exception& e) {
        // Printing takes no memory, of which there may be none
        std::fprintf(stderr, "error: %s [internal]\n", e.what());
        return failed;
    }
}
