// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/data_layer.h"
#include "accumulate/matte_kind.h"
#include "base/result.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace velatura::accumulate {

/// One row of the bounce × group matrix.
struct LightGroup {
    std::string name;  ///< as artists see it; `LayerSet::normalize_names` makes it legal and unique
    std::vector<std::string> prims;  ///< USD paths of the lights in it
    bool is_dome = false;            ///< part of the alias `env`
    std::string label = {};          ///< what the scene calls it; empty: `name`

    bool operator==(const LightGroup&) const = default;
};

/// Something that casts shadows, see LayerSet::caster_layers.
struct ShadowCaster {
    std::string name;  ///< `LayerSet::normalize_names` makes it legal and unique
    std::string prim;  ///< USD path; empty where the scene gives it a name

    bool operator==(const ShadowCaster&) const = default;
};

/// The light of paths that an expression picks, in a layer of its own
/// (docs/reference/light_path_expressions.md).
struct PathLayer {
    /// As it arrives; as it would without shadows; what shadows take of it.
    enum class Light : uint8_t { Arriving, Unoccluded, Shadow };

    std::string name;
    std::string expression;  ///< without prefixes
    Light light = Light::Arriving;
    std::string family;     ///< "lobes", which add up to the beauty, "paths", or lobe_matrix_family
    std::string lobe = {};  ///< of the last: the lobe, all of whose paths the expression picks

    bool operator==(const PathLayer&) const = default;
};

/// Of path layers that are no layers of a file: they say which lobe a path left the first surface
/// by, for the cells b<k>_<group>_<lobe>.
inline constexpr const char* lobe_matrix_family = "lobe-matrix";
/// What emission seen directly has in place of a lobe.
inline constexpr const char* emission_lobe = "emission";

/// A data layer, `beauty` or `alpha` under another name, as well.
struct DataAlias {
    std::string name, of;

    bool operator==(const DataAlias&) const = default;
};

/// Which light layers a film accumulates and a file stores. Bounces run b0 … b<last_bounce>, then
/// tail.
struct LayerSet {
    int last_bounce = 4;             ///< K >= 0: bounces above it go to `tail`
    std::vector<LightGroup> groups;  ///< row g of every (bounce, group) pair; at least one
    bool bounce_layers = true;       ///< b0 … bK tail
    bool group_layers = true;        ///< C_<group>
    bool matrix_layers = false;      ///< b<k>_<group>, tail_<group>
                                     ///< path_layers hold the lobes of b<k>_<group>_<lobe>
    bool shadow_layers = false;      ///< U_<group>, S_<group>
    bool caster_layers = false;      ///< S_<group>_<caster>; only with shadow_layers
    std::vector<ShadowCaster> casters;
    /// Contributions of which some channel is larger are scaled down to it, and what that takes
    /// goes to clamp_<layer>: those of bounces 0 and 1, and those of later ones. Infinite = not.
    float clamp_direct = std::numeric_limits<float>::infinity();
    float clamp_indirect = std::numeric_limits<float>::infinity();
    std::vector<PathLayer> path_layers;
    bool has_strict_paths = false;  ///< G is rough and S a mirror; else each is any specular
    bool data_layers = true;  ///< albedo N P Z st primId instanceId sampleCount variance invalid
    std::vector<DataAlias> data_aliases;
    std::vector<DataLayer> named_data;  ///< data layers requested one by one
    bool halves = false;                ///< <layer>_hA, <layer>_hB of every light layer
    bool float_layers = false;          ///< store light layers as float instead of half
    std::array<bool, matte_kinds.size()> mattes = {};  ///< Cryptomattes, by MatteKind
    int matte_levels = 6;  ///< things per pixel that a Cryptomatte stores, the largest ones; 1 … 64

    bool operator==(const LayerSet&) const = default;

    int bounce_count() const { return last_bounce + 2; }

    int group_count() const { return int(groups.size()); }

    /// Whether some layer is of light without its shadows.
    bool wants_unoccluded() const {
        return shadow_layers ||
               std::any_of(path_layers.begin(), path_layers.end(), [](const PathLayer& p) {
                   return p.light != PathLayer::Light::Arriving;
               });
    }

    bool has_paths(const std::string& family) const {
        return std::any_of(path_layers.begin(), path_layers.end(),
                           [&family](const PathLayer& p) { return p.family == family; });
    }

    bool has_lobe_matrix() const { return has_paths(lobe_matrix_family); }

    /// Lobes of the lobe matrix, as numbers of path layers.
    std::vector<size_t> lobes() const;

    /// Whether cells by lobe or the matrix hold what bounces and groups are sums of.
    bool has_cells() const { return matrix_layers || has_lobe_matrix(); }

    /// Whether files have data layers, of whichever kind.
    bool has_data() const { return data_layers || !named_data.empty(); }

    bool has_motion_data() const {
        return std::any_of(named_data.begin(), named_data.end(),
                           [](const DataLayer& d) { return d.is_motion(); });
    }

