// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/autosaved_looks.h"

#include "base/atomic_file.h"
#include "base/hash.h"
#include "compositor/window/recent_files.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace velatura::compositor::window {

namespace {

namespace fs = std::filesystem;

constexpr const char* schema = "velatura.kept-looks/1";
constexpr size_t largest_bytes = size_t(1) << 24;
constexpr const char* slot_names[] = {"A", "B"};

std::string absolute(const std::string& path) {
    std::error_code failed;
    const fs::path whole = fs::weakly_canonical(path, failed);
    return failed ? path : whole.string();
}

}  // namespace

std::string AutosavedLooks::path_of(const std::string& layers) const {
    return fmt::format("{}/{:016x}.json", folder_, hash_string(absolute(layers)));
}

std::optional<Looks> AutosavedLooks::find(const std::string& layers) const {
    if (folder_.empty()) return std::nullopt;
    const auto text = read_file(path_of(layers), largest_bytes);
    if (!text) return std::nullopt;
    const auto json = nlohmann::json::parse(*text, nullptr, false);
    if (!json.is_object() || json.value("schema", "") != schema ||
        json.value("layers", "") != absolute(layers))
        return std::nullopt;
    Looks looks;
    for (size_t i = 0; i < 2; ++i) {
        const auto look = json.find(slot_names[i]);
        if (look == json.end()) return std::nullopt;
        auto read = look_from_json(look->dump());
        if (!read) return std::nullopt;
        looks[i] = std::move(*read);
    }
    return looks;
}

Result<void> AutosavedLooks::keep(const std::string& layers, const Looks& looks) const {
    if (folder_.empty()) return {};
    nlohmann::ordered_json json;
    json["schema"] = schema;
    json["layers"] = absolute(layers);
    for (size_t i = 0; i < 2; ++i)
        json[slot_names[i]] = nlohmann::ordered_json::parse(look_to_json(looks[i]));
    std::error_code failed;
    fs::create_directories(folder_, failed);
    return write_file_atomically(path_of(layers), json.dump(2) + "\n");
}

void AutosavedLooks::drop(const std::string& layers) const {
    if (folder_.empty()) return;
    std::error_code failed;
    fs::remove(path_of(layers), failed);
}

std::string autosave_folder() {
    const std::string list = recent_list_path();
    return list.empty() ? list : (fs::path(list).parent_path() / "looks").string();
}

}  // namespace velatura::compositor::window
