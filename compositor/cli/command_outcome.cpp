// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"

#include <fmt/format.h>

#include <cstdio>

namespace velatura::compositor::cli {

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

void warn(const std::string& message) {
    fmt::print(stderr, "warning: {}\n", message);
}

}  // namespace velatura::compositor::cli
