// SPDX-License-Identifier: Apache-2.0
#include "accumulate/data_layer.h"

#include <algorithm>
#include <array>
#include <iterator>

namespace velatura::accumulate {

namespace {

struct SourceFacts {
    std::string_view name, suffixes;
    bool is_premultiplied;
};

/// By DataSource.
constexpr std::array<SourceFacts, data_source_count> sources = {{
    {"primvar", "", false},
    {"albedo", "RGB", true},
    {"N", "XYZ", true},
    {"Neye", "XYZ", true},
    {"Ng", "XYZ", true},
    {"P", "XYZ", false},
    {"Peye", "XYZ", false},
    {"Z", "-", false},
    {"st", "UV", false},
    {"elementId", "-", false},
    {"catcher", "RGB", true},
    {"plate", "RGB", true},
    {"forward", "uv", false},
    {"backward", "uv", false},
    {"shutterMotion", "uv", false},
}};

struct OtherName {
    std::string_view name;
    DataSource source;
};

constexpr OtherName other_names[] = {
    {"normal", DataSource::Normal},     {"z", DataSource::Depth},
    {"depth", DataSource::Depth},       {"cameraDepth", DataSource::Depth},
    {"motion", DataSource::Motion},     {"motionvector", DataSource::Motion},
    {"motionFore", DataSource::Motion}, {"motionBack", DataSource::BackwardMotion},
};

constexpr std::array<std::string_view, data_filter_count> filters = {"average", "closest", "min",
                                                                     "max"};

}  // namespace

std::string DataLayer::channel(size_t i) const {
    return suffixes == "-" ? name : name + "." + suffixes[i];
}

std::string_view name_of(DataSource source) {
    return sources[size_t(source)].name;
}

std::optional<DataSource> find_data_source(std::string_view name) {
    for (size_t i = 1; i < sources.size(); ++i)
        if (sources[i].name == name) return DataSource(i);
    const auto other = std::find_if(std::begin(other_names), std::end(other_names),
                                    [&](const OtherName& o) { return o.name == name; });
    if (other == std::end(other_names)) return std::nullopt;
    return other->source;
}

std::string_view suffixes_of(DataSource source) {
    return sources[size_t(source)].suffixes;
}

std::string_view name_of(DataFilter filter) {
    return filters[size_t(filter)];
}

std::optional<DataFilter> find_data_filter(std::string_view name) {
    const auto at = std::find(filters.begin(), filters.end(), name);
    if (at == filters.end()) return std::nullopt;
    return DataFilter(at - filters.begin());
}

bool is_premultiplied(DataSource source) {
    return sources[size_t(source)].is_premultiplied;
}

}  // namespace velatura::accumulate
