// SPDX-License-Identifier: Apache-2.0
#include "import/gltf.h"

#include "base/json_depth.h"
#include "import/context.h"
#include "import/gltf_accessors.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

namespace velatura::import {

namespace {

using nlohmann::json;

/// Extensions whose content reaches the layer; what of it does not is warned about on its own.
constexpr std::array<std::string_view, 10> imported_extensions = {
    "KHR_draco_mesh_compression",      "KHR_lights_punctual", "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength", "KHR_materials_ior",   "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",      "KHR_materials_unlit", "KHR_mesh_quantization",
    "KHR_texture_transform",
};

constexpr size_t glb_header = 12;
constexpr size_t chunk_header = 8;
constexpr uint32_t json_chunk = 0x4e4f534a;  // "JSON"

uint32_t word_at(std::string_view bytes, size_t at) {
    uint32_t word = 0;
    for (size_t i = 0; i < 4; ++i)
        word |= uint32_t(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
    return word;
}

void append_word(std::string& bytes, size_t word) {
    for (size_t i = 0; i < 4; ++i) bytes += char((word >> (8 * i)) & 255);
}

/// Where the JSON is in the file.
struct JsonPart {
    size_t begin = 0, size = 0;
    bool is_binary = false;
};

std::optional<JsonPart> find_json(std::string_view bytes) {
    if (!bytes.starts_with("glTF")) return JsonPart{0, bytes.size(), false};
    constexpr size_t begin = glb_header + chunk_header;
    if (bytes.size() < begin) return std::nullopt;
    const size_t size = word_at(bytes, glb_header);
    const bool is_version_2 = word_at(bytes, 4) == 2;
    if (!is_version_2 || word_at(bytes, glb_header + 4) != json_chunk ||
        size > bytes.size() - begin)
        return std::nullopt;
    return JsonPart{begin, size, true};
}

/// The file with another JSON in it.
std::string with_json(const std::string& bytes, const JsonPart& part, std::string text) {
    if (!part.is_binary) return text;
    while (text.size() % 4 != 0) text += ' ';
    const std::string rest = bytes.substr(part.begin + part.size);
    std::string out = bytes.substr(0, 8);
    append_word(out, glb_header + chunk_header + text.size() + rest.size());
    append_word(out, text.size());
    append_word(out, json_chunk);
    return out + text + rest;
}

std::vector<std::string> names_in(const json& file, const char* key) {
    std::vector<std::string> names;
    const auto list = file.find(key);
    if (list == file.end() || !list->is_array()) return names;
    for (const json& name : *list)
        if (name.is_string()) names.push_back(name.get<std::string>());
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
}

void report_extensions(const json& file, Diagnostics& diagnostics, SourceLoc loc) {
    const auto is_in = [](const auto& list, std::string_view name) {
        return std::find(list.begin(), list.end(), name) != list.end();
    };
    const std::vector<std::string> required = names_in(file, "extensionsRequired");
    for (const std::string& name : required) {
        if (is_in(imported_extensions, name)) continue;
        diagnostics.error("import-extension", loc, "",
                          fmt::format("found glTF extension {} to be required, which is not "
                                      "imported: the result differs from the file's intent",
                                      name));
    }
    for (const std::string& name : names_in(file, "extensionsUsed")) {
        if (is_in(imported_extensions, name) || is_in(required, name)) continue;
        diagnostics.warn("import-extension", loc, "",
                         fmt::format("glTF extension {} is not imported", name));
    }
}

const json* extension(const json& object, const char* name) {
    if (!object.is_object()) return nullptr;
    const auto all = object.find("extensions");
    if (all == object.end() || !all->is_object()) return nullptr;
    const auto found = all->find(name);
    return found != all->end() && found->is_object() ? &*found : nullptr;
}

/// Multiplies a material's emissiveFactor; whether it changed.
bool apply_emissive_strength(json& material, Diagnostics& diagnostics, SourceLoc loc) {
    const json* strong = extension(material, "KHR_materials_emissive_strength");
    if (strong == nullptr || !strong->contains("emissiveStrength")) return false;
    const json& value = (*strong)["emissiveStrength"];
    const double strength = value.is_number() ? value.get<double>() : -1.0;
    if (!(strength >= 0.0) || !std::isfinite(strength)) {
        const json name = material.value("name", json());
        diagnostics.warn(
            "import-material", loc, "",
            fmt::format("material \"{}\": found emissiveStrength {}, expected a "
                        "number of 0 or more; 1 is used",
                        name.is_string() ? name.get<std::string>() : "", value.dump()));
        return false;
    }
    const auto factor = material.find("emissiveFactor");
    if (factor == material.end() || !factor->is_array()) return false;
    constexpr double max = double(std::numeric_limits<float>::max());
    for (json& channel : *factor)
        if (channel.is_number()) channel = std::min(channel.get<double>() * strength, max);
    return true;
}

/// Takes the set of coordinates of texture transforms to the textures; whether any changed.
bool apply_transform_sets(json& object) {
    bool is_changed = false;
    if (const json* transform = extension(object, "KHR_texture_transform")) {
        const auto set = transform->find("texCoord");
        if (set != transform->end() && set->is_number_unsigned()) {
            object["texCoord"] = *set;
            is_changed = true;
        }
    }
    for (json& part : object)
        if (part.is_structured() && apply_transform_sets(part)) is_changed = true;
    return is_changed;
}

/// Reads "%20" and the like in the names of buffers; whether any changed.
bool decode_buffer_names(json& file, const std::filesystem::path& folder) {
    bool is_changed = false;
    const auto buffers = file.find("buffers");
    if (buffers == file.end() || !buffers->is_array()) return false;
    for (json& buffer : *buffers) {
        if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
        const auto uri = buffer["uri"].get<std::string>();
        if (uri.starts_with("data:")) continue;
        const std::string name = file_of_uri(uri);
        std::error_code error;
        if (name == uri || !std::filesystem::exists(folder / name, error)) continue;
        buffer["uri"] = name;
        is_changed = true;
    }
    return is_changed;
}

}  // namespace

std::optional<std::string> prepare_gltf(const std::string& bytes,
                                        const std::filesystem::path& folder,
                                        Diagnostics& diagnostics,
                                        SourceLoc loc) {
    const auto unchecked = [&](const char* why) {
        diagnostics.warn("import-extension", loc, "",
                         fmt::format("glTF extensions of the file are not checked: {}", why));
        return std::nullopt;
    };
    const std::optional<JsonPart> part = find_json(bytes);
    if (!part) return unchecked("it is not a .glb file of version 2");
    std::string_view text = std::string_view(bytes).substr(part->begin, part->size);
    // Chunks are padded with spaces; some exporters take zeros
    while (!text.empty() && text.back() == '\0') text.remove_suffix(1);
    if (is_json_too_deep(text)) return unchecked("its JSON is nested too deeply");
    json file = json::parse(text, nullptr, false);
    if (!file.is_object()) return unchecked("its JSON cannot be read");
    report_extensions(file, diagnostics, loc);
    bool is_changed = false;
    const auto materials = file.find("materials");
    if (materials != file.end() && materials->is_array()) {
        for (json& material : *materials) {
            if (apply_emissive_strength(material, diagnostics, loc)) is_changed = true;
            if (material.is_structured() && apply_transform_sets(material)) is_changed = true;
        }
    }
    const std::string_view body = std::string_view(bytes).substr(part->begin + part->size);
    if (widen_accessors(file, part->is_binary ? body : std::string_view(), folder, diagnostics,
                        loc))
        is_changed = true;
    if (decode_buffer_names(file, folder)) is_changed = true;
    if (!is_changed) return std::nullopt;
    // Names of files may be no UTF-8, which JSON cannot say
    return with_json(bytes, *part, file.dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace velatura::import
