// SPDX-License-Identifier: Apache-2.0
#include "base/frames.h"

#include "base/characters.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <set>
#include <system_error>

namespace velatura {

namespace {

namespace fs = std::filesystem;

constexpr size_t max_frames = 1'000'000;
constexpr double largest_frame = 1e7;
constexpr int max_digits = 32;

bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

/// "" for no character.
char char_at(std::string_view text, size_t i) {
    return i < text.size() ? text[i] : '\0';
}

bool is_there(const std::string& path) {
    std::error_code failed;
    return fs::exists(path, failed);
}

/// What stands for a frame number.
struct Marker {
    size_t length = 0;
    int digits = 1;
    bool is_plain = false;  ///< nobody calls a file like that by chance
};

/// Digits from `i` on as the width of a number; 0 where there are none, none if there are too many.
std::optional<int> width_at(std::string_view text, size_t i, size_t& end) {
    end = i;
    while (is_digit(char_at(text, end))) ++end;
    if (end == i) return 0;
    int width = 0;
    const auto parsed = std::from_chars(text.data() + i, text.data() + end, width);
    if (parsed.ec != std::errc() || width > max_digits) return std::nullopt;
    return width;
}

std::optional<Marker> marker_at(std::string_view text, size_t i) {
    size_t end = i;
    if (text[i] == '#') {
        end = std::min(text.find_first_not_of('#', i), text.size());
        const size_t count = end - i;
        if (count > size_t(max_digits) || (count == 1 && is_digit(char_at(text, end))))
            return std::nullopt;
        return Marker{count, int(count), count > 1};
    }
    if (text[i] == '%') {
        const auto width = width_at(text, i + 1, end);
        if (!width || char_at(text, end) != 'd' || is_letter(char_at(text, end + 1)))
            return std::nullopt;
        return Marker{end + 1 - i, std::max(*width, 1), *width > 0};
    }
    const bool is_bracketed = text[i] == '<';
    if ((text[i] != '$' && !is_bracketed) || char_at(text, i + 1) != 'F') return std::nullopt;
    const auto width = width_at(text, i + 2, end);
    if (!width) return std::nullopt;
    if (is_bracketed) {
        if (char_at(text, end) != '>') return std::nullopt;
        return Marker{end + 1 - i, std::max(*width, 1), true};
    }
    if (*width == 0 && (is_letter(char_at(text, end)) || char_at(text, end) == '_'))
        return std::nullopt;
    return Marker{end - i, std::max(*width, 1), *width > 0};
}

/// A path with the places of its frame number, ascending.
struct Pattern {
    std::vector<size_t> places;
    Marker marker;
};

/// The last marker from `begin` to `end`. Folders are called anything: theirs must be plain.
std::optional<size_t> last_marker(std::string_view path, size_t begin, size_t end) {
    std::optional<size_t> last;
    for (size_t i = begin; i < end;) {
        const auto marker = marker_at(path, i);
        if (marker && (marker->is_plain || end == path.size())) last = i;
        i += marker ? marker->length : 1;
    }
    return last;
}

std::optional<Pattern> find_pattern(const std::string& path) {
    // Parts of the path between slashes; folders that are there are called what they are called
    struct Part {
        size_t begin, end;
    };

    std::vector<Part> parts;
    for (size_t begin = 0; begin <= path.size();) {
        const size_t end = std::min(path.find('/', begin), path.size());
        const bool is_file = end == path.size();
        if (is_file || path.find_first_of("#%$<", begin) < end)
            if (is_file || !is_there(path.substr(0, end))) parts.push_back({begin, end});
        begin = end + 1;
    }
    Pattern pattern;
    std::string_view text;
    for (size_t p = parts.size(); p-- > 0 && text.empty();) {
        const auto last = last_marker(path, parts[p].begin, parts[p].end);
        if (!last) continue;
        pattern.marker = *marker_at(path, *last);
        text = std::string_view(path).substr(*last, pattern.marker.length);
    }
    if (text.empty()) return std::nullopt;
    for (const Part& part : parts) {
        for (size_t i = part.begin; i < part.end;) {
            const auto marker = marker_at(path, i);
            if (marker && std::string_view(path).substr(i, marker->length) == text)
                pattern.places.push_back(i);
            i += marker ? marker->length : 1;
        }
    }
    return pattern;
}

std::string filled(const std::string& path, const Pattern& pattern, const std::string& number) {
    std::string out;
    size_t done = 0;
    for (const size_t place : pattern.places) {
        out += path.substr(done, place - done) + number;
        done = place + pattern.marker.length;
    }
    return out + path.substr(done);
}

/// As printf does: a sign is one of the digits.
std::string number_text(double frame, int digits) {
    if (frame == std::floor(frame)) return fmt::format("{:0{}}", int64_t(frame), digits);
    return fmt::format("{:0{}.3f}", frame, digits + 4);
}

/// As Blender does: a sign stands before the digits.
std::string signed_text(int frame, int digits) {
    return fmt::format("{}{:0{}}", frame < 0 ? "-" : "", std::abs(frame), digits);
}

std::vector<int> frames_of_pattern(const std::string& path, const Pattern& pattern) {
    const size_t place = pattern.places.front();
    const size_t slash = place == 0 ? std::string::npos : path.rfind('/', place - 1);
    const size_t begin = slash == std::string::npos ? 0 : slash + 1;
    const std::string folder = begin == 0 ? "." : path.substr(0, begin);
    const std::string before = path.substr(begin, place - begin);
    std::set<int> frames;
    std::error_code failed;
    for (fs::directory_iterator file(folder, failed), end; !failed && file != end;
         file.increment(failed)) {
        const std::string name = file->path().filename().string();
        if (!name.starts_with(before)) continue;
        // The number may be followed by digits that belong to the name
        const char* const digits = name.data() + before.size();
        const size_t sign = *digits == '-' ? 1 : 0;
        for (size_t length = sign + 1; is_digit(digits[length - 1]); ++length) {
            int frame = 0;
            if (std::from_chars(digits, digits + length, frame).ec != std::errc() ||
                std::abs(double(frame)) > largest_frame)
                break;
            for (const std::string& number : {number_text(frame, pattern.marker.digits),
                                              signed_text(frame, pattern.marker.digits)}) {
                const std::string whole = filled(path, pattern, number);
                // A number with other zeros before it is another sequence
                const size_t name_end = std::min(whole.find('/', begin), whole.size());
                if (whole.substr(begin, name_end - begin) != name) continue;
                if (name_end == whole.size() || is_there(whole)) frames.insert(frame);
            }
        }
    }
    return {frames.begin(), frames.end()};
}

/// Of a path that stands for many files.
std::optional<Pattern> sequence_pattern(const std::string& path) {
    auto pattern = find_pattern(path);
    if (!pattern || !is_there(path)) return pattern;
    if (!pattern->marker.is_plain || frames_of_pattern(path, *pattern).empty()) return std::nullopt;
    return pattern;
}

std::optional<double> frame_number(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
        return std::nullopt;
    return value;
}

Error frames_error(std::string_view text) {
    return {"bad-frames",
            fmt::format("invalid frames \"{}\"; expected a list such as 1-10x2,15", text)};
}

}  // namespace

Result<std::vector<double>> parse_frames(std::string_view text) {
    std::vector<double> frames;
    size_t begin = 0;
    while (begin <= text.size()) {
        const size_t comma = std::min(text.find(',', begin), text.size());
        const std::string_view part = text.substr(begin, comma - begin);
        begin = comma + 1;
        // Between first and last; not the sign of the first
        const size_t dash = part.empty() ? std::string_view::npos : part.find('-', 1);
        if (dash == std::string_view::npos) {
            const auto frame = frame_number(part);
            if (!frame) return frames_error(text);
            frames.push_back(*frame);
            continue;
        }
        const size_t x = std::min(part.find('x', dash), part.size());
        const auto first = frame_number(part.substr(0, dash));
        const auto last = frame_number(part.substr(dash + 1, x - dash - 1));
        const auto step =
            x < part.size() ? frame_number(part.substr(x + 1)) : std::optional<double>(1.0);
        if (!first || !last || !step || *step <= 0.0) return frames_error(text);
        const double direction = *last >= *first ? *step : -*step;
        const double count = std::floor((*last - *first) / direction + 1e-9) + 1.0;
        if (count + double(frames.size()) > double(max_frames)) return frames_error(text);
        for (double i = 0; i < count; ++i) frames.push_back(*first + i * direction);
    }
    std::set<double> seen;
    std::erase_if(frames, [&](double frame) { return !seen.insert(frame).second; });
    return frames;
}

Result<std::vector<int>> parse_whole_frames(std::string_view text) {
    const auto frames = parse_frames(text);
    if (!frames) return frames.error();
    std::set<int> whole;
    for (const double frame : *frames) {
        if (frame != std::floor(frame) || std::abs(frame) > largest_frame)
            return Error{"bad-frames",
                         fmt::format("invalid frames \"{}\"; expected whole numbers up to {:.0f}",
                                     text, largest_frame)};
        whole.insert(int(frame));
    }
    return std::vector<int>(whole.begin(), whole.end());
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

bool is_sequence(const std::string& path) {
    return sequence_pattern(path).has_value();
}

bool is_plainly_sequence(const std::string& path) {
    const auto pattern = sequence_pattern(path);
    return pattern && pattern->marker.is_plain;
}

std::optional<int> frame_in_name(const std::string& path) {
    const std::string name = fs::path(path).stem().string();
    const size_t end = name.find_last_of("0123456789") + 1;
    if (end == 0) return std::nullopt;
    size_t begin = end;
    while (begin > 0 && is_digit(name[begin - 1])) --begin;
    // A dash after a letter or digit joins words
    if (begin > 1 && name[begin - 1] == '-' && (name[begin - 2] == '.' || name[begin - 2] == '_'))
        --begin;
    int frame = 0;
    const auto parsed = std::from_chars(name.data() + begin, name.data() + end, frame);
    if (parsed.ec != std::errc() || std::abs(double(frame)) > largest_frame) return std::nullopt;
    return frame;
}

std::string frame_path(const std::string& path, double frame) {
    const auto pattern = sequence_pattern(path);
    return pattern ? filled(path, *pattern, number_text(frame, pattern->marker.digits)) : path;
}

std::vector<int> frames_on_disk(const std::string& path) {
    const auto pattern = sequence_pattern(path);
    return pattern ? frames_of_pattern(path, *pattern) : std::vector<int>();
}

std::string frame_file(const std::string& path, int frame) {
    const auto pattern = sequence_pattern(path);
    if (!pattern) return path;
    const std::string usual = filled(path, *pattern, number_text(frame, pattern->marker.digits));
    if (frame >= 0 || is_there(usual)) return usual;
    std::string other = filled(path, *pattern, signed_text(frame, pattern->marker.digits));
    return is_there(other) ? other : usual;
}

std::vector<std::string> files_of(const std::string& path) {
    const auto pattern = sequence_pattern(path);
    if (!pattern) return {path};
    std::vector<std::string> files;
    for (const int frame : frames_of_pattern(path, *pattern))
        files.push_back(frame_file(path, frame));
    return files;
}

std::string with_hashes(const std::string& path) {
    const auto pattern = sequence_pattern(path);
    return pattern ? filled(path, *pattern, std::string(size_t(pattern->marker.digits), '#'))
                   : path;
}

}  // namespace velatura
