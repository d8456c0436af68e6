// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_entry.h"
#include "accumulate/layer_set.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::accumulate {

/// Where a layer comes from: the sum of some accumulators, in this order, minus others.
struct LayerSource {
    LayerEntry entry;  ///< without family, part and type
    std::vector<uint32_t> plus, minus;
    bool is_clamped = false;      ///< without what clamps took of `plus`
    bool is_rest = false;         ///< of what came first: drops what is only rounding
    bool can_be_omitted = false;  ///< not stored when zero everywhere
};

/// b0_<group>_emission, b<k>_<group>_<lobe>, tail_<group>_<lobe>.
std::vector<LayerSource> lobe_matrix_sources(const LayerSet& set, const AccumulatorTable& table);

/// b<k>_<group>, tail_<group>; from the lobe matrix where there is one.
std::vector<LayerSource> matrix_sources(const LayerSet& set, const AccumulatorTable& table);

/// b0 … tail; from a matrix where there is one.
std::vector<LayerSource> bounce_sources(const LayerSet& set, const AccumulatorTable& table);

/// C_<group>; from a matrix where there is one.
std::vector<LayerSource> group_sources(const LayerSet& set, const AccumulatorTable& table);

/// The expression with the prefix that says which light is meant.
std::string lpe_of(const PathLayer& layer);

/// Those of one family by expression: "lobes" or "paths".
std::vector<LayerSource> path_sources(const LayerSet& set,
                                      const AccumulatorTable& table,
                                      const std::string& family);

/// U_<group> or S_<group>, one for every group.
std::vector<LayerSource> shadow_sources(const LayerSet& set,
                                        const AccumulatorTable& table,
                                        bool unoccluded);

/// All layers of light that the set stores, but those by caster.
std::vector<LayerSource> light_sources(const LayerSet& set, const AccumulatorTable& table);

/// S_<group>_<caster> of one group, `rest` last.
std::vector<LayerSource> caster_sources(const LayerSet& set, const AccumulatorTable& table, int g);

}  // namespace velatura::accumulate
