// SPDX-License-Identifier: Apache-2.0
#include "base/command_line.h"

#include "base/check.h"

#include <CLI/CLI.hpp>

#include <map>
#include <sstream>
#include <utility>

namespace velatura {

namespace {

constexpr int usage_error = 2;

CommandExit exit_of(const CLI::App& app, const CLI::ParseError& error) {
    std::ostringstream out, err;
    if (app.exit(error, out, err) == 0) return {0, out.str(), {}};
    return {usage_error, err.str(), error.what()};
}

}  // namespace

Option Option::required(bool is_required) {
    option_->required(is_required);
    return *this;
}

Option Option::expected(int values) {
    option_->expected(values);
    return *this;
}

Option Option::take_all() {
    option_->take_all();
    return *this;
}

Option Option::allow_extra_args(bool is_allowed) {
    option_->allow_extra_args(is_allowed);
    return *this;
}

Option Option::delimiter(char separator) {
    option_->delimiter(separator);
    return *this;
}

Option Option::type_name(const std::string& name) {
    option_->type_name(name);
    return *this;
}

Option Option::description(const std::string& text) {
    option_->description(text);
    return *this;
}

Option Option::show_default() {
    option_->capture_default_str();
    return *this;
}

Option Option::hidden() {
    option_->group("");
    return *this;
}

Option Option::range(int min, int max) {
    option_->check(CLI::Range(min, max));
    return *this;
}

Option Option::range(uint64_t min, uint64_t max) {
    option_->check(CLI::Range(min, max));
    return *this;
}

Option Option::range(float min, float max) {
    option_->check(CLI::Range(min, max));
    return *this;
}

Option Option::range(double min, double max) {
    option_->check(CLI::Range(min, max));
    return *this;
}

Option Option::non_negative() {
    option_->check(CLI::NonNegativeNumber);
    return *this;
}

Option Option::one_of(const std::vector<std::string>& values) {
    option_->check(CLI::IsMember(values));
    return *this;
}

Option Option::existing_directory() {
    option_->check(CLI::ExistingDirectory);
    return *this;
}

Option Option::check(const std::function<std::string(const std::string& value)>& problem) {
    option_->check(problem);
    return *this;
}

Option Option::needs(Option other) {
    option_->needs(other.option_);
    return *this;
}

Option Option::excludes(Option other) {
    option_->excludes(other.option_);
    return *this;
}

size_t Option::count() const {
    return option_->count();
}

Command Command::add_subcommand(const std::string& name, const std::string& help) {
    return Command(app_->add_subcommand(name, help));
}

Command Command::add_group(const std::string& heading) {
    return Command(app_->add_option_group(heading));
}

template <class T>
Option Command::add_option(const std::string& name, T& destination, const std::string& help) {
    return Option(app_->add_option(name, destination, help));
}

template Option Command::add_option(const std::string&, std::string&, const std::string&);
template Option Command::add_option(const std::string&, int&, const std::string&);
template Option Command::add_option(const std::string&, uint32_t&, const std::string&);
template Option Command::add_option(const std::string&, uint64_t&, const std::string&);
template Option Command::add_option(const std::string&, float&, const std::string&);
template Option Command::add_option(const std::string&, double&, const std::string&);
template Option Command::add_option(const std::string&,
                                    std::vector<std::string>&,
                                    const std::string&);
template Option Command::add_option(const std::string&, std::vector<int>&, const std::string&);
template Option Command::add_option(const std::string&, std::vector<uint32_t>&, const std::string&);
template Option Command::add_option(const std::string&, std::vector<double>&, const std::string&);
template Option Command::add_option(const std::string&,
                                    std::optional<std::string>&,
                                    const std::string&);
template Option Command::add_option(const std::string&, std::optional<int>&, const std::string&);
template Option Command::add_option(const std::string&,
                                    std::optional<uint64_t>&,
                                    const std::string&);
template Option Command::add_option(const std::string&, std::optional<double>&, const std::string&);

Option Command::add_option(const std::string& name, const std::string& help) {
    return Option(app_->add_option(name, help));
}

Option Command::add_flag(const std::string& name, bool& destination, const std::string& help) {
    return Option(app_->add_flag(name, destination, help));
}

Option Command::add_flag(const std::string& name, int& count, const std::string& help) {
    return Option(app_->add_flag(name, count, help));
}

Option Command::find_option(const std::string& name) const {
    CLI::Option* const option = app_->get_option_no_throw(name);
    VELATURA_CHECK(option != nullptr, "Command::find_option() of an option that was not declared");
    return Option(option);
}

std::vector<TypedOption> Command::typed_options() const {
    std::vector<TypedOption> typed;
    std::map<const CLI::Option*, size_t> occurrences;
    for (const CLI::Option* const option : app_->parse_order()) {
        const size_t occurrence = occurrences[option]++;
        const std::vector<std::string>& values = option->results();
        typed.push_back(
            {option->get_name(), occurrence < values.size() ? values[occurrence] : std::string()});
    }
    return typed;
}

void Command::require_subcommand() {
    app_->require_subcommand(1);
}

void Command::require_options(size_t min, size_t max) {
    app_->require_option(min, max);
}

void Command::footer(const std::string& text) {
    app_->footer(text);
}

void Command::callback(std::function<void()> action) {
    app_->callback(std::move(action));
}

CommandLine::CommandLine(const std::string& description, const std::string& name)
    : CommandLine(std::make_unique<CLI::App>(description, name)) {}

CommandLine::CommandLine(std::unique_ptr<CLI::App> app)
    : Command(app.get()), owned_(std::move(app)) {}

CommandLine::~CommandLine() = default;

void CommandLine::add_version_flag(const std::string& text) {
    owned_->set_version_flag("--version", text);
}

std::optional<CommandExit> CommandLine::parse(int argc, const char* const* argv) {
    try {
        owned_->parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return exit_of(*owned_, error);
    }
    return std::nullopt;
}

std::optional<CommandExit> CommandLine::parse(const std::vector<std::string>& arguments) {
    try {
        // CLI11 takes them from the back
        owned_->parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::ParseError& error) {
        return exit_of(*owned_, error);
    }
    return std::nullopt;
}

}  // namespace velatura
