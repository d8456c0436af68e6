// SPDX-License-Identifier: Apache-2.0
#include "base/usage_problem.h"

#include "base/help_page.h"
#include "base/nearest_names.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <string_view>

namespace velatura {

std::vector<const CLI::App*> named_subcommands(const CLI::App& app) {
    return app.get_subcommands(
        [](const CLI::App* sub) { return !sub->get_name().empty() && !sub->get_group().empty(); });
}

bool is_option_word(const std::string& word) {
    return word.size() > 1 && word[0] == '-' && word != "--" && (word[1] < '0' || word[1] > '9') &&
           word[1] != '.';
}

namespace {

/// The subcommand that was given, or the program.
const CLI::App& given_command(const CLI::App& app) {
    const std::vector<CLI::App*> given = app.get_subcommands();
    return given.empty() ? app : given_command(*given.back());
}

/// Long names of a command and its groups, former ones too, without dashes and without hidden ones.
void add_long_names(const CLI::App& app, std::vector<std::string>& names) {
    for (const CLI::Option* const option : app.get_options())
        if (!is_hidden(*option))
            names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
    for (const CLI::App* const group :
         app.get_subcommands([](const CLI::App* sub) { return sub->get_name().empty(); }))
        add_long_names(*group, names);
}

/// "--ssp (did you mean '--spp'?)".
std::string option_problem(const CLI::App& command, const std::string& word) {
    const std::string name = word.substr(0, word.find('='));
    std::vector<std::string> known;
    add_long_names(command, known);
    const std::string bare = name.substr(std::min(name.find_first_not_of('-'), name.size()));
    if (bare.size() < 2) return name;
    std::string text;
    for (const std::string& near : nearest_names(bare, known))
        text += (text.empty() ? " (did you mean '--" : " or '--") + near + "'";
    return name + text + (text.empty() ? "" : "?)");
}

bool has_option(const CLI::App& command, const std::string& word) {
    std::vector<std::string> known;
    add_long_names(command, known);
    const std::string name = word.substr(0, word.find('='));
    return name.starts_with("--") &&
           std::find(known.begin(), known.end(), name.substr(2)) != known.end();
}

std::string must_follow(const CLI::App& command, const std::string& word) {
    const std::string name = word.substr(0, word.find('='));
    return name + " is an option of " + command.get_name() + " and must follow it: `" +
           command.get_name() + " " + name + " ...`";
}

/// Of an option where a command is due: what follows it may be its value, and no command.
std::string problem_of_first_option(const CLI::App& app,
                                    const std::vector<const CLI::App*>& subcommands) {
    const std::vector<std::string> words = app.remaining(true);
    if (words.empty() || !is_option_word(words.front())) return {};
    for (const CLI::App* const sub : subcommands)
        if (has_option(*sub, words.front())) return must_follow(*sub, words.front());
    return "unknown option " + option_problem(app, words.front());
}

/// Why words were left over, in terms of what was meant; empty: nothing better to say than CLI11.
std::string problem_of_extras(const CLI::App& app) {
    const CLI::App& command = given_command(app);
    const std::vector<const CLI::App*> subcommands = named_subcommands(command);
    if (!subcommands.empty()) {
        if (const std::string problem = problem_of_first_option(app, subcommands); !problem.empty())
            return problem;
        for (const std::string& word : app.remaining(true)) {
            if (is_option_word(word)) continue;
            std::vector<std::string> names;
            for (const CLI::App* const sub : subcommands) names.push_back(sub->get_name());
            return "unknown command '" + word + "'" + did_you_mean(word, names);
        }
    }
    for (const std::string& word :
         &command == &app ? std::vector<std::string>() : app.remaining()) {
        if (has_option(command, word)) return must_follow(command, word);
    }
    std::string text;
    size_t count = 0;
    for (const std::string& word : app.remaining(true)) {
        if (!is_option_word(word)) continue;
        text += (count++ == 0 ? "" : ", ") + option_problem(command, word);
    }
    return count == 0 ? text : (count == 1 ? "unknown option " : "unknown options ") + text;
}

/// What CLI11 says of an error, in the words of the other messages.
std::string plain(const CLI::App& app, const CLI::ParseError& error) {
    const std::string text = error.what();
    const auto rest = [&](std::string_view start) {
        return text.starts_with(start) ? text.substr(start.size()) : std::string();
    };
    if (text == "A subcommand is required") {
        std::string names;
        for (const CLI::App* const sub : named_subcommands(given_command(app)))
            names += (names.empty() ? "" : ", ") + sub->get_name();
        return "no command given; expected one of " + names;
    }
    if (const std::string word = rest("The following argument was not expected: "); !word.empty())
        return "unexpected argument \"" + word + "\"";
    if (const std::string words = rest("The following arguments were not expected: ");
        !words.empty())
        return "unexpected arguments: " + words;
    if (const std::string of = rest("Requires at most 1 options be given from "); !of.empty())
        return "only one of these options can be given: " + of.substr(1, of.size() - 2);
    return text;
}

/// "velatura render", as called.
std::string called_name(const CLI::App& app) {
    std::string name = app.get_name();
    for (const CLI::App* at = &app; !at->get_subcommands().empty();) {
        at = at->get_subcommands().front();
        if (!at->get_name().empty()) name += " " + at->get_name();
    }
    return name;
}

}  // namespace

CommandExit usage_exit(const CLI::App& app, const std::string& problem) {
    return {usage_error,
            fmt::format("error: {} [usage]\n  note: `{} --help` lists the options\n", problem,
                        called_name(app)),
            problem};
}

CommandExit exit_of(const CLI::App& app, const CLI::ParseError& error) {
    std::ostringstream out, err;
    if (app.exit(error, out, err) == 0) return {0, out.str(), {}};
    // Of a misspelt option its value takes the place of another argument: that one is no news
    const std::string problem = problem_of_extras(app);
    return usage_exit(app, problem.empty() ? plain(app, error) : problem);
}

}  // namespace velatura
