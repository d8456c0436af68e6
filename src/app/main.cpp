// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "base/command_line.h"
#include "base/lost_pages.h"
#include "base/memory_limit.h"
#include "plugin/registry.h"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <functional>
#include <new>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

namespace {

/// Says which files were cut short, or could not be read, behind the back of those who used them;
/// whether there are any.
bool report_lost_pages() {
    const std::vector<std::string> files = files_with_lost_pages();
    for (const std::string& file : files)
        fmt::print(stderr,
                   "error: {} was cut short or could not be read while it was in use: zeros stand "
                   "for what is missing [file-lost]\n",
                   file);
    return !files.empty();
}

/// Reports the plugins that the scene needed and that could not be opened; whether there are any.
bool report_unavailable_plugins() {
    const std::vector<Error> reasons = plugin::unavailable_plugins();
    for (const Error& why : reasons)
        fmt::print(stderr, "error: the scene needs a plugin: {} [{}]\n", why.message, why.code);
    return !reasons.empty();
}

int run_command(int argc, char** argv) {
    CommandLine app("Velatura: a path tracer for USD scenes that keeps light in layers");
    app.add_version_flag(std::string("velatura ") + VELATURA_VERSION);
    app.require_subcommand();
    app.footer(
        "Exit codes: 0 done, 1 scene, file or render error, 2 usage, 3 stopped before its target, "
        "4 check failed, 5 resume refused or output taken by another render, 6 memory limit too "
        "low, 128+n signal n");
    std::function<int()> run;
    add_render_command(app, run);
    add_study_command(app, run);
    add_plan_command(app, run);
    add_info_command(app, run);
    add_selftest_command(app, run);
    add_flatten_command(app, run);
    add_import_command(app, run);
    if (const std::optional<CommandExit> ended = app.parse(argc, argv)) {
        std::fputs(ended->text.c_str(), ended->code == Done ? stdout : stderr);
        return ended->code;
    }
    read_lost_pages_as_zeros();
    const int code = run ? run() : UsageError;
    const bool has_lost = report_lost_pages();
    const bool lacks_plugins = report_unavailable_plugins();
    return (has_lost || lacks_plugins) && (code == Done || code == BudgetReached) ? RenderError
                                                                                  : code;
}

}  // namespace

}  // namespace velatura::app

int main(int argc, char** argv) {
    using namespace velatura::app;
    try {
        velatura::put_memory_aside();
        return run_command(argc, argv);
    } catch (const std::bad_alloc&) {
        // Printing takes no memory
        std::fputs("error: out of memory [out-of-memory]\n", stderr);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "error: %s [internal]\n", e.what());
    }
    return RenderError;
}
