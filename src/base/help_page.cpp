// SPDX-License-Identifier: Apache-2.0
#include "base/help_page.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <sstream>
#include <utility>

namespace velatura {

namespace {

constexpr size_t page_width = 92, text_column = 30;

using HelpOf = std::function<OptionHelp(const CLI::Option*)>;

/// Words of a text, each line of which starts `indent` columns in; `column` columns of the first
/// are taken.
std::string wrapped(const std::string& text, size_t column, size_t indent) {
    std::istringstream in(text);
    std::string out;
    bool is_first = true;
    for (std::string word; in >> word; is_first = false) {
        if (!is_first && column + 1 + word.size() > page_width) {
            out += "\n" + std::string(indent, ' ');
            column = indent;
        } else if (!is_first) {
            out += " ";
            ++column;
        }
        out += word;
        column += word.size();
    }
    return out;
}

std::string entry(const std::string& head, const std::string& text) {
    std::string out = "  " + head;
    if (text.empty()) return out + "\n";
    if (out.size() + 2 > text_column) {
        out += "\n" + std::string(text_column, ' ');
    } else {
        out += std::string(text_column - out.size(), ' ');
    }
    return out + wrapped(text, text_column, text_column) + "\n";
}

std::string listed(const std::string& relation, const std::set<CLI::Option*>& options) {
    std::string names;
    for (const CLI::Option* const option : options)
        if (!is_hidden(*option)) names += (names.empty() ? "" : ", ") + option->get_name();
    return names.empty() ? names : relation + names;
}

/// "-o, --output FILE".
std::string head_of(const CLI::Option& option, const OptionHelp& help) {
    if (option.get_positional()) return option.get_name(true);
    std::string names;
    for (const std::string& name : option.get_snames()) names += "-" + name + ", ";
    const std::vector<std::string>& former = help.former_names;
    for (const std::string& name : option.get_lnames())
        if (std::find(former.begin(), former.end(), "--" + name) == former.end())
            names += "--" + name + ", ";
    names.resize(names.size() - 2);
    if (option.get_items_expected_max() == 0) return names;
    std::string value = help.value.empty() ? option.get_type_name() : help.value;
    if (value == "INT" || value == "UINT") value = "N";
    if (value == "FLOAT") value = "X";
    return names + " " + value;
}

/// "Text [default: 64; 1 to 4096; repeatable]".
std::string text_of(const CLI::Option& option, const OptionHelp& help) {
    std::string facts;
    const auto add = [&](const std::string& fact) {
        if (!fact.empty()) facts += (facts.empty() ? "" : "; ") + fact;
    };
    if (option.get_required() && !option.get_positional()) add("required");
    if (!help.default_value.empty()) add("default: " + help.default_value);
    add(help.range);
    if (help.is_repeatable) add("repeatable");
    add(listed("needs ", option.get_needs()));
    add(listed("not with ", option.get_excludes()));
    const std::string& text = option.get_description();
    return facts.empty() ? text : text + " [" + facts + "]";
}

bool is_about_help(const CLI::App& app, const CLI::Option* option) {
    return option == app.get_help_ptr() || option == app.get_help_all_ptr() ||
           option->check_lname("version");
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
    return app.get_options([](const CLI::Option* o) { return !is_hidden(*o); });
}

std::vector<const CLI::App*> groups_of(const CLI::App& app) {
    return app.get_subcommands([](const CLI::App* sub) { return sub->get_name().empty(); });
}

struct Page {
    const CLI::App& command;
    const HelpOf& help_of;
    bool is_complete = true;
    size_t omitted = 0;
    std::string text;

    void section(const std::string& heading, const std::string& entries) {
        if (!entries.empty()) text += "\n" + heading + ":\n" + entries;
    }

    /// Those options of `app`, the command or one of its groups, for which `is_wanted` holds.
    template <class F>
    std::string entries_of(const CLI::App& app, const F& is_wanted) {
        std::string entries;
        for (const CLI::Option* const option : options_of(app)) {
            // Groups have flags of their own for the help
            if (&app != &command && is_about_help(app, option)) continue;
            if (!is_wanted(option)) continue;
            const OptionHelp help = help_of(option);
            if (is_complete || help.is_common || option->get_positional() ||
                is_about_help(command, option)) {
                entries += entry(head_of(*option, help), text_of(*option, help));
            } else {
                ++omitted;
            }
        }
        return entries;
    }

    void add_options() {
        section("Arguments", entries_of(command, [](const CLI::Option* o) {
                    return bool(o->get_positional());
                }));
        const auto is_plain = [&](const CLI::Option* o) {
            return !o->get_positional() && !is_about_help(command, o);
        };
        section("Options", entries_of(command, is_plain));
        for (const CLI::App* const group : groups_of(command))
            section(group->get_group(), entries_of(*group, is_plain));
        section("Help", entries_of(command, [&](const CLI::Option* o) {
                    return is_about_help(command, o);
                }));
    }

    void add_commands() {
        std::string entries;
        for (const CLI::App* const sub : command.get_subcommands({}))
            if (!sub->get_name().empty() && !sub->get_group().empty())
                entries += entry(sub->get_name(), sub->get_description());
        section("Commands", entries);
    }
};

std::string usage_of(const CLI::App& command, const std::string& name) {
    std::string usage = name + " [OPTIONS]";
    for (const CLI::Option* const option : options_of(command)) {
        if (!option->get_positional()) continue;
        std::string word = option->get_name(true);
        if (option->get_items_expected_max() > 1) word += "...";
        usage += option->get_required() ? " " + word : " [" + word + "]";
    }
    const bool has_commands = [&] {
        for (const CLI::App* const sub : command.get_subcommands({}))
            if (!sub->get_name().empty() && !sub->get_group().empty()) return true;
        return false;
    }();
    return usage + (has_commands ? " COMMAND" : "");
}

bool has_common_options(const CLI::App& command, const HelpOf& help_of) {
    const auto is_common = [&](const CLI::Option* o) { return help_of(o).is_common; };
    const auto has_any = [&](const CLI::App& app) {
        const std::vector<const CLI::Option*> options = options_of(app);
        return std::any_of(options.begin(), options.end(), is_common);
    };
    const std::vector<const CLI::App*> groups = groups_of(command);
    return has_any(command) || std::any_of(groups.begin(), groups.end(),
                                           [&](const CLI::App* group) { return has_any(*group); });
}

}  // namespace

bool is_hidden(const CLI::Option& option) {
    return option.get_group() == hidden_group;
}

std::string help_page(const CLI::App& command,
                      const std::string& name,
                      bool is_complete,
                      const CommandHelp& below,
                      const HelpOf& help_of) {
    Page page{command, help_of, is_complete || !has_common_options(command, help_of), 0, {}};
    if (!command.get_description().empty())
        page.text = wrapped(command.get_description(), 0, 0) + "\n";
    page.text += "\nUsage: " + usage_of(command, name) + "\n";
    page.add_options();
    page.add_commands();
    if (page.omitted > 0)
        page.text += fmt::format("\n{} more options: {} --help-all\n", page.omitted, name);
    if (!below.example.empty()) {
        std::istringstream lines(below.example);
        std::string example;
        for (std::string line; std::getline(lines, line);) example += "  " + line + "\n";
        page.section("Example", example);
    }
    if (!command.get_footer().empty()) {
        page.text += "\n";
        std::istringstream lines(command.get_footer());
        for (std::string line; std::getline(lines, line);) page.text += wrapped(line, 0, 0) + "\n";
    }
    return page.text;
}

}  // namespace velatura
