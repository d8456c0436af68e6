// SPDX-License-Identifier: Apache-2.0
#include "layers/matte_manifest.h"

#include "base/atomic_file.h"
#include "base/json_depth.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>

namespace velatura::layers {

namespace {

constexpr size_t longest_manifest = size_t(256) << 20;  // bytes

std::optional<uint32_t> id_of(std::string_view hex) {
    uint32_t id = 0;
    const auto [end, error] = std::from_chars(hex.data(), hex.data() + hex.size(), id, 16);
    const bool is_whole = error == std::errc() && end == hex.data() + hex.size() && hex.size() <= 8;
    return is_whole ? std::optional(id) : std::nullopt;
}

bool read_json(std::string_view text, Manifest& manifest) {
    // Deep nesting takes stack, and no manifest has any
    if (is_json_too_deep(std::string(text))) return false;
    const auto j = nlohmann::json::parse(text, nullptr, false);
    if (!j.is_object()) return false;
    size_t bad = 0;
    for (const auto& [name, value] : j.items()) {
        const auto id = value.is_string() ? id_of(value.get_ref<const std::string&>())
                                          : std::optional<uint32_t>();
        if (id) manifest.names.push_back({name, *id});
        bad += size_t(!id);
    }
    if (bad > 0) manifest.fault = fmt::format("{} of its names have no id of 8 hex digits", bad);
    return true;
}

size_t past_spaces(std::string_view text, size_t at) {
    return std::min(text.find_first_not_of(" \t\r\n", at), text.size());
}

/// A quote that ends a name is followed by `:"id"` and `,`, `}` or nothing.
struct NameEnd {
    uint32_t id = 0;
    size_t next = 0;  ///< behind the entry
};

std::optional<NameEnd> end_of_name(std::string_view text, size_t quote) {
    size_t at = past_spaces(text, quote + 1);
    if (at == text.size() || text[at] != ':') return std::nullopt;
    at = past_spaces(text, at + 1);
    if (at == text.size() || text[at] != '"') return std::nullopt;
    const size_t end = text.find('"', at + 1);
    if (end == std::string_view::npos || end - at > 9) return std::nullopt;
    const auto id = id_of(text.substr(at + 1, end - at - 1));
    at = past_spaces(text, end + 1);
    const bool is_over = at == text.size() || text[at] == ',' || text[at] == '}';
    if (!id || !is_over) return std::nullopt;
    return NameEnd{*id, at};
}

/// Without backslashes before quotes and backslashes.
std::string unescaped(std::string_view text) {
    std::string plain;
    for (size_t i = 0; i < text.size(); ++i) {
        const bool is_escape =
            text[i] == '\\' && i + 1 < text.size() && (text[i + 1] == '"' || text[i + 1] == '\\');
        plain += text[is_escape ? ++i : i];
    }
    return plain;
}

void read_loosely(std::string_view text, Manifest& manifest) {
    for (size_t begin = text.find('"'); begin != std::string_view::npos;) {
        std::optional<NameEnd> end;
        size_t quote = begin;
        while (!end) {
            quote = text.find('"', quote + 1);
            if (quote == std::string_view::npos) return;
            end = end_of_name(text, quote);
        }
        const std::string raw(text.substr(begin + 1, quote - begin - 1));
        const std::string plain = unescaped(raw);
        manifest.names.push_back({matte_id(plain) == end->id ? plain : raw, end->id});
        begin = text.find('"', end->next);
    }
}

std::ptrdiff_t hashes_that_fit(const Manifest& manifest) {
    return std::count_if(manifest.names.begin(), manifest.names.end(),
                         [](const MatteName& n) { return matte_id(n.name) == n.id; });
}

}  // namespace

Manifest read_manifest(std::string_view text) {
    Manifest manifest;
    if (text.empty()) {
        manifest.fault = "there is none";
        return manifest;
    }
    if (read_json(text, manifest)) {
        // Backslashes that are no escapes, of names that nobody escaped: the hashes tell
        Manifest loose;
        if (text.find('\\') != std::string_view::npos) read_loosely(text, loose);
        if (hashes_that_fit(loose) > hashes_that_fit(manifest)) manifest.names = loose.names;
        return manifest;
    }
    read_loosely(text, manifest);
    manifest.fault =
        manifest.names.empty()
            ? std::string("it cannot be read")
            : fmt::format("it is not valid JSON; {} names were read", manifest.names.size());
    return manifest;
}

Manifest read_manifest_file(const std::string& image_path, const std::string& name) {
    namespace fs = std::filesystem;
    const fs::path file(name);
    const bool leaves_folder =
        file.is_absolute() ||
        std::any_of(file.begin(), file.end(), [](const fs::path& p) { return p == ".."; });
    Manifest manifest;
    if (leaves_folder) {
        manifest.fault = fmt::format("{} is not below the folder of the image", name);
        return manifest;
    }
    const auto text =
        read_file((fs::path(image_path).parent_path() / file).string(), longest_manifest);
    if (text) {
        manifest = read_manifest(*text);
        if (!manifest.fault.empty()) manifest.fault = name + ": " + manifest.fault;
    } else {
        manifest.fault = text.error().message;
    }
    return manifest;
}

}  // namespace velatura::layers
