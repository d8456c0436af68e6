// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/dyadic_sum.h"
#include "accumulate/picked_values.h"
#include "base/math.h"
#include "film/layer_set.h"
#include "film/path_labels.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::film {

/// Why a sample is left out of the image.
enum class BadSampleReason : uint8_t { None, NotANumber, Infinite, Negative, Other };

const char* to_string(BadSampleReason reason);

/// What one camera sample brings home. One per thread, cleared and used again: costs nothing for
/// layers not touched.
class SampleRadiance {
  public:
    /// set: its path layers are those that PathAutomaton::make() takes.
    explicit SampleRadiance(const LayerSet& set);

    /// Deposits light that arrived after `bounce` scatterings from light group `group`. Radiance in
    /// the working space, without the pixel filter's weight. Values that are not finite or negative
    /// make the sample bad, and so do sums beyond 2^124.
    /// share: of the sample, for a branch of the path; clamps cut what comes by a branch at that
    /// share of their limit.
    void add(int bounce, int group, const Rgb& radiance, float share = 1.0f);

    /// Deposits what bounce 1 would have brought from `group` without visibility (layer U_<group>),
    /// light that does arrive included. Ignored when the layer set has no shadow layers.
    void add_unoccluded(int group, const Rgb& radiance);

    /// Deposits what the caster took of that light, index into LayerSet::casters; none: nobody
    /// known did.
    void add_occluded(int group, uint32_t caster, const Rgb& radiance);

    /// What path layers want to know of the path; what is added goes by what was said last. Null:
    /// there are none.
    PathLabels* labels() { return labels_ ? &*labels_ : nullptr; }

    /// Marks the sample as bad for a reason that the caller saw. The first reason stays.
    void mark_bad(BadSampleReason reason) {
        if (bad_ == BadSampleReason::None) bad_ = reason;
    }

    /// From here on the sample is one of a catcher, whose light is deposited in catcher() and
    /// plate(), both empty now. Only where the layer set has has_catcher_data().
    void begin_catcher();

    bool meets_catcher() const { return meets_catcher_; }

    /// Light of the catcher in the scene.
    SampleRadiance& catcher() { return catcher_parts_[0]; }

    /// Light of the catcher without everything that is none.
    SampleRadiance& plate() { return catcher_parts_[1]; }

    /// What of radiance() came from the group; only where the layer set has group_layers alone.
    Rgb radiance_of(int group) const;

    bool is_bad() const { return bad_reason() != BadSampleReason::None; }

    BadSampleReason bad_reason() const {
        if (bad_ == BadSampleReason::None && meets_catcher_)
            for (const SampleRadiance& part : catcher_parts_)
                if (part.is_bad()) return part.bad_reason();
        return bad_ == BadSampleReason::None && !fits_floats() ? BadSampleReason::Infinite : bad_;
    }

    /// The sum of all that was added since clear().
    Rgb radiance() const;

    /// radiance(), or the light of the catcher: what a sample's noise is in.
    Rgb light_seen() const {
        return meets_catcher_ ? radiance() + catcher_parts_[0].radiance() : radiance();
    }

    /// From here on, what is added comes by branches of the path.
    void begin_branches() {
        prefix_ = values_[accumulate::AccumulatorTable::beauty].sum;
        has_branches_ = true;
    }

    /// What of radiance() came by branches.
    Rgb branch_radiance() const;

    /// Forgets the sample; weight = 1.
    void clear();

    enum class DepthKind : uint8_t { None, Surface, Volume };

    /// Something covers the sample from this depth on, unless it is known that something nearer
    /// does.
    void cover(DepthKind kind, float at) {
        if (depth_kind != DepthKind::None && depth <= at) return;
        depth_kind = kind;
        depth = at;
    }

    float weight = 1.0f;  ///< pixel filter weight; may be negative (Mitchell)
    float alpha = 0.0f;

    /// Data of the first surface hit; ignored unless `has_hit`.
    bool has_hit = false;
    Rgb albedo = Rgb(0.0f);
    Vec3 N = Vec3(0.0f);  ///< world space
    Vec3 P = Vec3(0.0f);  ///< world space
    float Z = 0.0f;       ///< distance along the camera's view direction
    Vec2 st = Vec2(0.0f);
    uint32_t prim_id = 0xffffffffu;
    uint32_t instance_id = 0xffffffffu;
    /// By image::MatteKind: whose sample it is, see image::matte_id(); 0 = nobody's.
    std::array<uint32_t, accumulate::matte_kinds.size()> matte_ids = {};

    /// Of the named data layers, in their order.
    std::vector<accumulate::PickedValue> data;

    /// What covers the sample; only set for deep images.
    DepthKind depth_kind = DepthKind::None;
    float depth = 0.0f;  ///< of its nearest, along the camera's view direction

  private:
    friend class PixelAccumulator;

    struct Value {
        accumulate::Triple sum;
        bool is_touched = false;  ///< in touched_; else the sum is zero
    };

    /// Whether each of its sums is so far below the largest float that means of such samples are
    /// floats, by whatever weights.
    bool fits_floats() const;

    void deposit(uint32_t accumulator, const accumulate::Triple& radiance);
    void deposit_light(uint32_t accumulator,
                       const accumulate::Triple& radiance,
                       double clamped_share);

    void deposit_paths(int column,
                       int group,
                       const accumulate::Triple& radiance,
                       double clamped_share);
    void deposit_unoccluded_paths(int group, const accumulate::Triple& radiance);

    accumulate::AccumulatorTable table_;
    std::vector<accumulate::PathLayer> path_layers_;
    std::vector<uint32_t> lobe_of_;  ///< per path layer: of the lobe matrix, or none
    std::optional<PathLabels> labels_;
    int last_bounce_;
    bool matrix_, bounces_, groups_, direct_, clamps_;
    float clamp_direct_, clamp_indirect_;
    std::vector<Value> values_;  ///< per accumulator
    std::vector<uint32_t> touched_;
    accumulate::Triple prefix_ = {};  ///< what came before the branches
    bool has_branches_ = false;
    BadSampleReason bad_ = BadSampleReason::None;
    std::vector<SampleRadiance> catcher_parts_;  ///< with a catcher and of the plate, or none
    bool meets_catcher_ = false;
};

}  // namespace velatura::film
