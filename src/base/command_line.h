// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace velatura {

struct Declarations;

/// An option, flag or positional argument: a handle, valid while its CommandLine lives. Each
/// function returns the option itself. Wrong declarations (a name used twice, a malformed name)
/// throw a std::runtime_error.
class Option {
  public:
    Option required(bool is_required = true);
    /// Exactly this number of values.
    Option expected(int values);
    /// A width and a height from 1 to `max_count`, as "320 180" or "320x180".
    Option size(int max_count);
    /// Repeatable: the values of all occurrences count. Without it the last occurrence of an option
    /// with a fixed number of values wins.
    Option take_all();
    /// For lists: an occurrence takes all words up to the next option. By default it takes one, so
    /// that positional arguments can follow any option.
    Option allow_extra_args(bool is_allowed);
    /// Splits each value at this character; empty parts are dropped.
    Option delimiter(char separator);

    /// Placeholder of the value in the help, instead of the name of its type.
    Option type_name(const std::string& name);
    Option description(const std::string& text);
    /// In the help, instead of the value that the destination had when the option was declared;
    /// empty: none is printed.
    Option default_text(const std::string& text);
    /// Listed in --help; of a command that has such options, the others are only in --help-all.
    Option common();
    /// Not listed in the help.
    Option hidden();
    /// One of its names, which still works, is in no help, and gives a note (CommandLine::notes).
    Option former_name(const std::string& name);

    /// Refuses values outside [min, max], which the help prints.
    Option range(int min, int max);
    Option range(uint64_t min, uint64_t max);
    Option range(float min, float max);
    Option range(double min, double max);
    Option non_negative();
    Option one_of(const std::vector<std::string>& values);
    /// `value` is taken for `meaning`, and is not in the help: a former or second spelling.
    Option synonym(const std::string& value, const std::string& meaning);
    Option existing_directory();
    Option not_empty();
    /// `problem` returns what is wrong with a value, or an empty string. Called once per value, in
    /// the order typed.
    Option check(const std::function<std::string(const std::string& value)>& problem);

    /// Its values name files that the command reads, or writes. A command with both refuses to
    /// write over what it reads and has the flag
    /// --overwrite-input (base/input_guard.h).
    Option reads();
    Option writes();

    /// A usage error unless `other` is given too.
    Option needs(Option other);
    /// A usage error when both are given.
    Option excludes(Option other);

    /// Number of values parsed; of a flag, number of occurrences.
    size_t count() const;

  private:
    friend class Command;

    Option(CLI::Option* option, Declarations* all) : option_(option), all_(all) {}

    CLI::Option* option_;
    Declarations* all_;
};

/// An option as it was declared: for tests that go through all of them.
struct DeclaredOption {
    std::string command;     ///< names of the subcommands, e.g. "preset diff"; empty: the program
    std::string name;        ///< "--gain", "-q", or "scene" for a positional argument
    bool is_number = false;  ///< the values are numbers
    int values = 1;          ///< of an occurrence, at least
    bool reads = false, writes = false;
};

/// An option of a command without subcommands: for callers that write command lines.
struct OptionShape {
    std::string name;  ///< the long name, without dashes
    bool is_flag = false;
    bool is_repeatable = false;  ///< the values of all occurrences count
    int values = 1;              ///< of an occurrence, at least
};

/// An occurrence of an option on the command line.
struct TypedOption {
    std::string name;   ///< the long name with its dashes if there is one, e.g. "--gain"
    std::string value;  ///< "true" for a flag
};

/// A program, subcommand or group of options: a handle, valid while its CommandLine lives.
class Command {
  public:
    Command add_subcommand(const std::string& name, const std::string& help);
    /// Options under a heading of their own in the help, in the order of the calls.
    Command add_group(const std::string& heading);

