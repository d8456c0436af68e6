// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/variants.h"

#include "usd/stage/prim_data.h"

#include <set>

namespace velatura::usd::stage {

std::vector<std::string> variant_names(const Prim& prim, std::string_view set) {
    std::set<std::string> names;
    for (const compose::Node& node : prim.data()->index.nodes()) {
        if (!node.has_specs) continue;
        const layer::Path site =
            node.path.append_variant_selection(layer::Token(set), layer::Token());
        for (const compose::StackLayer& entry : node.stack->layers()) {
            const layer::Spec* const spec = entry.layer->spec(site);
            if (!spec) continue;
            for (const layer::Token& name : spec->variants()) names.insert(name.str());
        }
    }
    return {names.begin(), names.end()};
}

}  // namespace velatura::usd::stage
