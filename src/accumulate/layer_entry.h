// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::accumulate {

/// One line of the header string `velatura/layers`.
struct LayerEntry {
    std::string name;    ///< `b2_key`, `C_key`, `rgba`, `albedo`, …
    std::string family;  ///< lobe-matrix, matrix, bounces, groups, lobes, paths, unoccluded,
                         ///< shadow, caster, clamp, beauty, data, halves
    std::string part;    ///< EXR part that holds it
    std::string lpe;     ///< light path expression; empty for data
    std::string bounce;  ///< `b2`, `tail`; empty = all
    std::string group;   ///< empty = all
    std::string lobe;    ///< of the lobe matrix: of the first scattering, or `emission`
    std::string caster;  ///< for layers by caster: its name, `rest` for all casters without one
    std::string of;  ///< for half images: the layer it is half of; for clamps: the layer they cut
    std::string source, filter;  ///< of named data layers, as DataLayer
    std::string type;            ///< half, float, uint, mixed
    bool in_sum = false;         ///< one of the layers that the beauty is the fold of
    bool is_empty = false;       ///< zero everywhere, not stored
    std::string digest;
};

}  // namespace velatura::accumulate