    /// Names are "-o,--output", or "scene" for a positional argument. `destination` must outlive
    /// the parsing and keeps its value when the option is absent. Numbers are decimal, finite and
    /// within the range of their type: anything else is a usage error. Only the types instantiated
    /// in command_line.cpp: std::string, int, uint32_t, uint64_t, float, double, lists of string,
    /// int, uint32_t and double, optional string, int, uint64_t and double.
    template <class T>
    Option add_option(const std::string& name, T& destination, const std::string& help);
    /// Without a destination: for check() or typed_options().
    Option add_option(const std::string& name, const std::string& help);
    Option add_flag(const std::string& name, bool& destination, const std::string& help);
    /// Counts occurrences; `count` is set to 0 at once.
    Option add_flag(const std::string& name, int& count, const std::string& help);

    /// An option of this command or of its groups. It must exist.
    Option find_option(const std::string& name) const;

    /// Options and positional arguments of this command, without those of groups and subcommands,
    /// in the order typed. Only meaningful for options that take one value per occurrence.
    std::vector<TypedOption> typed_options() const;

    /// The options that were given, those of groups too, as words that another command line with
    /// the same options reads alike; without positional arguments and those of `except` ("--name").
    std::vector<std::string> given_words(const std::vector<std::string>& except) const;

    /// Works, and stands in no help: a former name.
    Command hidden();

    /// Exactly one subcommand must be given.
    void require_subcommand();
    /// Number of distinct options that may be given; max 0 = any number.
    void require_options(size_t min, size_t max);
    /// Text below the help. Subcommands added later inherit it.
    void footer(const std::string& text);
    /// Command lines that work, one a line, below the options in the help.
    void example(const std::string& lines);
    /// Called when the command was given and everything parsed.
    void callback(std::function<void()> action);

  protected:
    Command(CLI::App* app, Declarations* all) : app_(app), all_(all) {}

  private:
    Option add(CLI::Option* option, bool is_number);

    CLI::App* app_;
    Declarations* all_;
};

/// Why a program ends instead of running.
struct CommandExit {
    int code = 0;         ///< 0: help or version, for stdout; 2: usage error, for stderr
    std::string text;     ///< whole lines, to print
    std::string message;  ///< what is wrong, as in `error: message [usage]`; empty for code 0
};

/// The command line of a program; owns its commands and options. --help and --help-all are declared
/// everywhere.
class CommandLine : public Command {
  public:
    /// `name` stands in the usage line of the help; empty: the file name of the program as called.
    explicit CommandLine(const std::string& description, const std::string& name = "");
    ~CommandLine();

    /// --version, which prints `text`.
    void add_version_flag(const std::string& text);
    /// The subcommand meant when none is named: `velatura scene.usda`. It is taken if the first
    /// argument is one that `is_its_argument` accepts, or if options come first, one of them is
    /// accepted and none is a subcommand.
    void set_default_subcommand(const std::string& name,
                                std::function<bool(const std::string&)> is_its_argument);

    /// Of all commands, without flags.
    std::vector<DeclaredOption> declared_options() const;

    /// Options and flags of the program itself and of its groups that have a long name, in the
    /// order of the help, without hidden ones and those that are declared everywhere.
    std::vector<OptionShape> option_shapes() const;

    /// As it stands in the usage line.
    std::string name() const;
    /// What --help prints of a subcommand, or of the program if the name is empty; nothing where
    /// there is no such subcommand.
    std::optional<std::string> help_of(const std::string& subcommand) const;

    /// Sets the destinations, then runs the callbacks of the commands that were given.
    /// Returns: nothing when the program is to run.
    std::optional<CommandExit> parse(int argc, const char* const* argv);
    /// The same for arguments in order, without the program's name.
    std::optional<CommandExit> parse(const std::vector<std::string>& arguments);

    /// Of the arguments parsed: whole lines, for stderr. One for each former name of an option.
    std::string notes() const { return notes_; }

  private:
    CommandLine(std::unique_ptr<CLI::App> app, std::unique_ptr<Declarations> all);

    bool means_default(const std::vector<std::string>& arguments) const;

    std::unique_ptr<CLI::App> owned_;
    std::unique_ptr<Declarations> declarations_;
    std::string default_subcommand_, notes_;
    std::function<bool(const std::string&)> is_of_default_;
};

}  // namespace velatura
