// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/composer.h"
#include "usd/compose/prim_index.h"
#include "usd/layer/layer.h"

#include <span>
#include <vector>

namespace velatura::usd::compose {

/// One spec of a property that contributes.
struct PropertySite {
    const layer::Spec* spec = nullptr;
    const StackLayer* layer = nullptr;
    int node = 0;  ///< of the prim's index
};

/// Composed targets of a relationship or connections of an attribute, in the stage's namespace.
struct ComposedTargets {
    std::vector<layer::Path> paths;
    std::vector<layer::Path> deleted;  ///< by list-ops, in the order of the deletes
    bool has_opinion = false;          ///< some layer says something, be it "none"
    /// Targets outside of what their arc brings in, or from a class to an instance of it; those
    /// that a stronger list-op deletes or replaces are no errors.
    std::vector<CompositionError> errors;
};

/// Composes the list-ops of targets (of attributes: connections) over the specs of a property.
/// Args: stack: these specs, strongest first, all of one kind.
///       composer: when given, targets that a class authors into its instances are
///       errors; this costs the prim index of each such target.
/// Ref: AOUSD Core Specification 1.0.1, §10 (path translation), §12.
ComposedTargets compose_targets(const PrimIndex& index,
                                layer::Token property,
                                std::span<const PropertySite> stack,
                                Composer* composer = nullptr);

}  // namespace velatura::usd::compose
