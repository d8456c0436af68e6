// SPDX-License-Identifier: Apache-2.0
#include "app/limit_options.h"

#include "app/parse_values.h"
#include "base/nearest_names.h"
#include "base/process/memory_limit.h"
#include "base/result.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::app {

namespace {

using LimitValue = Result<void> (*)(Limits& limits, const std::string& text);

Result<size_t> parse_count(const std::string& text) {
    double count = 0;
    const char* const end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), end, count);
    constexpr double max = 1e18;
    if (parsed.ec != std::errc() || parsed.ptr != end || !(count >= 1 && count <= max) ||
        count != std::floor(count))
        return Error{
            "usage",
            fmt::format("expected a whole number such as 2000 or 1e6, found \"{}\"", text)};
    return size_t(count);
}

template <class T>
Result<void> set_to(T& value,
                    const Result<size_t>& parsed,
                    size_t max = std::numeric_limits<size_t>::max()) {
    if (!parsed) return parsed.error();
    if (*parsed > max)
        return Error{"usage", fmt::format("{} is above the maximum of {}", *parsed, max)};
    value = T(*parsed);
    return {};
}

/// A limit is one line here and one member of Limits.
struct LimitOption {
    std::string_view name, meaning;
    LimitValue set;
};

constexpr LimitOption limit_options[] = {
    {"prims", "of the stage, 2e7",
     [](Limits& l, const std::string& t) { return set_to(l.prims, parse_count(t)); }},
    {"prims-per-spec", "composed prims per authored one, 1000",
     [](Limits& l, const std::string& t) { return set_to(l.prims_per_spec, parse_count(t)); }},
    {"layers", "opened, 1e5",
     [](Limits& l, const std::string& t) { return set_to(l.layers, parse_count(t)); }},
    {"array-bytes", "compressed arrays of .usdc, 1GiB",
     [](Limits& l, const std::string& t) {
         return set_to(l.array_bytes, parse_size(t, machine_bytes()));
     }},
    {"image-side", "texture width and height, 1048576",
     [](Limits& l, const std::string& t) {
         return set_to(l.image_side, parse_count(t), size_t(1) << 28);
     }},
    {"decode-time", "CPU time of one request to a decoder process (--sandbox), 60s",
     [](Limits& l, const std::string& t) -> Result<void> {
         const Result<double> seconds = parse_duration(t);
         if (!seconds) return seconds.error();
         l.decoding.seconds = *seconds;
         return {};
     }},
    {"decode-memory", "of an image decoder, 8GiB",
     [](Limits& l, const std::string& t) {
         return set_to(l.decoding.bytes, parse_size(t, machine_bytes()));
     }},
};

/// A former name.
constexpr std::string_view former_image_side = "picture-side=";

Result<void> set_limit(Limits& limits, std::string text) {
    if (text.starts_with(former_image_side))
        text.replace(0, former_image_side.size(), "image-side=");
    const size_t at = text.find('=');
    if (at == std::string::npos)
        return Error{"usage", fmt::format("expected NAME=VALUE, found \"{}\"", text)};
    for (const LimitOption& option : limit_options)
        if (text.substr(0, at) == option.name) return option.set(limits, text.substr(at + 1));
    std::string names;
    std::vector<std::string> known;
    for (const LimitOption& option : limit_options) {
        known.emplace_back(option.name);
        names += fmt::format("{}{}", names.empty() ? "" : ", ", option.name);
    }
    return Error{"usage",
                 fmt::format("unknown limit \"{}\"{}; expected one of {}", text.substr(0, at),
                             did_you_mean(text.substr(0, at), known), names)};
}

}  // namespace

void add_limit_option(Command& command, Limits& limits) {
    std::string meanings;
    for (const LimitOption& option : limit_options)
        meanings +=
            fmt::format("{}{} ({})", meanings.empty() ? "" : ", ", option.name, option.meaning);
    const auto set = [&limits](const std::string& text) {
        const Result<void> done = set_limit(limits, text);
        return done ? std::string() : done.error().message;
    };
    command.add_option("--limit", "Limit of what the scene's files can request: " + meanings)
        .type_name("NAME=VALUE")
        .expected(1)
        .take_all()
        .check(set);
}

}  // namespace velatura::app
