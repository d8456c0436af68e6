// SPDX-License-Identifier: Apache-2.0
#include "layers/cryptomatte.h"

#include "base/nearest_names.h"
#include "layers/matte_manifest.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <map>

namespace velatura::layers {

namespace {

constexpr std::string_view prefix = "cryptomatte/";

/// Spellings of a channel's last part: OpenEXR's own, and those of other renderers.
constexpr std::array<std::array<std::string_view, 3>, 4> channel_names = {
    {{"R", "r", "red"}, {"G", "g", "green"}, {"B", "b", "blue"}, {"A", "a", "alpha"}}};

/// A backslash before * ? or another one takes it as it is.
bool is_escape(std::string_view pattern, size_t p) {
    return pattern[p] == '\\' && p + 1 < pattern.size() &&
           (pattern[p + 1] == '*' || pattern[p + 1] == '?' || pattern[p + 1] == '\\');
}

/// Whether the whole text is what the pattern says. Linear in text times stars.
bool is_match(std::string_view text, std::string_view pattern) {
    size_t t = 0, p = 0, star = std::string_view::npos, after_star = 0;
    while (t < text.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++;
            after_star = t;
        } else if (p < pattern.size() && is_escape(pattern, p)
                       ? pattern[p + 1] == text[t]
                       : p < pattern.size() && (pattern[p] == '?' || pattern[p] == text[t])) {
            p += is_escape(pattern, p) ? 2 : 1;
            ++t;
        } else if (star != std::string_view::npos) {
            p = star + 1;
            t = ++after_star;
        } else {
            return false;
        }
    }
    while (p < pattern.size() && pattern[p] == '*') ++p;
    return p == pattern.size();
}

/// The name itself, or a path above it.
bool is_chosen(std::string_view name, std::string_view pattern) {
    if (is_match(name, pattern)) return true;
    for (size_t end = name.rfind('/'); end != 0 && end != std::string_view::npos;
         end = name.rfind('/', end - 1)) {
        if (is_match(name.substr(0, end), pattern)) return true;
    }
    return false;
}

Error unknown_name(const Cryptomatte& matte, const std::string& pattern) {
    std::vector<std::string> names, leaves;
    for (const MatteName& n : matte.names) {
        names.push_back(n.name);
        leaves.push_back("*/" + n.name.substr(n.name.rfind('/') + 1));
    }
    // The last part of a path is what people remember
    std::string hint = did_you_mean(pattern, names);
    if (hint.empty()) hint = did_you_mean("*/" + pattern, leaves);
    return {"matte-name", fmt::format("{} has no name \"{}\"{}", matte.layer, pattern, hint)};
}

void read_strings(const image::Attributes& attributes,
                  std::map<std::string, std::map<std::string, std::string>>& by_key) {
    for (const auto& [name, attribute] : attributes) {
        const auto* text = std::get_if<std::string>(&attribute);
        const size_t end = name.find('/', prefix.size());
        if (!text || !name.starts_with(prefix) || end == std::string::npos) continue;
        by_key[name.substr(prefix.size(), end - prefix.size())][name.substr(end + 1)] = *text;
    }
}

const std::vector<float>* find_floats(const image::Image& image,
                                      const std::string& layer,
                                      std::span<const std::string_view> spellings) {
    for (const std::string_view s : spellings) {
        const image::Channel* channel = image.find(fmt::format("{}.{}", layer, s));
        if (channel) return std::get_if<std::vector<float>>(&channel->data);
    }
    return nullptr;
}

}  // namespace

std::string plain_matte_name(std::string_view layer) {
    std::string name;
    for (const char c : layer.substr(layer.rfind('.') + 1)) {
        if (c != '_') name += char(std::tolower(static_cast<unsigned char>(c)));
    }
    return name;
}

uint32_t murmur_hash_3(std::string_view text, uint32_t seed) {
    const auto mixed = [](uint32_t k) { return std::rotl(k * 0xcc9e2d51u, 15) * 0x1b873593u; };
    const auto byte = [text](size_t i) { return uint32_t(uint8_t(text[i])); };
    uint32_t h = seed;
    const size_t whole = text.size() / 4 * 4;
    for (size_t i = 0; i < whole; i += 4) {
        h ^= mixed(byte(i) | byte(i + 1) << 8 | byte(i + 2) << 16 | byte(i + 3) << 24);
        h = std::rotl(h, 13) * 5 + 0xe6546b64u;
    }
    uint32_t rest = 0;
    for (size_t i = text.size(); i > whole; --i) rest = rest << 8 | byte(i - 1);
    h ^= mixed(rest);
    h ^= uint32_t(text.size());
    // Let every bit change every other
    h = (h ^ h >> 16) * 0x85ebca6bu;
    h = (h ^ h >> 13) * 0xc2b2ae35u;
    return h ^ h >> 16;
}

uint32_t matte_id(std::string_view name) {
    const uint32_t hash = murmur_hash_3(name);
    const uint32_t exponent = std::clamp(hash >> 23 & 255u, 1u, 254u);
    return (hash & 0x807fffffu) | exponent << 23;
}

