// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/path.h"
#include "usd/layer/types.h"

#include <cstddef>
#include <unordered_set>
#include <utility>
#include <vector>

namespace velatura::usd::compose {

/// Maps time of a weaker site to the stronger one: outer = scale · inner + offset.
using TimeOffset = layer::LayerOffset;

/// Offset and scale are finite, the scale above 0 and not too small to undo (AOUSD 1.0.1: negative
/// scales are not allowed).
bool is_usable(const TimeOffset& offset);

/// A map of namespace and time along an arc: from the source (weaker) site to the target (stronger)
/// site. Pairs map whole subtrees; the longest prefix decides; a path outside all pairs has no
/// image. Paths carry no variant selections. A pair with an empty target blocks its source.
/// Ref: AOUSD Core Specification 1.0.1, §10 (namespace mapping).
class MapFunction {
  public:
    using PathPair = std::pair<layer::Path, layer::Path>;  ///< source, target

    /// Maps nothing.
    MapFunction() = default;
    MapFunction(std::vector<PathPair> pairs, TimeOffset offset);
    static MapFunction identity(TimeOffset offset = {});

    /// Image of a prim or property path; empty when outside the domain, or when the image is owned
    /// by another pair (the map stays one to one). Target elements inside the path are mapped too.
    layer::Path to_target(layer::Path path) const { return map(path, false); }

    layer::Path to_source(layer::Path path) const { return map(path, true); }

    /// First `inner`, then this one.
    MapFunction after(const MapFunction& inner) const;
    MapFunction inverse() const;
    /// The same with "/" mapped to "/" where no pair says otherwise.
    MapFunction with_root_identity() const;
    /// The same without the pair "/" → "/".
    MapFunction without_root_identity() const;

    bool is_identity() const;
    bool has_root_identity() const;

    const TimeOffset& time_offset() const { return offset_; }

    const std::vector<PathPair>& pairs() const { return pairs_; }

    bool operator==(const MapFunction&) const = default;

    size_t hash() const;

  private:
    layer::Path map(layer::Path path, bool invert) const;
    void canonicalize();

    std::vector<PathPair> pairs_;  // sorted by depth of the source, then by source and target
    TimeOffset offset_;
};

/// A map kept by a MapTable.
using MapPtr = const MapFunction*;

/// Keeps one copy of each map; lives as long as the prim indices that point into it. Not
/// thread-safe.
class MapTable {
  public:
    MapTable();

    MapPtr identity() const { return identity_; }

    MapPtr intern(MapFunction map);
    /// First `inner`, then `outer`.
    MapPtr composed(MapPtr outer, MapPtr inner);

  private:
    struct Hash {
        size_t operator()(const MapFunction& m) const { return m.hash(); }
    };

    std::unordered_set<MapFunction, Hash> maps_;
    MapPtr identity_;
};

}  // namespace velatura::usd::compose
