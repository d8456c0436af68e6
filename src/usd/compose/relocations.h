// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/source_loc.h"
#include "usd/compose/composition_error.h"
#include "usd/compose/map_function.h"
#include "usd/layer/path.h"

#include <map>
#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::usd::compose {

/// A relocation as a layer states it; an empty target deletes the source.
struct AuthoredRelocate {
    layer::Path source;
    layer::Path target;
    std::string layer;
    SourceLoc loc;
};

/// The relocations of one layer stack, valid and free of contradictions.
/// Ref: AOUSD Core Specification 1.0.1, §10.3.2 (relocates).
class Relocations {
  public:
    using PathMap = std::map<layer::Path, layer::Path>;

    Relocations() = default;
    /// From the statements of all layers, strongest first; what is refused goes to `errors`.
    /// Limits: 10,000 relocations; of nested ones the last 64 steps are undone to find an origin.
    Relocations(const std::vector<AuthoredRelocate>& authored,
                std::vector<CompositionError>& errors);

    bool empty() const { return target_of_.empty(); }

    /// Every relocation, source → target, one step each.
    const PathMap& target_of_source() const { return target_of_; }

    /// The same from target to source, deletions left out.
    const PathMap& source_of_target() const { return source_of_; }

    /// Source of the relocation to a path; empty when there is none.
    layer::Path source(layer::Path target) const;

    bool is_source(layer::Path path) const { return target_of_.count(path) != 0; }

    /// The map of namespace that relocations at and below a prim make, "/" included: from where
    /// prims come in to where they end up.
    const MapFunction& map_below(layer::Path path) const;

  private:
    PathMap target_of_;
    PathMap source_of_;
    PathMap target_of_origin_;  // origin: the source before relocations of its ancestors
    mutable std::unordered_map<layer::Path, MapFunction> maps_;
};

}  // namespace velatura::usd::compose
