// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/help_topics.h"
#include "base/nearest_names.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

namespace {

std::string topic_list() {
    std::string text = "Topics of `velatura help TOPIC`:\n";
    for (const HelpTopic& topic : help_topics())
        text += fmt::format("  {:<10}{}\n", topic.name, topic.summary);
    return text + "`velatura help COMMAND` prints the help of a command.\n";
}

int print_help(const CommandLine& app, const std::string& name) {
    if (name.empty()) {
        fmt::print("{}", topic_list());
        return Done;
    }
    std::vector<std::string> known;
    for (const HelpTopic& topic : help_topics()) {
        if (name == topic.name) {
            fmt::print("{}", topic.text);
            return Done;
        }
        known.emplace_back(topic.name);
    }
    if (const std::optional<std::string> text = app.help_of(name)) {
        fmt::print("{}", *text);
        return Done;
    }
    fmt::print(stderr, "error: no help topic \"{}\"{} [usage]\n{}", name, did_you_mean(name, known),
               topic_list());
    return UsageError;
}

}  // namespace

void add_help_command(CommandLine& app, std::function<int()>& run) {
    std::string names;
    for (const HelpTopic& topic : help_topics())
        names += (names.empty() ? "" : ", ") + std::string(topic.name);
    Command command =
        app.add_subcommand("help", "Print a help topic (" + names + ") or the help of a command");
    auto topic = std::make_shared<std::string>();
    command.add_option("topic", *topic, "Topic or command");
    command.example("velatura help farm");
    command.callback(
        [&app, topic, &run] { run = [&app, topic] { return print_help(app, *topic); }; });
}

}  // namespace velatura::app
