// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/asset_expression.h"

#include "usd/layer/expression.h"

#include <fmt/format.h>

namespace velatura::usd::stage {

AssetAnchor asset_anchor(const PrimData& prim, const ValueOpinion& opinion, TimeCode time) {
    AssetAnchor anchor;
    if (opinion.source == ValueSource::Clips) {
        anchor.stack = opinion.clips->definition().stack;
        if (!time.is_default()) anchor.layer = opinion.clips->active_layer(time.value());
    } else if (opinion.spec.prim_spec) {
        anchor.stack = prim.index.nodes()[size_t(opinion.spec.prim_spec->node)].stack;
        anchor.layer = opinion.spec.prim_spec->layer->layer;
    }
    return anchor;
}

std::string evaluate_asset(const std::string& authored,
                           const AssetAnchor& anchor,
                           const std::string& prim_path,
                           SourceLoc loc,
                           Diagnostics& diagnostics) {
    if (!layer::is_expression(authored) || !anchor.stack) return authored;
    const layer::ExpressionResult result =
        layer::evaluate_expression(authored, anchor.stack->expression_variables());
    for (const std::string& error : result.errors) {
        diagnostics.warn("usd-expression", loc, prim_path,
                         fmt::format("asset path {} cannot be evaluated: {}", authored, error));
    }
    if (const std::string* path = result.as_string()) return *path;
    if (!result.has_error() && (!result.value.is_empty() || result.is_empty_list)) {
        diagnostics.warn("usd-expression", loc, prim_path,
                         fmt::format("asset path {} does not evaluate to a string", authored));
    }
    return {};
}

}  // namespace velatura::usd::stage
