// SPDX-License-Identifier: Apache-2.0
#include "film/lobe_layers.h"

#include "accumulate/names.h"
#include "base/check.h"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace velatura::film {

namespace {

constexpr std::array<std::pair<const char*, const char*>, 6> lobes = {{
    {"diffuse", "<RD'diffuse'>"},
    {"specular", "<R.'specular'>"},
    {"coat", "<R.'coat'>"},
    {"transmit", "T"},
    {"subsurface", "<RD'subsurface'>"},
    {"volume", "V"},
}};

}  // namespace

std::vector<accumulate::PathLayer> lobe_layers() {
    // Half images of what clamps took have names, too
    for (const auto& [name, event] : lobes)
        VELATURA_CHECK(fmt::format("clamp_{}_indirect_hA.R", name).size() <=
                           accumulate::max_channel_name_bytes,
                       "lobes have short names");
    using Light = accumulate::PathLayer::Light;
    std::vector<accumulate::PathLayer> layers = {{"emission", "C[LOB]", Light::Arriving, "lobes"}};
    for (const auto& [name, event] : lobes) {
        layers.push_back({fmt::format("{}_direct", name), fmt::format("C{}[LOB]", event),
                          Light::Arriving, "lobes"});
        layers.push_back({fmt::format("{}_indirect", name), fmt::format("C{}.+[LOB]", event),
                          Light::Arriving, "lobes"});
    }
    return layers;
}

std::vector<accumulate::PathLayer> lobes_of_matrix() {
    using Light = accumulate::PathLayer::Light;
    const auto make = [](const char* lobe, const std::string& expression) {
        return accumulate::PathLayer{lobe, expression, Light::Arriving,
                                     accumulate::lobe_matrix_family, lobe};
    };
    std::vector<accumulate::PathLayer> layers = {make(accumulate::emission_lobe, "C[LOB]")};
    for (const auto& [name, event] : lobes)
        layers.push_back(make(name, fmt::format("C{}.*[LOB]", event)));
    return layers;
}

}  // namespace velatura::film