    bool has_catcher_data() const {
        return std::any_of(named_data.begin(), named_data.end(),
                           [](const DataLayer& d) { return d.is_of_catchers(); });
    }

    /// Filters of those named data layers that are not sums, in their order.
    std::vector<DataFilter> picking_filters() const;

    bool has_mattes(MatteKind kind) const { return mattes[size_t(kind)]; }

    bool has_mattes() const { return mattes != decltype(mattes){}; }

    /// Column of a bounce number: itself up to K, then the tail.
    int column(int bounce) const { return bounce > last_bounce ? last_bounce + 1 : bounce; }

    bool has_clamp() const {
        return std::min(clamp_direct, clamp_indirect) < std::numeric_limits<float>::infinity();
    }

    /// `b0` … `bK`, `tail`.
    std::string column_name(int column) const;

    /// Makes every name of a group or caster legal in EXR channel names with all prefixes and
    /// suffixes ([A-Za-z0-9_], not numeric, not a reserved word of the mixer) and unique. Groups
    /// have at most 21 bytes, less with clamps, casters or lobes. Call once before making a film.
    void normalize_names();

    std::string to_json() const;
    /// Errors: "layer-set-json".
    static Result<LayerSet> from_json(const std::string& text);
};

/// Numbers the accumulators of a LayerSet. Each is a triple of doubles per pixel; `absent` when not
/// accumulated.
class AccumulatorTable {
  public:
    static constexpr uint32_t absent = 0xffffffffu;
    static constexpr uint32_t beauty = 0;    ///< R G B, summed independently of the light layers
    static constexpr uint32_t coverage = 1;  ///< alpha, filter weight, number of valid samples

    explicit AccumulatorTable(const LayerSet& set);

    uint32_t albedo() const { return albedo_; }

    uint32_t normal() const { return albedo_ == absent ? absent : albedo_ + 1; }

    uint32_t position() const { return albedo_ == absent ? absent : albedo_ + 2; }

    uint32_t surface() const { return albedo_ == absent ? absent : albedo_ + 3; }  ///< s, t, Z

    uint32_t hits() const {
        return albedo_ == absent ? absent : albedo_ + 4;
    }  ///< 0, weight and number of the samples that hit

    uint32_t matrix(int column, int group) const {
        return matrix_ == absent ? absent : matrix_ + uint32_t(column * groups_ + group);
    }

    /// Emission alone has column 0, and no other column has it.
    uint32_t lobe_matrix(int column, int group, size_t lobe) const {
        return lobe_matrix_ == absent
                   ? absent
                   : lobe_matrix_ +
                         uint32_t((size_t(column) * groups_ + size_t(group)) * lobes_ + lobe);
    }

    uint32_t bounce(int column) const {
        return bounces_ == absent ? absent : bounces_ + uint32_t(column);
    }

    uint32_t group(int g) const { return all_ == absent ? absent : all_ + uint32_t(g); }

    uint32_t direct(int g) const { return direct_ == absent ? absent : direct_ + uint32_t(g); }

    uint32_t unoccluded(int g) const {
        return unoccluded_ == absent ? absent : unoccluded_ + uint32_t(g);
    }

    /// Light of a path layer that arrives.
    uint32_t path(size_t layer) const {
        return paths_ == absent ? absent : paths_ + uint32_t(layer);
    }

    /// The same without shadows.
    uint32_t unoccluded_path(size_t layer) const {
        return unoccluded_paths_ == absent ? absent : unoccluded_paths_ + uint32_t(layer);
    }

    /// The first accumulator of a named data layer that is summed, see DataLayer::accumulators().
    uint32_t named_data(size_t layer) const { return named_data_[layer]; }

    /// What a caster took of the group's light; none of the rest.
    uint32_t taken(int g, uint32_t caster) const {
        return taken_ == absent ? absent : taken_ + uint32_t(g) * casters_ + caster;
    }

    /// What clamps took of an accumulator of light.
    uint32_t clamped(uint32_t accumulator) const {
        return clamped_ == absent ? absent : clamped_ + accumulator;
    }

    uint32_t count() const { return count_; }

    /// The accumulator of the even samples alone; `absent` where the film keeps none.
    uint32_t half_of(uint32_t accumulator) const {
        return halves_ || accumulator <= coverage ? count_ + accumulator : absent;
    }

    /// One more than the largest number in use, halves included.
    uint32_t total_count() const { return 2 * count_; }

  private:
    uint32_t groups_ = 0, casters_ = 0, lobes_ = 0, count_ = 0;
    uint32_t albedo_ = absent, lobe_matrix_ = absent, matrix_ = absent, bounces_ = absent,
             all_ = absent, direct_ = absent, unoccluded_ = absent, taken_ = absent,
             paths_ = absent, unoccluded_paths_ = absent, clamped_ = absent;
    std::vector<uint32_t> named_data_;
    bool halves_ = false;
};

}  // namespace velatura::accumulate
