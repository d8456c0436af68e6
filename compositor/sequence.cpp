// SPDX-License-Identifier: Apache-2.0
#include "compositor/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>

namespace velatura::compositor {

namespace {

namespace fs = std::filesystem;

constexpr int largest_frame = 10'000'000;
constexpr size_t most_frames = 1'000'000;

/// A pattern's file name around the frame number.
struct Pattern {
    std::string before, after;
    int digits = 1;
};

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

std::optional<Pattern> parse_pattern(const std::string& path) {
    // The number stands in the name of the file, a folder may be called anything
    const size_t name = path.rfind('/') == std::string::npos ? 0 : path.rfind('/') + 1;
    if (const size_t hash = path.find('#', name); hash != std::string::npos) {
        const size_t end = std::min(path.find_first_not_of('#', hash), path.size());
        return Pattern{path.substr(0, hash), path.substr(end), int(end - hash)};
    }
    const size_t percent = path.find('%', name);
    if (percent == std::string::npos) return std::nullopt;
    size_t end = percent + 1;
    while (end < path.size() && is_digit(path[end]) && end - percent <= 3) ++end;
    if (end == path.size() || path[end] != 'd') return std::nullopt;
    int digits = 1;
    std::from_chars(path.data() + percent + 1, path.data() + end, digits);
    return Pattern{path.substr(0, percent), path.substr(end + 1), std::max(digits, 1)};
}

std::optional<int> parse_frame(std::string_view text) {
    int frame = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), frame);
    const bool is_good = error == std::errc() && end == text.data() + text.size() && frame >= 0 &&
                         frame <= largest_frame;
    return is_good ? std::optional(frame) : std::nullopt;
}

/// `1-100x2`.
bool add_range(std::string_view text, std::set<int>& frames) {
    int step = 1;
    if (const size_t x = text.find('x'); x != std::string_view::npos) {
        const auto parsed = parse_frame(text.substr(x + 1));
        if (!parsed || *parsed == 0) return false;
        step = *parsed;
        text = text.substr(0, x);
    }
    const size_t dash = text.find('-');
    const auto first = parse_frame(text.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : parse_frame(text.substr(dash + 1));
    if (!first || !last || *last < *first) return false;
    if (size_t(*last - *first) / size_t(step) >= most_frames) return false;
    for (int f = *first; f <= *last; f += step) frames.insert(f);
    return true;
}

}  // namespace

bool is_sequence(const std::string& path) {
    return parse_pattern(path).has_value();
}

std::string frame_path(const std::string& pattern, int frame) {
    const auto parsed = parse_pattern(pattern);
    if (!parsed) return pattern;
    return fmt::format("{}{:0{}}{}", parsed->before, frame, parsed->digits, parsed->after);
}

std::vector<int> frames_on_disk(const std::string& pattern) {
    std::vector<int> frames;
    const fs::path folder = fs::path(pattern).parent_path();
    std::error_code error;
    fs::directory_iterator files(folder.empty() ? fs::path(".") : folder, error);
    if (error) return frames;
    const auto parsed = parse_pattern(fs::path(pattern).filename().string());
    if (!parsed) return frames;
    for (const fs::directory_entry& entry : files) {
        const std::string name = entry.path().filename().string();
        const size_t around = parsed->before.size() + parsed->after.size();
        if (name.size() <= around || !name.starts_with(parsed->before) ||
            !name.ends_with(parsed->after))
            continue;
        const auto frame =
            parse_frame(std::string_view(name).substr(parsed->before.size(), name.size() - around));
        // A number with other zeros before it is another sequence
        if (frame &&
            frame_path(parsed->before + std::string(size_t(parsed->digits), '#') + parsed->after,
                       *frame) == name)
            frames.push_back(*frame);
    }
    std::sort(frames.begin(), frames.end());
    return frames;
}

Result<std::vector<int>> parse_frames(const std::string& text) {
    std::set<int> frames;
    std::string_view rest = text;
    for (;;) {
        const size_t comma = rest.find(',');
        if (!add_range(rest.substr(0, comma), frames))
            return Error{"bad-frames",
                         fmt::format("'{}' is no list of frames; expected 1-100x2 or 1,5,9", text)};
        if (comma == std::string_view::npos) break;
        rest.remove_prefix(comma + 1);
    }
    return std::vector<int>(frames.begin(), frames.end());
}

std::string frame_list(const std::vector<int>& frames) {
    std::string text;
    for (size_t i = 0; i < frames.size();) {
        size_t last = i;
        while (last + 1 < frames.size() && frames[last + 1] == frames[last] + 1) ++last;
        if (!text.empty()) text += ",";
        text += last == i ? fmt::format("{}", frames[i])
                          : fmt::format("{}-{}", frames[i], frames[last]);
        i = last + 1;
    }
    return text;
}

}  // namespace velatura::compositor
