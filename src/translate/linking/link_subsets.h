// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"
#include "usd/stage/collection.h"

#include <unordered_map>
#include <vector>

namespace velatura::translate::linking {

/// GeomSubsets that the faces of a shape are in, by Shape::provenance.
using SubsetsOfPart = std::unordered_map<scene::ProvenanceId, std::vector<usd::layer::Path>>;

/// Divides the meshes of the scene by those of their GeomSubsets that a collection names: each part
/// becomes a shape. Geometry that is a light stays whole, with a warning.
SubsetsOfPart divide_by_subsets(Context& ctx,
                                const std::vector<usd::stage::CollectionQuery>& queries);

}  // namespace velatura::translate::linking
