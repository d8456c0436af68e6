// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/stereo_views.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstring>

namespace velatura::compositor {
inline namespace io {

namespace {

std::string view_of(const image::Attributes& attributes) {
    const auto at = attributes.find("view");
    const auto* view = at == attributes.end() ? nullptr : std::get_if<std::string>(&at->second);
    return view ? *view : std::string();
}

/// Of a list of strings as EXR stores it: a length before each.
std::vector<std::string> strings_of(const image::Attributes& attributes, const char* name) {
    std::vector<std::string> strings;
    const auto at = attributes.find(name);
    const auto* list =
        at == attributes.end() ? nullptr : std::get_if<image::OtherAttribute>(&at->second);
    if (!list || list->type != "stringvector") return strings;
    size_t i = 0;
    while (i + 4 <= list->bytes.size()) {
        int32_t length = 0;
        std::memcpy(&length, list->bytes.data() + i, 4);
        i += 4;
        if (length < 0 || size_t(length) > list->bytes.size() - i) break;
        strings.push_back(list->bytes.substr(i, size_t(length)));
        i += size_t(length);
    }
    return strings;
}

std::string lower(std::string text) {
    for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

bool has_bare_channel(const image::Part& part) {
    return std::any_of(part.channels.begin(), part.channels.end(), [](const image::Channel& c) {
        return c.name.find('.') == std::string::npos && (c.name == "R" || c.name == "Y");
    });
}

/// Parts by whose names alone they are the eyes: nothing else in the file has bare colors.
std::vector<std::string> views_by_part_names(const image::Image& image) {
    std::vector<std::string> views(image.parts.size());
    bool has_left = false, has_right = false;
    for (size_t p = 0; p < image.parts.size(); ++p) {
        const std::string name = lower(image.parts[p].name);
        const bool is_eye = name == "left" || name == "right";
        if (!is_eye && has_bare_channel(image.parts[p])) return {};
        if (!is_eye) continue;
        views[p] = image.parts[p].name;
        has_left = has_left || name == "left";
        has_right = has_right || name == "right";
    }
    if (!has_left || !has_right) return {};
    return views;
}

void add_once(std::vector<std::string>& names, const std::string& name) {
    if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end())
        names.push_back(name);
}

}  // namespace

Result<StereoViews> StereoViews::of(const image::Image& image, const std::string& asked) {
    StereoViews views;
    std::vector<std::string> of_parts;
    for (size_t p = 0; p < image.parts.size(); ++p) {
        std::string view = view_of(image.parts[p].attributes);
        // The attributes of the first part are those of the image
        if (view.empty() && p == 0) view = view_of(image.attributes);
        of_parts.push_back(std::move(view));
    }
    for (const std::string& view : of_parts) add_once(views.names_, view);
    if (views.names_.size() < 2) {
        views.names_.clear();
        of_parts = views_by_part_names(image);
        for (const std::string& view : of_parts) add_once(views.names_, view);
    }
    if (views.names_.empty()) {
        for (const std::string& view : strings_of(image.attributes, "multiView"))
            add_once(views.names_, view);
        views.has_prefixes_ = views.names_.size() > 1;
        if (!views.has_prefixes_) views.names_.clear();
    }
    views.is_other_.assign(image.parts.size(), false);
    if (views.names_.empty()) {
        if (asked.empty()) return views;
        return Error{"unknown-view", fmt::format("no view '{}': the file has only one", asked)};
    }
    const auto at = asked.empty() ? views.names_.begin()
                                  : std::find(views.names_.begin(), views.names_.end(), asked);
    if (at == views.names_.end())
        return Error{"unknown-view", fmt::format("no view '{}'; the file has {}", asked,
                                                 fmt::join(views.names_, " "))};
    views.chosen_ = *at;
    for (size_t p = 0; p < of_parts.size(); ++p)
        views.is_other_[p] = !of_parts[p].empty() && of_parts[p] != views.chosen_;
    return views;
}

std::string StereoViews::part_name(const image::Part& part) const {
    const std::string& name = part.name;
    if (chosen_.empty() || has_prefixes_ || !name.ends_with(chosen_)) return name;
    if (name == chosen_) return "";
    const char before = name[name.size() - chosen_.size() - 1];
    const bool is_apart = before == '.' || before == '_' || before == ' ' || before == '-';
    return is_apart ? name.substr(0, name.size() - chosen_.size() - 1) : name;
}

/// The view is the word before the channel or, as some write it, the first.
StereoViews::Split StereoViews::split(const std::string& channel) const {
    const size_t last = channel.rfind('.');
    if (last == std::string::npos) return {names_.front(), channel};
    const auto is_view = [this](const std::string& word) {
        return std::find(names_.begin(), names_.end(), word) != names_.end();
    };
    const size_t before = last == 0 ? std::string::npos : channel.rfind('.', last - 1);
    const size_t begin = before == std::string::npos ? 0 : before + 1;
    const std::string word = channel.substr(begin, last - begin);
    if (is_view(word)) return {word, channel.substr(0, begin) + channel.substr(last + 1)};
    const size_t first = channel.find('.');
    if (is_view(channel.substr(0, first)))
        return {channel.substr(0, first), channel.substr(first + 1)};
    return {"", channel};
}

std::optional<std::string> StereoViews::channel_name(const image::Part& part,
                                                     const std::string& channel) const {
    if (!has_prefixes_) return channel;
    const Split own = split(channel);
    if (own.view == chosen_) return own.name;
    if (!own.view.empty()) return std::nullopt;
    // Of all views, unless the one that is read has its own
    const bool has_own =
        std::any_of(part.channels.begin(), part.channels.end(), [&](const image::Channel& c) {
            const Split other = split(c.name);
            return other.view == chosen_ && other.name == own.name;
        });
    return has_own ? std::nullopt : std::optional(channel);
}

}  // namespace io
}  // namespace velatura::compositor
