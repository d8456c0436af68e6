// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/command_line.h"

#include <gtest/gtest.h>

#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace velatura {

/// Types what is no number, and numbers without sense, for every number option of a program: each
/// is a usage error that names the option. `below_zero` and `unbounded` name the options ("mix
/// --exposure") for which -1, and numbers of any size, make sense. Returns: the options tried.
inline std::set<std::string> expect_numbers_checked(CommandLine& line,
                                                    const std::set<std::string>& below_zero,
                                                    const std::set<std::string>& unbounded) {
    std::set<std::string> tried;
    for (const DeclaredOption& option : line.declared_options()) {
        if (!option.is_number) continue;
        const std::string name = option.command + " " + option.name;
        tried.insert(name);
        std::vector<std::string> bad = {"nan", "-nan", "inf", "-inf", "1e999",
                                        "",    " 1",   "1 x", "x"};
        if (!below_zero.contains(name)) bad.emplace_back("-1");
        if (!unbounded.contains(name)) bad.emplace_back("99999999999999999999");
        for (const std::string& value : bad) {
            std::vector<std::string> words;
            std::istringstream command(option.command);
            for (std::string word; command >> word;) words.push_back(word);
            words.push_back(option.name);
            words.insert(words.end(), size_t(option.values), value);
            const std::optional<CommandExit> ended = line.parse(words);
            const std::string message = ended ? ended->message : "it was taken";
            // -nan may be taken for options of one letter
            const bool is_like_option = value[0] == '-' && value != "-1" && option.values > 1;
            EXPECT_TRUE(ended && ended->code == 2 &&
                        (is_like_option || message.starts_with(option.name + ": ")))
                << name << " \"" << value << "\": " << message;
        }
    }
    return tried;
}

}  // namespace velatura
