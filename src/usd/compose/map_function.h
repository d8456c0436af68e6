// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/path.h"
#include "usd/layer/types.h"

#include <memory>
#include <utility>
#include <vector>

namespace velatura::usd::compose {

/// Maps time of a weaker site to the stronger one: outer = scale · inner + offset.
using TimeOffset = layer::LayerOffset;

/// A map of namespace and time along an arc: from the source (weaker) site to the target (stronger)
/// site. Pairs map whole subtrees; the longest prefix decides; a path outside all pairs has no
/// image. Paths carry no variant selections. A pair with an empty target blocks its source
/// (relocated away). Ref: AOUSD Core Specification 1.0.1, §10 (namespace mapping).
class MapFunction {
  public:
    using PathPair = std::pair<layer::Path, layer::Path>;  ///< source, target

    /// Maps nothing.
    MapFunction() = default;
    MapFunction(std::vector<PathPair> pairs, TimeOffset offset);
    static MapFunction identity(TimeOffset offset = {});

    /// Image of a prim or property path; empty when outside the domain, or when the image is owned
    /// by another pair (the map stays one to one). Target elements inside the path are mapped too.
    layer::Path to_target(layer::Path path) const;
    layer::Path to_source(layer::Path path) const;

    /// First `inner`, then this one.
    MapFunction after(const MapFunction& inner) const;
    MapFunction inverse() const;
    /// The same with "/" mapped to "/" where no pair says otherwise.
    MapFunction with_root_identity() const;

    bool is_identity() const;
    bool has_root_identity() const;

    const TimeOffset& time_offset() const { return offset_; }

    const std::vector<PathPair>& pairs() const { return pairs_; }

    bool operator==(const MapFunction&) const = default;

  private:
    layer::Path map(layer::Path path, bool invert) const;
    void canonicalize();

    std::vector<PathPair> pairs_;  // sorted by source
    TimeOffset offset_;
};

using MapPtr = std::shared_ptr<const MapFunction>;

}  // namespace velatura::usd::compose
