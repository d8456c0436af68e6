// SPDX-License-Identifier: Apache-2.0
#include "app/parse_values.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <string>

namespace velatura::app {

namespace {

template <class T>
std::optional<T> number(std::string_view text) {
    T value{};
    const auto [end, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (ec != std::errc() || end != text.data() + text.size()) return std::nullopt;
    if constexpr (std::is_floating_point_v<T>) {
        if (!std::isfinite(value)) return std::nullopt;
    }
    return value;
}

}  // namespace

Result<double> parse_duration(std::string_view text) {
    const Error bad{
        "bad-duration",
        fmt::format(
            "invalid duration \"{}\"; expected seconds, or a number with s, m or h, above 0",
            text)};
    double unit = 1.0;
    std::string_view digits = text;
    if (!text.empty()) {
        const char last = text.back();
        if (last == 's' || last == 'm' || last == 'h') {
            unit = last == 's' ? 1.0 : last == 'm' ? 60.0 : 3600.0;
            digits = text.substr(0, text.size() - 1);
        }
    }
    const auto value = number<double>(digits);
    if (!value || !(*value > 0.0)) return bad;
    return *value * unit;
}

Result<std::pair<uint64_t, uint64_t>> parse_sample_range(std::string_view text) {
    const size_t colon = text.find(':');
    if (colon != std::string_view::npos) {
        const auto first = number<uint64_t>(text.substr(0, colon));
        const auto end = number<uint64_t>(text.substr(colon + 1));
        if (first && end && *first < *end && *end <= (uint64_t(1) << 32))
            return std::pair(*first, *end);
    }
    return Error{"bad-samples",
                 fmt::format("invalid sample range \"{}\"; expected A:B with A < B <= 2^32", text)};
}

Result<double> parse_fraction(std::string_view text) {
    const bool percent = !text.empty() && text.back() == '%';
    const auto value = number<double>(percent ? text.substr(0, text.size() - 1) : text);
    const double fraction = value ? (percent ? *value / 100.0 : *value) : 0.0;
    // 20 is 20 % with the sign forgotten, hardly ever 2000 %
    if (!(fraction > 0.0 && fraction < 1.0)) {
        return Error{
            "bad-fraction",
            fmt::format(
                "expected a fraction such as 1% or 0.01, above 0 and below 100%, found \"{}\"",
                text)};
    }
    return fraction;
}

Result<StoredBounces> parse_bounces(std::string_view text) {
    constexpr int max = 64;
    constexpr double usual_share = 0.01;
    const Error wrong = {"bad-bounces",
                         fmt::format("expected 0 to {}, auto or auto=1%, found \"{}\"", max, text)};
    if (!text.starts_with("auto")) {
        const std::optional<int> last = number<int>(text);
        if (!last || *last < 0 || *last > max) return wrong;
        return StoredBounces{*last, std::nullopt};
    }
    StoredBounces bounces;
    bounces.min_share = usual_share;
    const std::string_view share = text.substr(std::string_view("auto").size());
    if (share.empty()) return bounces;
    const Result<double> typed = parse_fraction(share.substr(1));
    if (share[0] != '=' || !typed || !(*typed > 0) || *typed > 1) return wrong;
    bounces.min_share = *typed;
    return bounces;
}

Result<GuardChoice> parse_guard(std::string_view text) {
    if (text == "off") return GuardChoice{};
    if (text == "auto") return GuardChoice{true, std::nullopt};
    const std::optional<uint64_t> samples = number<uint64_t>(text);
    if (!samples || *samples < 1)
        return Error{"bad-guard",
                     fmt::format("expected off, auto or samples per pixel, found \"{}\"", text)};
    return GuardChoice{true, samples};
}

Result<size_t> parse_size(std::string_view text, size_t whole) {
    const Error bad{"bad-size", fmt::format("invalid size \"{}\"; expected a number with K, M, G, "
                                            "T, KiB, MiB, GiB, TiB or %, above 0",
                                            text)};
    const size_t begin = std::min(text.find_first_not_of("0123456789.+-eE"), text.size());
    const auto value = number<double>(text.substr(0, begin));
    std::string_view unit = text.substr(begin);
    if (!value || !(*value > 0.0) || unit.empty()) return bad;
    double bytes = *value;
    if (unit == "%") {
        bytes *= double(whole) / 100.0;
    } else {
        const size_t power = std::string_view("KMGT").find(unit.front());
        unit.remove_prefix(1);
        const bool is_binary = unit == "iB";
        if (power == std::string_view::npos || !(is_binary || unit.empty() || unit == "B"))
            return bad;
        bytes *= std::pow(is_binary ? 1024.0 : 1000.0, double(power + 1));
    }
    constexpr double max = 0x1p60;
    if (!(bytes >= 1.0 && bytes < max)) return bad;
    return size_t(bytes);
}

std::vector<std::string> split(std::string_view text, char separator) {
    std::vector<std::string> parts;
    size_t begin = 0;
    while (begin <= text.size()) {
        const size_t end = std::min(text.find(separator, begin), text.size());
        parts.emplace_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return parts;
}

}  // namespace velatura::app
