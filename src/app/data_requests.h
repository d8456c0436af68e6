// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/data_layer.h"
#include "base/result.h"
#include "scene/scene.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::app {

/// A data layer that --layers names: [NAME=]SOURCE[:FILTER].
struct DataRequest {
    std::string text;  ///< as typed
    std::string name;  ///< of the layer
    accumulate::DataSource source = accumulate::DataSource::Position;
    std::string primvar;
    std::optional<accumulate::DataFilter> filter;  ///< as typed
};

/// Errors: "usage": the source is unknown; the message lists what there is.
Result<DataRequest> parse_data_request(const std::string& text);

/// The filter that a render var authors for whichever renderer. Errors: "render-var".
Result<accumulate::DataFilter> parse_render_var_filter(const std::string& text);

/// Numbers of a USD value type.
struct NumberType {
    std::string suffixes;  ///< see DataLayer::suffixes
    bool is_half = false, is_whole = false, is_color = false;
};

/// Nothing for types that hold no numbers, or more than four.
std::optional<NumberType> number_type(std::string_view usd_type);

/// The layer of a primvar, by its type in the scene, or by another one that a render var authors.
/// Errors: "render-var": no geometry has a primvar of that name, of numbers.
Result<accumulate::DataLayer> make_primvar_layer(const scene::Scene& scene,
                                                 const std::string& primvar,
                                                 const std::string& data_type);

/// What render vars and --layers can name, for messages.
std::string data_sources_text();
std::string primvars_text(const scene::Scene& scene);

}  // namespace velatura::app
