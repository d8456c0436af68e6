// SPDX-License-Identifier: Apache-2.0
#include "base/command_line.h"

#include "base/check.h"
#include "base/frames.h"
#include "base/help_page.h"
#include "base/input_guard.h"
#include "base/nearest_names.h"
#include "base/usage_problem.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>
#include <system_error>
#include <type_traits>
#include <utility>

namespace velatura {

/// What CLI11 does not keep of the options.
struct Declarations {
    struct Entry {
        CLI::App* app;
        CLI::Option* option;
        bool is_number = false, reads = false, writes = false;
        size_t values = 1;  ///< of an occurrence
    };

    std::vector<Entry> options;
    std::map<CLI::App*, CLI::Option*> overwrite_flags;  ///< by command
    std::map<const CLI::Option*, OptionHelp> help;
    std::map<const CLI::App*, CommandHelp> below;  ///< the options of a command

    /// Of an option that a Command declared.
    Entry& of(const CLI::Option* option) {
        const auto at = std::find_if(options.begin(), options.end(),
                                     [&](const Entry& e) { return e.option == option; });
        VELATURA_CHECK(at != options.end(), "an option that was not declared by a Command");
        return *at;
    }

    /// Notes on former names among the words of a command line.
    std::string former_names(const std::vector<std::string>& words) const;
    /// Whether its values are files that the command reads or writes.
    bool names_files(const CLI::Option* option) const;
    void add_overwrite_flag(CLI::App* command);
    /// Where the last occurrence wins, CLI11 takes too few values as well. Returns: what is wrong.
    std::string miscount() const;
    /// Of the command that was given, guards what it reads. Returns: which of its outputs is one of
    /// its inputs, or nothing.
    std::string guard_inputs() const;
};

namespace {

/// Groups of options have no name.
CLI::App* command_of(CLI::App* app) {
    while (app->get_name().empty() && app->get_parent() != nullptr) app = app->get_parent();
    return app;
}

/// Shortest text of a bound: "0.1", "4096".
template <class T>
std::string bound(T value) {
    return fmt::format("{}", value);
}

/// A check of numbers from min to max.
template <class T>
CLI::Validator between(T min, T max) {
    return CLI::Validator(
        [min, max](std::string& text) {
            T value{};
            if (CLI::detail::lexical_cast(text, value) && value >= min && value <= max)
                return std::string();
            return fmt::format("expected {} to {}, found \"{}\"", bound(min), bound(max), text);
        },
        std::string());
}

/// Checks numbers and says in the help which ones are valid.
template <class T>
void limit(CLI::Option* option, std::string& range, T min, T max) {
    option->check(between(min, max));
    range = bound(min) + " to " + bound(max);
}

/// Value of a destination as typed; empty where there is none to show.
std::string shown(const std::string& value) {
    return value;
}

template <class T>
std::string shown(const T& value) requires std::is_arithmetic_v<T> {
    return fmt::format("{}", value);
}

template <class T>
std::string shown(const std::optional<T>& value) {
    return value ? shown(*value) : std::string();
}

template <class T>
std::string shown(const std::vector<T>& values) {
    std::string text;
    for (const T& value : values) text += (text.empty() ? "" : ",") + shown(value);
    return text;
}

template <class T>
struct ElementType {
    using Type = T;
    static constexpr bool is_list = false;
};

template <class T>
struct ElementType<std::optional<T>> : ElementType<T> {};

template <class T>
struct ElementType<std::vector<T>> {
    using Type = T;
    static constexpr bool is_list = true;
};

/// Makes a number one that CLI11 reads as it is typed: strtoull takes -1 for 2^64 - 1 and 010 for
/// 8, strtod takes nan. Returns: what is wrong with it, or nothing.
template <class T>
std::string normalize_number(std::string& text) {
    const auto found = ", found \"" + text + "\"";
    std::string_view digits = text;
    // from_chars takes no leading plus
    if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
    std::conditional_t<std::is_floating_point_v<T>, double, T> value{};
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const bool is_whole_text = end == digits.data() + digits.size();
    if constexpr (std::is_floating_point_v<T>) {
        if (error != std::errc() || !is_whole_text || !std::isfinite(T(value)))
            return "expected a finite number" + found;
        text = std::string(digits);
    } else {
        if (error == std::errc::result_out_of_range && is_whole_text)
            return "expected a whole number of at most " +
                   std::to_string(std::numeric_limits<T>::max()) + " in size" + found;
        if (error != std::errc() || !is_whole_text)
            return (std::is_unsigned_v<T> ? "expected a whole number of 0 or more"
                                          : "expected a whole number") +
                   found;
        text = std::to_string(value);
    }
    return {};
}

void add_given_words(const CLI::Option& option, std::vector<std::string>& words) {
    const std::vector<std::string>& values = option.results();
    const auto count = size_t(option.get_items_expected_min());  // of an occurrence; 0: a flag
    const bool is_last =
        count > 0 && option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeLast;
    for (size_t i = is_last ? values.size() - count : 0; i < values.size();
         i += std::max<size_t>(count, 1)) {
        words.push_back(option.get_name() + (count == 1 ? "=" + values[i] : ""));
        for (size_t k = i; count > 1 && k < i + count; ++k) words.push_back(values[k]);
    }
}

}  // namespace

Option Option::required(bool is_required) {
    option_->required(is_required);
    return *this;
}

Option Option::expected(int values) {
    option_->expected(values);
    all_->help[option_].is_repeatable = false;
    option_->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    all_->of(option_).values = size_t(values);
    return *this;
}

Option Option::size(int max_count) {
    option_->delimiter('x');
    option_->type_name("W H");
    all_->help[option_].range = "1 to " + std::to_string(max_count);
    option_->check([max_count](const std::string& text) {
        int value = 0;
        const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
        if (parsed.ec == std::errc() && value >= 1 && value <= max_count) return std::string();
        return "expected a size from 1 to " + std::to_string(max_count) + ", found \"" + text +
               "\"";
    });
    return expected(2);
}

Option Option::take_all() {
    option_->take_all();
    all_->help[option_].is_repeatable = true;
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

Option Option::default_text(const std::string& text) {
    all_->help[option_].default_value = text;
    return *this;
}

Option Option::common() {
    all_->help[option_].is_common = true;
    return *this;
}

Option Option::hidden() {
    option_->group(hidden_group);
    return *this;
}

Option Option::former_name(const std::string& name) {
    all_->help[option_].former_names.push_back(name);
    return *this;
}

Option Option::range(int min, int max) {
    limit(option_, all_->help[option_].range, min, max);
    return *this;
}

Option Option::range(uint64_t min, uint64_t max) {
    limit(option_, all_->help[option_].range, min, max);
    return *this;
}

Option Option::range(float min, float max) {
    limit(option_, all_->help[option_].range, min, max);
    return *this;
}

Option Option::range(double min, double max) {
    limit(option_, all_->help[option_].range, min, max);
    return *this;
}

Option Option::non_negative() {
    option_->check([](const std::string& text) {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= 0) return std::string();
        return "expected 0 or more, found \"" + text + "\"";
    });
    all_->help[option_].range = "0 or more";
    return *this;
}

Option Option::one_of(const std::vector<std::string>& values) {
    std::string names, choices;
    for (size_t i = 0; i < values.size(); ++i) {
        names += (i == 0 ? "" : i + 1 == values.size() ? " or " : ", ") + values[i];
        choices += (i == 0 ? "" : ",") + values[i];
    }
    option_->check([values, names](const std::string& text) {
        if (std::find(values.begin(), values.end(), text) != values.end()) return std::string();
        return "expected " + names + ", found \"" + text + "\"" + did_you_mean(text, values);
    });
    all_->help[option_].value = "{" + choices + "}";
    return *this;
}

Option Option::synonym(const std::string& value, const std::string& meaning) {
    // Before the checks, which know only the meaning
    option_->transform(CLI::Validator(
        [value, meaning](std::string& text) {
            if (text == value) text = meaning;
            return std::string();
        },
        std::string()));
    return *this;
}

Option Option::existing_directory() {
    option_->check([](const std::string& text) {
        return CLI::detail::check_path(text.c_str()) == CLI::detail::path_type::directory
                   ? std::string()
                   : "folder \"" + text + "\" not found";
    });
    return *this;
}

Option Option::not_empty() {
    option_->check([](const std::string& text) {
        return std::string(text.empty() ? "expected a value, found \"\"" : "");
    });
    return *this;
}

Option Option::check(const std::function<std::string(const std::string& value)>& problem) {
    option_->check(problem);
    return *this;
}

Option Option::reads() {
    Declarations::Entry& entry = all_->of(option_);
    entry.reads = true;
    all_->add_overwrite_flag(command_of(entry.app));
    return *this;
}

Option Option::writes() {
    Declarations::Entry& entry = all_->of(option_);
    entry.writes = true;
    all_->add_overwrite_flag(command_of(entry.app));
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

bool Declarations::names_files(const CLI::Option* option) const {
    return std::any_of(options.begin(), options.end(),
                       [&](const Entry& e) { return e.option == option && (e.reads || e.writes); });
}

/// Once the command has options of both kinds.
void Declarations::add_overwrite_flag(CLI::App* command) {
    bool reads = false;
    CLI::App* of_output = nullptr;
    for (const Entry& entry : options) {
        if (command_of(entry.app) != command) continue;
        reads = reads || entry.reads;
        if (entry.writes && !of_output) of_output = entry.app;
    }
    if (reads && of_output && !overwrite_flags.contains(command))
        overwrite_flags[command] =
            of_output->add_flag("--overwrite-input")
                ->description("Overwrite a file that the command also reads");
}

std::string Declarations::miscount() const {
    for (const Entry& entry : options) {
        const size_t found = entry.option->results().size();
        if (found % entry.values != 0)
            return entry.option->get_name() + ": expected " + std::to_string(entry.values) +
                   " values, found " + std::to_string(found % entry.values);
    }
    return {};
}

std::string Declarations::guard_inputs() const {
    stop_guarding_inputs();
    const auto given = std::find_if(overwrite_flags.begin(), overwrite_flags.end(),
                                    [](const auto& flag) { return flag.first->parsed(); });
    if (given == overwrite_flags.end() || given->second->count() > 0) return {};
    start_guarding_inputs();
    const auto for_each_value = [&](bool Entry::*use, const auto& action) {
        for (const Entry& entry : options)
            if (entry.*use && command_of(entry.app) == given->first)
                for (const std::string& value : entry.option->results())
                    for (const std::string& file : files_of(value))
                        action(entry.option->get_name(), file);
    };
    for_each_value(&Entry::reads,
                   [](const std::string&, const std::string& value) { guard_input(value); });
    std::string problem;
    for_each_value(&Entry::writes, [&](const std::string& name, const std::string& value) {
        const Result<void> checked = check_output(value);
        if (!checked && problem.empty()) problem = name + ": " + checked.error().message;
    });
    return problem;
}

std::string Declarations::former_names(const std::vector<std::string>& words) const {
    std::string notes;
    for (const auto& [option, is] : help) {
        if (option->count() == 0) continue;
        for (const std::string& former : is.former_names)
            for (const std::string& word : words)
                if (word.substr(0, word.find('=')) == former) {
                    notes +=
                        fmt::format("note: {} is now {} [renamed]\n", former, option->get_name());
                    break;
                }
    }
    return notes;
}

Command Command::add_subcommand(const std::string& name, const std::string& help) {
    return {app_->add_subcommand(name, help), all_};
}

Command Command::add_group(const std::string& heading) {
    return {app_->add_option_group(heading), all_};
}

Option Command::add(CLI::Option* option, bool is_number) {
    all_->options.push_back({app_, option, is_number});
    return {option, all_};
}

template <class T>
Option Command::add_option(const std::string& name, T& destination, const std::string& help) {
    CLI::Option* const option = app_->add_option(name, destination, help);
    using Element = typename ElementType<T>::Type;
    if constexpr (std::is_arithmetic_v<Element>)
        option->transform(CLI::Validator(
            [](std::string& text) { return normalize_number<Element>(text); }, std::string()));
    // A list that is no positional argument would take the positional ones that follow
    if (ElementType<T>::is_list && !option->get_positional()) option->allow_extra_args(false);
    if (!ElementType<T>::is_list) option->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    if (!option->get_positional()) all_->help[option].default_value = shown(destination);
    // A list takes one value per occurrence
    all_->help[option].is_repeatable = ElementType<T>::is_list && !option->get_positional();
    return add(option, std::is_arithmetic_v<Element>);
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
    return add(app_->add_option(name, help), false);
}

Option Command::add_flag(const std::string& name, bool& destination, const std::string& help) {
    return {app_->add_flag(name, destination, help), all_};
}

Option Command::add_flag(const std::string& name, int& count, const std::string& help) {
    return {app_->add_flag(name, count, help), all_};
}

Option Command::find_option(const std::string& name) const {
    CLI::Option* const option = app_->get_option_no_throw(name);
    VELATURA_CHECK(option != nullptr, "Command::find_option() of an option that was not declared");
    return {option, all_};
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

std::vector<std::string> Command::given_words(const std::vector<std::string>& except) const {
    std::vector<std::string> words;
    std::vector<CLI::App*> apps =
        app_->get_subcommands([](CLI::App* sub) { return sub->get_name().empty(); });
    apps.push_back(app_);
    for (const CLI::App* const app : apps)
        for (const CLI::Option* const option : app->get_options())
            if (option->count() > 0 && !option->get_positional() &&
                std::find(except.begin(), except.end(), option->get_name()) == except.end())
                add_given_words(*option, words);
    return words;
}

Command Command::hidden() {
    app_->group("");
    return *this;
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

void Command::example(const std::string& lines) {
    all_->below[app_].example = lines;
}

void Command::callback(std::function<void()> action) {
    app_->callback(std::move(action));
}

CommandLine::CommandLine(const std::string& description, const std::string& name)
    : CommandLine(std::make_unique<CLI::App>(description, name), std::make_unique<Declarations>()) {
}

CommandLine::CommandLine(std::unique_ptr<CLI::App> app, std::unique_ptr<Declarations> all)
    : Command(app.get(), all.get()), owned_(std::move(app)), declarations_(std::move(all)) {
    owned_->set_help_flag("-h,--help", "Print the help");
    owned_->set_help_all_flag("--help-all", "Print the help of every option");
    Declarations* const declared = declarations_.get();
    owned_->formatter_fn(
        [declared](const CLI::App* command, const std::string& called, CLI::AppFormatMode mode) {
            const auto of = [declared](const CLI::Option* option) {
                const auto at = declared->help.find(option);
                OptionHelp help = at == declared->help.end() ? OptionHelp() : at->second;
                if (help.value.empty() && option->get_type_name() == "TEXT" &&
                    declared->names_files(option))
                    help.value = "FILE";
                return help;
            };
            const auto below = declared->below.find(command);
            return help_page(*command, called, mode == CLI::AppFormatMode::All,
                             below == declared->below.end() ? CommandHelp() : below->second, of);
        });
}

CommandLine::~CommandLine() = default;

void CommandLine::add_version_flag(const std::string& text) {
    owned_->set_version_flag("--version", text, "Print the version");
}

void CommandLine::set_default_subcommand(const std::string& name,
                                         std::function<bool(const std::string&)> is_its_argument) {
    default_subcommand_ = name;
    is_of_default_ = std::move(is_its_argument);
}

std::vector<DeclaredOption> CommandLine::declared_options() const {
    std::vector<DeclaredOption> declared;
    for (const Declarations::Entry& entry : declarations_->options) {
        std::string command;
        bool is_hidden = false;
        for (const CLI::App* app = command_of(entry.app); app != owned_.get();
             app = app->get_parent()) {
            if (app->get_name().empty()) continue;
            is_hidden |= app->get_group().empty();
            command = app->get_name() + (command.empty() ? "" : " ") + command;
        }
        // Former names take the options of another command
        if (is_hidden) continue;
        declared.push_back({command, entry.option->get_name(), entry.is_number,
                            entry.option->get_items_expected_min(), entry.reads, entry.writes});
    }
    return declared;
}

std::vector<OptionShape> CommandLine::option_shapes() const {
    std::vector<OptionShape> shapes;
    const auto add = [&](const CLI::App& app) {
        for (const CLI::Option* const option : app.get_options()) {
            const bool is_everywhere = option == app.get_help_ptr() ||
                                       option == app.get_help_all_ptr() ||
                                       option == app.get_version_ptr();
            const bool overwrites = std::any_of(
                declarations_->overwrite_flags.begin(), declarations_->overwrite_flags.end(),
                [&](const auto& flag) { return flag.second == option; });
            if (is_hidden(*option) || is_everywhere || overwrites || option->get_lnames().empty())
                continue;
            const auto help = declarations_->help.find(option);
            shapes.push_back({option->get_lnames().front(), option->get_items_expected_max() == 0,
                              help != declarations_->help.end() && help->second.is_repeatable,
                              option->get_items_expected_min()});
        }
    };
    add(*owned_);
    for (const CLI::App* const group :
         owned_->get_subcommands([](const CLI::App* sub) { return sub->get_name().empty(); }))
        add(*group);
    return shapes;
}

std::string CommandLine::name() const {
    return owned_->get_name();
}

std::optional<std::string> CommandLine::help_of(const std::string& subcommand) const {
    // App::help() is that of the subcommand which was given
    if (subcommand.empty())
        return owned_->get_formatter()->make_help(owned_.get(), owned_->get_name(),
                                                  CLI::AppFormatMode::Normal);
    for (const CLI::App* const sub : named_subcommands(*owned_))
        if (sub->get_name() == subcommand) return sub->help(owned_->get_name());
    return std::nullopt;
}

bool CommandLine::means_default(const std::vector<std::string>& arguments) const {
    if (default_subcommand_.empty() || arguments.empty()) return false;
    const auto is_subcommand = [&](const std::string& word) {
        const std::vector<const CLI::App*> known = named_subcommands(*owned_);
        return std::any_of(known.begin(), known.end(),
                           [&](const CLI::App* sub) { return sub->get_name() == word; });
    };
    if (is_of_default_(arguments.front())) return true;
    return is_option_word(arguments.front()) &&
           std::any_of(arguments.begin(), arguments.end(), is_of_default_) &&
           std::none_of(arguments.begin(), arguments.end(), is_subcommand);
}

std::optional<CommandExit> CommandLine::parse(int argc, const char* const* argv) {
    if (argc > 0 && owned_->get_name().empty()) {
        const std::string path = argv[0];
        owned_->name(path.substr(path.rfind('/') + 1));
    }
    return parse(argc > 1 ? std::vector<std::string>(argv + 1, argv + argc)
                          : std::vector<std::string>());
}

std::optional<CommandExit> CommandLine::parse(const std::vector<std::string>& arguments) {
    std::vector<std::string> words;
    for (const std::string& word : arguments) {
        // After --name= it would take the next word for the value
        const bool has_no_value =
            word.size() > 3 && word.starts_with("--") && word.find('=') == word.size() - 1;
        words.push_back(has_no_value ? word.substr(0, word.size() - 1) : word);
        if (has_no_value) words.emplace_back();
    }
    // CLI11 takes them from the back
    std::reverse(words.begin(), words.end());
    // It reads -.5 as options of one letter, and -5 as a number
    for (std::string& word : words)
        if (word.size() > 2 && word.starts_with("-.") && word[2] >= '0' && word[2] <= '9')
            word.insert(1, "0");
    if (means_default(arguments)) words.push_back(default_subcommand_);
    try {
        owned_->parse(std::move(words));
    } catch (const CLI::ParseError& error) {
        return exit_of(*owned_, error);
    }
    if (const std::string wrong = declarations_->miscount(); !wrong.empty())
        return usage_exit(*owned_, wrong);
    notes_ = declarations_->former_names(arguments);
    const std::string problem = declarations_->guard_inputs();
    if (problem.empty()) return std::nullopt;
    return CommandExit{usage_error, "error: " + problem + " [overwrites-input]\n", problem};
}

}  // namespace velatura
