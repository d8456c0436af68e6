// SPDX-License-Identifier: Apache-2.0
#include "base/help_command.h"

#include "base/nearest_names.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace velatura {

namespace {

/// What `help` prints without a name.
std::string overview(const CommandLine& app, std::span<const HelpTopic> topics) {
    if (topics.empty()) return app.help_of("").value_or("");
    const std::string name = app.name();
    std::string text = fmt::format("Topics of `{} help TOPIC`:\n", name);
    for (const HelpTopic& topic : topics)
        text += fmt::format("  {:<10}{}\n", topic.name, topic.summary);
    return text + fmt::format("`{} help COMMAND` prints the help of a command.\n", name);
}

std::vector<std::string> known_names(const CommandLine& app, std::span<const HelpTopic> topics) {
    std::set<std::string> names;
    for (const HelpTopic& topic : topics) names.emplace(topic.name);
    for (const DeclaredOption& option : app.declared_options())
        names.insert(option.command.substr(0, option.command.find(' ')));
    return {names.begin(), names.end()};
}

CommandExit page_of(const CommandLine& app,
                    std::span<const HelpTopic> topics,
                    const std::string& name) {
    constexpr int done = 0, usage_error = 2;
    if (name.empty()) return {done, overview(app, topics), {}};
    for (const HelpTopic& topic : topics)
        if (name == topic.name) return {done, std::string(topic.text), {}};
    if (const std::optional<std::string> text = app.help_of(name)) return {done, *text, {}};
    const std::string message =
        fmt::format("no {} \"{}\"{}", topics.empty() ? "command" : "help topic", name,
                    did_you_mean(name, known_names(app, topics)));
    return {usage_error, fmt::format("error: {} [usage]\n{}", message, overview(app, topics)),
            message};
}

}  // namespace

Command add_help_command(CommandLine& app,
                         std::function<int()>& run,
                         std::span<const HelpTopic> topics,
                         std::function<int(const CommandExit&)> end) {
    std::string names;
    for (const HelpTopic& topic : topics)
        names += (names.empty() ? "" : ", ") + std::string(topic.name);
    Command command = app.add_subcommand(
        "help", names.empty() ? std::string("Print the help of a command")
                              : "Print a help topic (" + names + ") or the help of a command");
    auto wanted = std::make_shared<std::string>();
    command.add_option(topics.empty() ? "command" : "topic", *wanted,
                       topics.empty() ? "Command" : "Topic or command");
    command.callback([&app, &run, topics, wanted, end = std::move(end)] {
        run = [&app, topics, wanted, end] { return end(page_of(app, topics, *wanted)); };
    });
    return command;
}

}  // namespace velatura
