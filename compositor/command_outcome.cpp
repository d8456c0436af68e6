// SPDX-License-Identifier: Apache-2.0
#include "compositor/command_outcome.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <initializer_list>

namespace velatura::compositor {

namespace {

bool ends_with_any(const std::string& path, std::initializer_list<const char*> extensions) {
    std::string lower = path;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return std::any_of(extensions.begin(), extensions.end(),
                       [&](const char* e) { return lower.ends_with(e); });
}

}  // namespace

int report(const Error& error) {
    fmt::print(stderr, "velatura-comp: error: {} [{}]\n", error.message, error.code);
    const auto is = [&](const char* code) { return error.code == code; };
    for (const char* code : {"bad-gain", "bad-matte", "unknown-name", "matte-layer", "matte-name",
                             "matte-channel", "bad-output", "bad-target", "bad-frames", "no-frame"}) {
        if (is(code)) return usage;
    }
    if (is("closure-failed") || is("verify-failed") || is("not-finite") || is("proof-failed")) return check_failed;
    return is("merge-refused") ? refused : failed;
}

void warn(const std::string& message) {
    fmt::print(stderr, "velatura-comp: warning: {}\n", message);
}

bool is_display_picture(const std::string& path) {
    return ends_with_any(path, {".png", ".jpg", ".jpeg"});
}

bool is_exr(const std::string& path) {
    return ends_with_any(path, {".exr"});
}

}  // namespace velatura::compositor
