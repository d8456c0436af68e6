// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/composition_error.h"
#include "usd/compose/prim_index.h"
#include "usd/compose/targets.h"

#include <fmt/format.h>

#include <string_view>
#include <vector>

namespace velatura::usd::compose {

/// Specs of a property, strongest first. Only those of the strongest one's kind count; others are
/// added to `errors` where that is given.
inline std::vector<PropertySite> property_stack(const PrimIndex& index,
                                                layer::Token name,
                                                std::vector<CompositionError>* errors = nullptr) {
    std::vector<PropertySite> result;
    for (const int i : index.contributing()) {
        const Node& n = index.graph()[i];
        const layer::Path path = n.path.append_property(name);
        for (const StackLayer& entry : n.stack->layers()) {
            const layer::Spec* spec = entry.layer->spec(path);
            if (!spec) continue;
            if (result.empty() || result.front().spec->kind() == spec->kind()) {
                result.push_back({spec, &entry, i});
            } else if (errors) {
                const bool is_attribute = spec->kind() == layer::SpecKind::Attribute;
                errors->push_back({ErrorKind::InconsistentPropertyType,
                                   index.path().append_property(name), n.stack->identifier(), path,
                                   fmt::format("{} is ignored: a stronger layer has {}",
                                               is_attribute ? "an attribute" : "a relationship",
                                               is_attribute ? "a relationship" : "an attribute"),
                                   spec->loc()});
            }
        }
    }
    return result;
}

inline ComposedTargets targets_of(const PrimIndex& index, std::string_view property) {
    const layer::Token name(property);
    return compose_targets(index, name, property_stack(index, name));
}

}  // namespace velatura::usd::compose
