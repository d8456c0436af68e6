// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/foreign_options.h"
#include "app/help_topics.h"
#include "app/missing_assets.h"
#include "base/command_line.h"
#include "base/process/mapping_guard.h"
#include "base/process/memory_limit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::app {

namespace {

/// Reports the files that were truncated, or became unreadable, while they were read. Returns:
/// whether there are any.
bool report_mapping_guard() {
    const std::vector<std::string> files = truncated_files();
    for (const std::string& file : files)
        fmt::print(
            stderr,
            "error: {} was truncated, or became unreadable, while it was read; zeros replace "
            "the missing bytes, so the image can be wrong [file-lost]\n",
            file);
    return !files.empty();
}

int end_with(const CommandExit& ended) {
    std::fputs(ended.text.c_str(), ended.code == Done ? stdout : stderr);
    return ended.code;
}

CommandExit usage_error(const Error& error) {
    return {UsageError, fmt::format("error: {} [{}]\n", error.message, error.code), error.message};
}

/// Whether the words ask for lines of Open Job Description; also of a command line with errors.
bool asks_for_openjd(const std::vector<std::string>& words) {
    for (size_t i = 1; i < words.size(); ++i)
        if (words[i] == "--progress=openjd" ||
            (words[i] == "openjd" && words[i - 1] == "--progress"))
            return true;
    return false;
}

/// Of a command line that ended before it could run.
int end_of_parsing(const CommandExit& ended, const std::vector<std::string>& words) {
    if (ended.code == Done || !asks_for_openjd(words)) return end_with(ended);
    end_with(ended);
    constexpr std::string_view before = "error: ";
    const std::string line = ended.text.substr(0, ended.text.find('\n'));
    keep_failures();
    note_error(line.starts_with(before) ? line.substr(before.size()) : line);
    print_failure(ended.code);
    return ended.code;
}

int run_command(int argc, char** argv) {
    CommandLine app(
        "Velatura: a path tracer for USD scenes with light layers; `velatura SCENE` is "
        "`velatura render SCENE`",
        "velatura");
    app.add_version_flag(std::string("velatura ") + VELATURA_VERSION);
    app.require_subcommand();
    app.footer(exit_codes_text());
    app.example("velatura render shot.usda -o shot.exr\nvelatura help layers");
    std::function<int()> run;
    add_render_command(app, run);
    add_view_command(app, run, {argv + std::min(argc, 1), argv + argc});
    add_study_command(app, run);
    add_farm_command(app, run);
    add_plan_command(app, run);
    add_info_command(app, run);
    add_selftest_command(app, run);
    add_flatten_command(app, run);
    add_import_command(app, run);
    add_help_command(app, run, help_topics(), end_with).example("velatura help farm");
    app.set_default_subcommand("render", is_scene_name);
    const std::vector<std::string> typed(argv + std::min(argc, 1), argv + argc);
    const Result<std::vector<std::string>> words = with_own_options(typed);
    const std::optional<CommandExit> ended = words ? app.parse(*words) : usage_error(words.error());
    if (ended) return end_of_parsing(*ended, {argv, argv + argc});
    std::fputs(app.notes().c_str(), stderr);
    read_truncated_pages_as_zeros();
    int code = exit_code_with_missing_assets(run ? run() : UsageError);
    if (report_mapping_guard()) code = worse_exit_code(code, RenderError);
    print_failure(code);
    return code;
}

}  // namespace

}  // namespace velatura::app

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/// As that of libstdc++, but says how much it did not find: of std::bad_alloc nobody can tell.
void* operator new(std::size_t bytes) {
    for (;;) {
        if (void* const memory = std::malloc(bytes > 0 ? bytes : 1)) return memory;
        velatura::MemoryLimit::note_rejection(bytes);
        const std::new_handler find_memory = std::get_new_handler();
        if (!find_memory) throw std::bad_alloc();
        find_memory();
    }
}

void operator delete(void* memory) noexcept {
    std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}
#endif

int main(int argc, char** argv) {
    using namespace velatura::app;
    try {
        velatura::reserve_memory();
        return run_command(argc, argv);
    } catch (const std::bad_alloc&) {
        // Printing takes no memory
        std::fputs("error: out of memory [out-of-memory]\n", stderr);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "error: %s [internal]\n", e.what());
        note_error(std::string(e.what()) + " [internal]");
        print_failure(RenderError);
    }
    return RenderError;
}
