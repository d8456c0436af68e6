// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>
#include <functional>
#include <new>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "app/commands.h"
#include "app/exit_codes.h"

int main(int argc, char** argv) {
    using namespace velatura::app;
    CLI::App app("Velatura: a path tracer for USD scenes that keeps light in layers");
    app.set_version_flag("--version", std::string("velatura ") + VELATURA_VERSION);
    app.require_subcommand(1);
    app.footer("Exit codes: 0 done, 1 scene, file or render error, 2 usage, 3 stopped before its target, 4 check failed, 5 resume refused or output taken by another render, 6 memory limit too low, 128+n signal n");
    std::function<int()> run;
    add_render_command(app, run);
    add_study_command(app, run);
    add_plan_command(app, run);
    add_info_command(app, run);
    add_selftest_command(app, run);
    add_flatten_command(app, run);
    add_import_command(app, run);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        const int code = app.exit(e);
        return code == 0 ? Done : UsageError;
    }
    try {
        return run ? run() : UsageError;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "error: out of memory [out-of-memory]\n");
        return RenderError;
    } catch (const std::exception& e) {
        fmt::print(stderr, "error: {} [internal]\n", e.what());
        return RenderError;
    }
}
