// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_accessors.h"

#include "base/atomic_file.h"
#include "base/base64.h"
#include "import/context.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <string>

namespace velatura::import {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A number of an object, `fallback` where it is absent; nothing where it is no natural number.
std::optional<size_t> natural(const json& object, const char* key, std::optional<size_t> fallback) {
    const auto found = object.find(key);
    if (found == object.end()) return fallback;
    if (!found->is_number_unsigned()) return std::nullopt;
    return found->get<size_t>();
}

std::string text(const json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// An element of one of the file's arrays of objects, else nullptr.
json* element(json& file, const char* array, std::optional<size_t> index) {
    const auto found = file.find(array);
    if (!index || found == file.end() || !found->is_array() || *index >= found->size())
        return nullptr;
    json& object = (*found)[*index];
    return object.is_object() ? &object : nullptr;
}

/// How the numbers of an accessor are stored. Ref: glTF 2.0, 3.6.2.2 and 3.11.
struct Component {
    size_t size = 0;  ///< in bytes
    bool is_signed = false;

    double value(const char* at, bool is_normalized) const {
        int32_t n = 0;
        if (size == 1) {
            n = is_signed ? int32_t(static_cast<signed char>(*at))
                          : int32_t(static_cast<unsigned char>(*at));
        } else {
            const auto low = uint16_t(static_cast<unsigned char>(at[0]));
            const auto high = uint16_t(static_cast<unsigned char>(at[1]));
            const auto both = uint16_t(low | high << 8);
            n = is_signed ? int32_t(int16_t(both)) : int32_t(both);
        }
        if (!is_normalized) return double(n);
        const int bits = int(8 * size) - (is_signed ? 1 : 0);
        return std::max(double(n) / double((1 << bits) - 1), -1.0);
    }
};

std::optional<Component> small_component(std::optional<size_t> type) {
    switch (type.value_or(0)) {
        case 5120:
            return Component{1, true};
        case 5121:
            return Component{1, false};
        case 5122:
            return Component{2, true};
        case 5123:
            return Component{2, false};
        default:
            return std::nullopt;
    }
}

size_t components_of(const std::string& type) {
    return type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 0;
}

class Widener {
  public:
    Widener(json& file, std::string_view body, fs::path folder)
        : file_(file), body_(body), folder_(std::move(folder)) {}

    /// Accessors of vertices that are small integers.
    std::set<size_t> candidates() {
        std::set<size_t> found;
        const auto meshes = file_.find("meshes");
        if (meshes == file_.end() || !meshes->is_array()) return found;
        for (const json& mesh : *meshes) {
            if (!mesh.is_object() || !mesh.contains("primitives")) continue;
            for (const json& primitive : mesh["primitives"]) {
                if (!primitive.is_object() || !primitive.contains("attributes")) continue;
                const json& attributes = primitive["attributes"];
                if (!attributes.is_object()) continue;
                for (const auto& [name, index] : attributes.items())
                    if (is_widened(name) && index.is_number_unsigned())
                        add_candidate(index.get<size_t>(), found);
            }
        }
        return found;
    }

    /// The accessor as floats; why not, else empty.
    std::string widen(size_t index);

    /// Adds the buffer of what was widened.
    void finish() {
        if (floats_.empty()) return;
        file_["buffers"].push_back(
            {{"byteLength", floats_.size()},
             {"uri", "data:application/octet-stream;base64," + to_base64(floats_)}});
    }

  private:
    static bool is_widened(std::string_view name) {
        return name == "POSITION" || name == "NORMAL" || name == "TANGENT" ||
               name.starts_with("TEXCOORD_") || name.starts_with("COLOR_");
    }

    void add_candidate(size_t index, std::set<size_t>& found) {
        const json* accessor = element(file_, "accessors", index);
        if (accessor == nullptr || !small_component(natural(*accessor, "componentType", {})))
            return;
        // Without a view the numbers are zeros or lie in an extension
        if (accessor->contains("bufferView")) found.insert(index);
    }

    /// Bytes of a buffer; nothing where they are not there.
    const std::string* buffer(size_t index) {
        const auto known = buffers_.find(index);
        if (known != buffers_.end()) return known->second ? &*known->second : nullptr;
        std::optional<std::string>& bytes = buffers_[index];
        const json* description = element(file_, "buffers", index);
        if (description == nullptr) return nullptr;
        const std::string uri = text(*description, "uri");
        if (uri.empty()) {
            // The second chunk of a .glb file, after its length and its name
            if (index == 0 && body_.size() >= 8) bytes = std::string(body_.substr(8));
        } else if (uri.starts_with("data:")) {
            const size_t comma = uri.find(";base64,");
            if (comma != std::string::npos)
                bytes = from_base64(std::string_view(uri).substr(comma + 8));
        } else if (const Result<std::string> read =
                       read_file((folder_ / file_of_uri(uri)).string())) {
            bytes = *read;
        }
        return bytes ? &*bytes : nullptr;
    }

    json& file_;
    std::string_view body_;
    fs::path folder_;
    std::map<size_t, std::optional<std::string>> buffers_;
    std::string floats_;  ///< the new buffer
};

std::string Widener::widen(size_t index) {
    json& accessor = *element(file_, "accessors", index);
    if (accessor.contains("sparse")) return "it is sparse";
    const json* view = element(file_, "bufferViews", natural(accessor, "bufferView", {}));
    const Component component = *small_component(natural(accessor, "componentType", {}));
    const size_t n = components_of(text(accessor, "type"));
    const auto count = natural(accessor, "count", {});
    const auto start = natural(accessor, "byteOffset", 0);
    if (view == nullptr || n == 0 || !count || !start) return "its description is incomplete";
    const auto view_start = natural(*view, "byteOffset", 0);
    const auto view_size = natural(*view, "byteLength", {});
    const auto stride = natural(*view, "byteStride", n * component.size);
    const auto source = natural(*view, "buffer", {});
    const std::string* bytes = source ? buffer(*source) : nullptr;
    if (bytes == nullptr || !view_start || !view_size || !stride) return "its bytes are missing";
    if (*view_start > bytes->size() || *view_size > bytes->size() - *view_start)
        return "its view ends beyond its buffer";
    // The last element may end before its stride does
    const size_t size = n * component.size;
    const bool fits =
        *count == 0 || (*start <= *view_size && size <= *view_size - *start && *stride > 0 &&
                        *count - 1 <= (*view_size - *start - size) / *stride);
    if (!fits) return "it ends beyond its view";
    const auto is_normalized = accessor.find("normalized");
    const bool normalized = is_normalized != accessor.end() && *is_normalized == json(true);
    const size_t at = floats_.size();
    for (size_t i = 0; i < *count; ++i) {
        const char* item = bytes->data() + *view_start + *start + i * *stride;
        for (size_t k = 0; k < n; ++k) {
            const auto value = float(component.value(item + k * component.size, normalized));
            std::array<char, sizeof(float)> raw;
            std::memcpy(raw.data(), &value, sizeof value);
            floats_.append(raw.data(), raw.size());
        }
    }
    accessor["componentType"] = 5126;
    accessor["bufferView"] = file_["bufferViews"].size();
    for (const char* key : {"byteOffset", "normalized", "min", "max"}) accessor.erase(key);
    file_["bufferViews"].push_back({{"buffer", file_["buffers"].size()},
                                    {"byteOffset", at},
                                    {"byteLength", floats_.size() - at}});
    return {};
}

}  // namespace

bool widen_accessors(json& file,
                     std::string_view body,
                     const fs::path& folder,
                     Diagnostics& diagnostics,
                     SourceLoc loc) {
    Widener widener(file, body, folder);
    bool is_changed = false;
    for (const size_t index : widener.candidates()) {
        const std::string why_not = widener.widen(index);
        is_changed = is_changed || why_not.empty();
        if (!why_not.empty())
            diagnostics.error("import-accessor", loc, "",
                              fmt::format("vertices of accessor {} are integers and cannot be made "
                                          "floats: {}",
                                          index, why_not));
    }
    widener.finish();
    return is_changed;
}

}  // namespace velatura::import
