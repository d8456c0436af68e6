// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace velatura::meta {

/// A text file of the project. `path` is relative to the root, with '/'.
struct SourceFile {
    std::string path;
    std::vector<std::string> lines;

    bool ends_with(const std::string& suffix) const;
    bool is_below(const std::string& folder) const;  ///< folder ends in '/'
    bool is_cpp_or_header() const;
};

/// Splits text into lines.
SourceFile make_file(std::string path, const std::string& text);

/// Every text file below the folders and files of the root that the project keeps, sorted by path.
std::vector<SourceFile> read_tree(const std::string& root);

/// "src/usd/text/lexer.h" → "usd/text"; "compositor/mix/mix.h" → "compositor/mix"; empty outside
/// the tiers.
std::string tier_of(const std::string& path);

/// The rules: each returns one line per violation, "path:line: what is wrong". All look only at
/// files they apply to.
std::vector<std::string> check_tier_includes(const SourceFile&);
std::vector<std::string> check_libraries(const SourceFile&);
std::vector<std::string> check_file_size(const SourceFile&);
/// No class of the project has more than 25 private methods.
std::vector<std::string> check_private_methods(const SourceFile&);
std::vector<std::string> check_spdx(const SourceFile&);
std::vector<std::string> check_namespace(const SourceFile&);
std::vector<std::string> check_pragma_once(const SourceFile&);
std::vector<std::string> check_own_header_first(const SourceFile&,
                                                const std::vector<SourceFile>& tree);
/// Precompiled headers hide a missing include of a standard header: a header includes those that it
/// uses.
std::vector<std::string> check_standard_includes(const SourceFile&);
/// No line of C++ is longer than `ColumnLimit` of .clang-format, in code points.
std::vector<std::string> check_line_length(const SourceFile&);
std::vector<std::string> check_machine_paths(const SourceFile&);
std::vector<std::string> check_banned_words(const SourceFile&);
/// Text that people read (strings of src/, compositor/ and plugins/, the user's pages of docs/) is
/// plain: without the words and shapes of the list in plain_words.cpp.
std::vector<std::string> check_plain_words(const SourceFile&);
std::vector<std::string> check_silence(const SourceFile&);
/// World, trials and tracer are made in one place.
std::vector<std::string> check_one_renderer(const SourceFile&);
std::vector<std::string> check_test_is_real(const SourceFile&);
/// One header finds the folder of the test files.
std::vector<std::string> check_test_assets(const SourceFile&);
/// What is no number is not forgotten where tests of hard cases look for the worst.
std::vector<std::string> check_worst_of_numbers(const SourceFile&);
/// A page (.md) that is named exists: relative to the file or, unless it is a link, to docs/ or the
/// root, or in a folder of docs/ by its name alone.
std::vector<std::string> check_pages(const SourceFile&, const std::vector<SourceFile>& tree);
/// Source files that architecture.md and pages like it name in backticks exist: by their path from
/// the root or src/, or in the folder of the page or of the file named before in the line. Names in
/// parentheses behind a file stand in that file.
std::vector<std::string> check_named_sources(const SourceFile&,
                                             const std::vector<SourceFile>& tree);
/// Rules on folders.
std::vector<std::string> check_tier_readmes(const std::vector<SourceFile>& tree);
std::vector<std::string> check_listed_in_cmake(const std::vector<SourceFile>& tree);
std::vector<std::string> check_root_entries(const std::vector<std::string>& names);

}  // namespace velatura::meta
