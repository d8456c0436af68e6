// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/input_files.h"

#include "base/characters.h"
#include "base/frames.h"
#include "image/file_color.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

namespace velatura::compositor {
inline namespace io {

namespace {

constexpr std::string_view separators = "/._- ";

/// A name in words, each with the separator before it.
std::vector<std::string> words_of(const std::string& path) {
    std::vector<std::string> words;
    for (const char c : path) {
        const bool is_separator = separators.find(c) != std::string_view::npos;
        if (words.empty() || is_separator) words.emplace_back();
        words.back() += c;
    }
    return words;
}

/// Words that all have at the same place from the beginning or, with `from_end`, from the end,
/// after `skipped` others.
size_t shared_words(const std::vector<std::vector<std::string>>& names,
                    bool from_end,
                    size_t skipped) {
    size_t shared = 0;
    for (;; ++shared) {
        for (const auto& words : names) {
            if (shared + skipped >= words.size()) return shared;
            const auto at = [&](const std::vector<std::string>& w) {
                return from_end ? w[w.size() - 1 - shared] : w[shared];
            };
            if (at(words) != at(names[0])) return shared;
        }
    }
}

/// The colors of a file that was opened with others are those of the first.
Result<void> check_colors(const LayerStack& stack) {
    std::optional<std::string> first;
    for (const accumulate::LayerEntry& entry : stack.header().layers) {
        const auto place = stack.place(entry.name, 0);
        if (!place || entry.family == "data") continue;
        const auto color = image::color_of(stack.image(), "", place->part);
        if (!color) continue;
        if (first && *first != color->label)
            return Error{
                "files-differ",
                fmt::format("the files of one mix have different colors: {} and, in {}, {}", *first,
                            entry.name, color->label)};
        first = color->label;
    }
    return {};
}

}  // namespace

std::vector<std::string> names_of_files(const std::vector<std::string>& paths) {
    std::vector<std::vector<std::string>> words;
    for (const std::string& path : paths)
        words.push_back(words_of(std::filesystem::path(path).replace_extension().string()));
    const size_t first = shared_words(words, false, 0), last = shared_words(words, true, first);
    std::vector<std::string> names;
    for (const auto& w : words) {
        std::string name;
        for (size_t i = first; i + last < w.size(); ++i) name += w[i];
        if (!name.empty() && separators.find(name[0]) != std::string_view::npos) name.erase(0, 1);
        names.push_back(std::move(name));
    }
    if (std::count(names.begin(), names.end(), "") < 2) return names;
    for (size_t i = 0; i < paths.size(); ++i) names[i] = std::filesystem::path(paths[i]).stem();
    return names;
}

bool are_frames(const std::vector<std::string>& paths) {
    std::optional<std::string> around;
    for (const std::string& path : paths) {
        if (is_sequence(path)) return false;
        const std::string stem = std::filesystem::path(path).stem().string();
        size_t begin = stem.size();
        while (begin > 0 && is_digit(stem[begin - 1])) --begin;
        if (stem.size() - begin < 3) return false;
        std::string rest =
            (std::filesystem::path(path).parent_path() / stem.substr(0, begin)).string();
        if (around && *around != rest) return false;
        around = std::move(rest);
    }
    return paths.size() > 1;
}

Result<InputFile> open_input(const std::vector<std::string>& paths,
                             const std::string& view,
                             const std::string& input_space) {
    if (paths.size() == 1) {
        auto file = layers::StripReader::open(paths[0]);
        if (!file) return file.error();
        auto layout = LayerStack::describe(*file, paths[0], ForeignFiles::Plain, view);
        if (!layout) return layout.error();
        return InputFile{std::move(*file), std::move(*layout)};
    }
    auto files = layers::StripReader::open_together(paths);
    if (!files) return files.error();
    auto layout = LayerStack::describe_together(*files, names_of_files(paths), view);
    if (!layout) return layout.error();
    if (input_space.empty()) {
        if (auto same = check_colors(*layout); !same) return same.error();
    }
    return InputFile{std::move(*files), std::move(*layout)};
}

Result<LayerStack> load_input(const std::vector<std::string>& paths, const std::string& view) {
    auto input = open_input(paths, view);
    if (!input) return input.error();
    auto image = input->file.read_all();
    if (!image) return image.error();
    return std::move(input->layout).with_pixels(std::move(*image));
}

}  // namespace io
}  // namespace velatura::compositor
