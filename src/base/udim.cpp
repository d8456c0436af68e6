// SPDX-License-Identifier: Apache-2.0
#include "base/udim.h"

#include "base/asset_bytes.h"

namespace velatura {

namespace {

constexpr std::string_view token = "<UDIM>";

}  // namespace

bool is_udim_name(std::string_view name) {
    return name.find(token) != std::string_view::npos;
}

std::string udim_tile_name(std::string name, int i) {
    return name.replace(name.find(token), token.size(), std::to_string(udim_first + i));
}

std::vector<std::string> udim_files(const std::string& name) {
    if (!is_udim_name(name)) return {name};
    std::vector<std::string> files;
    for (int i = 0; i < udim_count; ++i) {
        std::string tile = udim_tile_name(name, i);
        if (asset_exists(tile)) files.push_back(std::move(tile));
    }
    return files;
}

}  // namespace velatura
