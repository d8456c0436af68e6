// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/look/controls.h"

#include <fmt/format.h>

#include <memory>
#include <string>

namespace velatura::compositor::cli {

namespace {

struct PresetOptions {
    std::string a, b;
};

Result<Look> read_look(const std::string& path) {
    const auto text = read_file(path, size_t(1) << 24);
    if (!text) return text.error();
    auto look = look_from_json(*text);
    if (!look) return Error{look.error().code, path + ": " + look.error().message};
    return look;
}

int run_diff(const PresetOptions& o) {
    const auto a = read_look(o.a);
    if (!a) return report(a.error());
    const auto b = read_look(o.b);
    if (!b) return report(b.error());
    const auto lines = look_differences(*a, *b);
    for (const std::string& line : lines) fmt::print("{}\n", line);
    return lines.empty() ? done : check_failed;
}

}  // namespace

void add_preset_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<PresetOptions>();
    Command command = app.add_subcommand("preset", "Work with presets");
    command.require_subcommand();
    Command diff =
        command.add_subcommand("diff", "Compare two presets; exit code 4 if they differ");
    diff.add_option("a", o->a, "Preset A (JSON)").required();
    diff.add_option("b", o->b, "Preset B (JSON)").required();
    diff.example("velatura-comp preset diff day.json night.json");
    diff.callback([&run, o] { run = [o] { return run_diff(*o); }; });
}

}  // namespace velatura::compositor::cli
