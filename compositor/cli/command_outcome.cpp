// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"

#include <fmt/format.h>

#include <cstdio>

namespace velatura::compositor::cli {

bool RepeatedWarnings::can_print(const std::string& message) {
    const size_t file_end = message.find(": ");
    const std::lock_guard lock(mutex_);
    return ++counts_[file_end == std::string::npos ? message : message.substr(file_end + 2)] <=
           printed_limit;
}

std::string RepeatedWarnings::take_summary() {
    const std::lock_guard lock(mutex_);
    std::string text;
    for (const auto& [what, count] : counts_)
        if (count > printed_limit)
            text += fmt::format("warning: {} more like these, not printed: {}\n",
                                count - printed_limit, what);
    counts_.clear();
    return text;
}

int report(const Error& error) {
    fmt::print(stderr, "error: {} [{}]\n", error.message, error.code);
    const auto is = [&](const char* code) { return error.code == code; };
    for (const char* code :
         {"bad-gain", "bad-matte", "unknown-name", "matte-layer", "matte-name", "matte-channel",
          "bad-output", "bad-target", "bad-frames", "no-frame", "unknown-space", "unknown-view",
          "files-differ", "export-sequence", "export-several", "overwrites-input"}) {
        if (is(code)) return usage;
    }
    if (is("closure-failed") || is("verify-failed") || is("not-finite") || is("proof-failed"))
        return check_failed;
    return is("merge-refused") ? refused : failed;
}

namespace {

RepeatedWarnings& warnings_of_command() {
    static RepeatedWarnings warnings;
    return warnings;
}

}  // namespace

void warn(const std::string& message) {
    if (warnings_of_command().can_print(message)) fmt::print(stderr, "warning: {}\n", message);
}

void end_warnings() {
    fmt::print(stderr, "{}", warnings_of_command().take_summary());
}

}  // namespace velatura::compositor::cli
