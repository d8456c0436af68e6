// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/atomic_file.h"
#include "base/command_line.h"
#include "base/input_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace velatura {

/// A command whose option `reads` names the file that its option `writes` names: IN in the words.
struct OverwritingCommand {
    std::string reads, writes;
    std::vector<std::string> words;  ///< the first, or two, are the command
};

/// Types each command with a file, and with hard and symbolic links to it: a usage error, unless
/// --overwrite-input is given. Fails for an option of a command that reads and writes without a
/// row.
inline void expect_inputs_guarded(CommandLine& line,
                                  const std::vector<OverwritingCommand>& rows,
                                  const std::string& folder) {
    namespace fs = std::filesystem;
    fs::create_directories(folder);
    const std::string file = folder + "/in", hard = folder + "/hard", soft = folder + "/soft";
    ASSERT_TRUE(write_file_atomically(file, "input"));
    for (const std::string& link : {hard, soft}) fs::remove(link);
    fs::create_hard_link(file, hard);
    fs::create_symlink(file, soft);

    std::set<std::pair<std::string, std::string>> tried;
    for (const OverwritingCommand& row : rows) {
        tried.emplace(row.words[0], row.reads);
        tried.emplace(row.words[0], row.writes);
        for (const std::string& other : {file, hard, soft}) {
            std::vector<std::string> words = row.words;
            // "farm submit" is two words
            if (const size_t space = words[0].find(' '); space != std::string::npos) {
                words.insert(words.begin() + 1, words[0].substr(space + 1));
                words[0].resize(space);
            }
            // The output may be named before the input
            bool is_first = true;
            for (std::string& word : words)
                if (word == "IN") word = std::exchange(is_first, false) ? file : other;
            ASSERT_FALSE(is_first) << row.words[0];
            const auto ended = line.parse(words);
            ASSERT_TRUE(ended.has_value()) << row.words[0] << " " << row.writes << " " << other;
            EXPECT_EQ(ended->code, 2);
            EXPECT_NE(ended->text.find("[overwrites-input]"), std::string::npos)
                << row.words[0] << ": " << ended->text;
            words.emplace_back("--overwrite-input");
            const auto allowed = line.parse(words);
            EXPECT_FALSE(allowed.has_value()) << row.words[0] << ": " << allowed->text;
        }
    }
    stop_guarding_inputs();
    const std::vector<DeclaredOption> options = line.declared_options();
    for (const DeclaredOption& option : options) {
        const bool both =
            std::any_of(options.begin(), options.end(),
                        [&](const auto& o) { return o.command == option.command && o.reads; }) &&
            std::any_of(options.begin(), options.end(),
                        [&](const auto& o) { return o.command == option.command && o.writes; });
        if (!both || !(option.reads || option.writes)) continue;
        EXPECT_TRUE(tried.contains({option.command, option.name}))
            << "no row for " << option.command << " " << option.name;
    }
    fs::remove_all(folder);
}

}  // namespace velatura
