// SPDX-License-Identifier: Apache-2.0
#include "app/failure_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <mutex>

namespace velatura::app {

namespace {

struct Failure {
    std::mutex mutex;
    bool is_kept = false;
    std::string message;
};

Failure& failure() {
    static Failure instance;
    return instance;
}

std::string meaning_of(int code) {
    if (code > SignalBase)
        return fmt::format("stopped by signal {}; what was finished is written", code - SignalBase);
    for (const ExitCodeInfo& info : exit_code_table)
        if (info.code == code) return std::string(info.meaning);
    return "failed";
}

}  // namespace

void keep_failures() {
    const std::lock_guard lock(failure().mutex);
    failure().is_kept = true;
}

void note_error(const std::string& message) {
    const std::lock_guard lock(failure().mutex);
    if (failure().is_kept) failure().message = message;
}

int fail(const Error& error, int code) {
    const std::string text = fmt::format("{} [{}]", error.message, error.code);
    fmt::print(stderr, "error: {}\n", text);
    note_error(text);
    return error.code == "usage" ? int(UsageError) : code;
}

void print_failure(int code) {
    const std::lock_guard lock(failure().mutex);
    if (code == Done || !failure().is_kept) return;
    std::string text =
        failure().message.empty() || code > SignalBase ? meaning_of(code) : failure().message;
    // One line is all that a scheduler reads
    std::replace(text.begin(), text.end(), '\n', ' ');
    fmt::print("openjd_fail: {} (exit code {})\n", text, code);
    std::fflush(stdout);
}

}  // namespace velatura::app
