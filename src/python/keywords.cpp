// SPDX-License-Identifier: Apache-2.0
#include "python/keywords.h"

#include "base/command_line.h"
#include "base/nearest_names.h"
#include "python/failure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace velatura::python {

namespace {

/// An option that a keyword cannot stand for, and why.
struct CommandOnly {
    std::string_view option, why;
};

constexpr std::array command_only = {
    CommandOnly{"progress", "pass a function to render()"},
    CommandOnly{"quiet", "nothing is printed"},
    CommandOnly{"verbose", "nothing is printed; read `diagnostics`"},
    CommandOnly{"replay", "it prints the path of a sample"},
    CommandOnly{"paths", "it writes the paths of a pixel"},
    CommandOnly{"memory-limit", "it limits a whole process; start `velatura render` instead"},
};

/// Words of Python's grammar have an underscore behind them.
constexpr std::string_view reserved = "pass";

std::string dashed(std::string name) {
    if (name.ends_with('_') && name.starts_with(reserved) && name.size() == reserved.size() + 1)
        name.pop_back();
    std::replace(name.begin(), name.end(), '_', '-');
    return name;
}

std::string underscored(std::string name) {
    std::replace(name.begin(), name.end(), '-', '_');
    return name == reserved ? name + '_' : name;
}

const CommandOnly* find_command_only(const std::string& option) {
    const auto found = std::find_if(command_only.begin(), command_only.end(),
                                    [&](const CommandOnly& o) { return o.option == option; });
    return found == command_only.end() ? nullptr : found;
}

std::vector<std::string> keyword_names(const std::vector<OptionShape>& shapes) {
    std::vector<std::string> names;
    for (const OptionShape& shape : shapes)
        if (!find_command_only(shape.name)) names.push_back(underscored(shape.name));
    return names;
}

Failure usage(const Keyword& keyword, const std::string& problem) {
    return {Failure::Kind::Usage, "usage", keyword.name + ": " + problem};
}

/// The words of a command line that a keyword stands for.
void add_words(const Keyword& keyword, const OptionShape& shape, std::vector<std::string>& words) {
    const std::string name = "--" + shape.name;
    if (shape.is_flag) {
        if (!keyword.truth) throw usage(keyword, "expected True or False");
        if (*keyword.truth) words.push_back(name);
        return;
    }
    if (keyword.truth) {
        words.push_back(name + (*keyword.truth ? "=on" : "=off"));
    } else if (shape.is_repeatable) {
        for (const std::string& value : keyword.values) words.push_back(name + "=" + value);
    } else if (keyword.is_list && shape.values > 1) {
        words.push_back(name);
        words.insert(words.end(), keyword.values.begin(), keyword.values.end());
    } else {
        words.push_back(fmt::format("{}={}", name, fmt::join(keyword.values, ",")));
    }
}

}  // namespace

app::RenderArguments render_arguments(const std::string& scene,
                                      const std::vector<Keyword>& keywords) {
    app::RenderArguments arguments;
    CommandLine options("", "velatura.render");
    app::declare_render_options(options, arguments);
    const std::vector<OptionShape> shapes = options.option_shapes();
    // What a process has read before is no input of this render
    std::vector<std::string> words = {"--overwrite-input"};
    for (const Keyword& keyword : keywords) {
        const std::string option = dashed(keyword.name);
        if (const CommandOnly* only = find_command_only(option))
            throw Failure(
                Failure::Kind::Keyword, "usage",
                fmt::format("'{}' is an option of the command alone: {}", keyword.name, only->why));
        const auto shape = std::find_if(shapes.begin(), shapes.end(),
                                        [&](const OptionShape& s) { return s.name == option; });
        if (shape == shapes.end())
            throw Failure(Failure::Kind::Keyword, "usage",
                          fmt::format("unknown option '{}'{}", keyword.name,
                                      did_you_mean(keyword.name, keyword_names(shapes))));
        add_words(keyword, *shape, words);
    }
    words.push_back("--");
    words.push_back(scene);
    if (const std::optional<CommandExit> ended = options.parse(words))
        throw Failure(Failure::Kind::Usage, "usage", ended->message);
    arguments.quiet = true;
    return arguments;
}

std::vector<std::string> render_keywords() {
    app::RenderArguments arguments;
    CommandLine options("", "velatura.render");
    app::declare_render_options(options, arguments);
    return keyword_names(options.option_shapes());
}

}  // namespace velatura::python