void describe_cryptomatte(const Cryptomatte& matte, image::Attributes& attributes) {
    const std::string key = fmt::format("{:08x}", murmur_hash_3(matte.layer)).substr(0, 7);
    const auto name = [&key](const char* field) {
        return fmt::format("{}{}/{}", prefix, key, field);
    };
    nlohmann::json manifest = nlohmann::json::object();
    for (const MatteName& n : matte.names) manifest[n.name] = fmt::format("{:08x}", n.id);
    attributes[name("name")] = matte.layer;
    attributes[name("hash")] = std::string("MurmurHash3_32");
    attributes[name("conversion")] = std::string("uint32_to_float32");
    attributes[name("manifest")] =
        manifest.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<Cryptomatte> cryptomattes_of(const image::Image& image, const std::string& path) {
    std::map<std::string, std::map<std::string, std::string>> by_key;
    for (const image::Part& part : image.parts) read_strings(part.attributes, by_key);
    read_strings(image.attributes, by_key);
    std::vector<Cryptomatte> mattes;
    for (auto& [key, strings] : by_key) {
        if (strings["name"].empty()) continue;
        const std::string& file = strings["manif_file"];
        const bool is_beside = strings["manifest"].empty() && !file.empty();
        Manifest manifest;
        if (is_beside && !path.empty()) {
            manifest = read_manifest_file(path, file);
        } else if (!is_beside) {
            manifest = read_manifest(strings["manifest"]);
        } else {
            manifest.fault = fmt::format("it is in {}, which was not read", file);
        }
        mattes.push_back({strings["name"], std::move(manifest.names), std::move(manifest.fault)});
    }
    std::sort(mattes.begin(), mattes.end(),
              [](const Cryptomatte& a, const Cryptomatte& b) { return a.layer < b.layer; });
    return mattes;
}

Result<const Cryptomatte*> find_matte(std::span<const Cryptomatte> mattes, std::string_view name) {
    std::string_view layer = name;
    for (const accumulate::MatteKind kind : accumulate::matte_kinds) {
        if (name == accumulate::matte_word(kind)) layer = accumulate::matte_layer(kind);
    }
    const auto at = std::find_if(mattes.begin(), mattes.end(),
                                 [&](const Cryptomatte& m) { return m.layer == name; });
    if (at != mattes.end()) return &*at;
    // Of other renderers: `View Layer.CryptoObject`, `crypto_object`
    for (const Cryptomatte& m : mattes) {
        if (plain_matte_name(m.layer) == plain_matte_name(layer)) return &m;
    }
    std::vector<std::string> names;
    std::string list;
    for (const Cryptomatte& m : mattes) {
        names.push_back(m.layer);
        list += " " + m.layer;
    }
    return Error{"matte-layer",
                 fmt::format("no Cryptomatte '{}'{}; {}{}", name, did_you_mean(name, names),
                             names.empty() ? "the file has none" : "there are:", list)};
}

Result<std::vector<uint32_t>> matte_ids(const Cryptomatte& matte,
                                        std::span<const std::string> patterns) {
    std::vector<uint32_t> ids;
    for (const std::string& pattern : patterns) {
        const size_t before = ids.size();
        // A name as it stands is no pattern, but may be a path
        const bool is_name = std::any_of(matte.names.begin(), matte.names.end(),
                                         [&](const MatteName& n) { return n.name == pattern; });
        for (const MatteName& n : matte.names) {
            const bool is_it = n.name == pattern || n.name.starts_with(pattern + "/");
            if (is_name ? is_it : is_chosen(n.name, pattern)) ids.push_back(n.id);
        }
        if (ids.size() > before) continue;
        const bool is_plain = pattern.find_first_of("*?") == std::string::npos;
        if (!matte.names.empty() || !is_plain) return unknown_name(matte, pattern);
        ids.push_back(matte_id(pattern));
    }
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return ids;
}

Error no_ids(const image::Image& image, std::string_view layer) {
    const std::string first = fmt::format("{}00", layer);
    for (const image::Part& part : image.parts) {
        for (const image::Channel& c : part.channels) {
            if (c.name.starts_with(first) && c.type() != image::ChannelType::Float)
                return {
                    "matte-layer",
                    fmt::format("{} is stored as {}, which cannot hold a 32-bit ID; store "
                                "Cryptomattes as float",
                                c.name,
                                c.type() == image::ChannelType::Half ? "half" : "whole numbers")};
        }
    }
    return {"matte-layer", fmt::format("channels {}.R … of the header are missing", first)};
}

Result<std::vector<MatteRank>> matte_ranks(const image::Image& image, std::string_view layer) {
    const size_t pixels = image.data.pixel_count();
    std::vector<MatteRank> ranks;
    for (int level = 0;; ++level) {
        const std::string name = fmt::format("{}{:02}", layer, level);
        const size_t before = ranks.size();
        for (size_t pair = 0; pair < 4; pair += 2) {
            const std::vector<float>* ids = find_floats(image, name, channel_names[pair]);
            const std::vector<float>* coverage = find_floats(image, name, channel_names[pair + 1]);
            if (ids && coverage && ids->size() == pixels && coverage->size() == pixels)
                ranks.push_back({ids, coverage});
        }
        if (ranks.size() == before) break;
    }
    if (ranks.empty()) return no_ids(image, layer);
    return ranks;
}

Result<std::vector<float>> matte_coverage(const image::Image& image,
                                          std::string_view layer,
                                          std::span<const uint32_t> ids) {
    std::vector<uint32_t> sorted(ids.begin(), ids.end());
    std::sort(sorted.begin(), sorted.end());
    const auto ranks = matte_ranks(image, layer);
    if (!ranks) return ranks.error();
    std::vector<float> matte(image.data.pixel_count(), 0.0f);
    for (const MatteRank& rank : *ranks) {
        for (size_t i = 0; i < matte.size(); ++i) {
            const auto id = std::bit_cast<uint32_t>((*rank.ids)[i]);
            if (std::binary_search(sorted.begin(), sorted.end(), id))
                matte[i] += (*rank.coverage)[i];
        }
    }
    return matte;
}

}  // namespace velatura::layers
